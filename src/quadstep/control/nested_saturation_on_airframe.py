"""Nested saturations ([11]) on a real vehicle: the law of the paper's plant through its Euler angles."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

from quadstep.control.controller import Controller
from quadstep.control.gain import usual
from quadstep.control.model import Model
from quadstep.control.nested_saturation import NestedSaturation, NestedSaturationGains
from quadstep.control.paper_on_airframe import PaperOnAirframe
from quadstep.numbers import Number
from quadstep.vehicle.kinematics import Kinematics


def pair(damping: float, stiffness: float) -> object:
    """A damping [1/s] and a stiffness [1/s^2] that suit a vehicle."""

    def suited(model: Model) -> tuple[Number, Number]:
        return usual(damping)(model), usual(stiffness, 2)(model)

    return suited


@dataclass(frozen=True)
class NestedSaturationOnAirframe(PaperOnAirframe):
    """Nested saturations of the pace of the vehicle, which hold its tilt within their third bound of the path's."""

    name = "nested-saturation"
    label = "nested saturations [11]"
    source = "Castillo, Lozano, Dzul 2005"
    Gains = NestedSaturationGains
    defaults: ClassVar[Mapping[str, object]] = {
        "altitude": pair(8.0, 24.0),
        "yaw": pair(12.0, 50.0),
        "bounds": (6.0, 3.0, 1.5, 0.75),
        "pace": usual(7.0),
    }

    law_on_angles: Controller = field(default_factory=lambda: NestedSaturation(Kinematics.RIGID, feed_forward=True))

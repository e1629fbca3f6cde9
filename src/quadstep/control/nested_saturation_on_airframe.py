"""Nested saturations ([11]) on a real vehicle: the law of the paper's plant through its Euler angles."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

from quadstep.control.nested_saturation import NestedSaturation, NestedSaturationGains
from quadstep.control.paper_on_airframe import PaperOnAirframe
from quadstep.interfaces.controller import Controller
from quadstep.interfaces.gain import usual
from quadstep.interfaces.model import Kinematics


@dataclass(frozen=True)
class NestedSaturationOnAirframe(PaperOnAirframe):
    """Nested saturations of the pace of the vehicle, which hold its tilt within their third bound of the path's."""

    name = "nested-saturation"
    label = "nested saturations [11]"
    source = "Castillo, Lozano, Dzul 2005"
    Gains = NestedSaturationGains
    defaults: ClassVar[Mapping[str, object]] = {
        "altitude": usual((8.0, 24.0), (1, 2)),
        "yaw": usual((12.0, 50.0), (1, 2), "yaw"),
        "bounds": (6.0, 3.0, 1.5, 0.75),
        "pace": usual(4.63),
    }

    law_on_angles: Controller = field(default_factory=lambda: NestedSaturation(Kinematics.RIGID, feed_forward=True))

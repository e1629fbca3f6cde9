"""The planar quadrotor under two proportional-derivative loops: position over pitch."""

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

from quadstep.interfaces.controller import Controller
from quadstep.interfaces.gain import believed, gain, given
from quadstep.interfaces.reference import Reference
from quadstep.numbers import Number, Vector, atan2, vector
from quadstep.vehicle.plants.planar import PlanarCommand, PlanarState, plane


class PlanarPdGains(NamedTuple):
    """The vehicle parameters that the controller assumes, and its gains."""

    mass: Number = believed("mass")
    inertia: Vector = believed("inertia")
    gravity: Number = given(lambda model: model.gravity)
    k_p: Number = gain(4.0, "1/s^2", "position")
    k_v: Number = gain(3.5, "1/s", "velocity")
    k_theta: Number = gain(120.0, "1/s^2", "pitch")
    k_q: Number = gain(20.0, "1/s", "pitch rate")


@dataclass(frozen=True)
class PlanarPd(Controller):
    """The force that the position asks for gives thrust and pitch."""

    name: ClassVar = "planar-pd"
    label: ClassVar = "cascaded PD"
    source: ClassVar = "textbook"
    Gains: ClassVar = PlanarPdGains
    measures: ClassVar = PlanarState

    def law(
        self, memory: tuple[()], measured: PlanarState, reference: Reference, gains: PlanarPdGains, t: Number, period: Number
    ) -> tuple[PlanarCommand, tuple[()]]:
        offset, drift = plane(reference.position) - measured.position, plane(reference.velocity) - measured.velocity
        pull = plane(reference.acceleration) + gains.k_p * offset + gains.k_v * drift + vector(0.0, gains.gravity)
        pitch = atan2(-pull[0], pull[1])
        turn = gains.k_theta * (pitch - measured.pitch) - gains.k_q * measured.rate
        return PlanarCommand(gains.mass * pull.norm(), gains.inertia[1] * turn, pitch), memory

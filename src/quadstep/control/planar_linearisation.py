"""The planar quadrotor made linear exactly: dynamic feedback linearisation, as the paper's [20] has it in space.

The thrust becomes a state with its rate; its second derivative and the torque then decide the fourth derivative of the
position: xi_dddd = (u_dd / m) d + 2 (u_d / m) theta_d e + (u / m) (theta_dd e - theta_d^2 d), d the direction of the thrust,
e = dd/dtheta. Mistler, Benallegue, M'Sirdi (2001).
"""

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

from quadstep.interfaces.controller import Controller
from quadstep.interfaces.gain import believed, gain, given
from quadstep.interfaces.reference import Reference
from quadstep.numbers import Number, Vector, maximum, vector
from quadstep.vehicle.plants.planar import PlanarCommand, PlanarState, plane, thrust_direction

LEAST = 0.2
"""Share of the weight below which the thrust is not let: without thrust pitch moves nothing."""


class PlanarLinearisationGains(NamedTuple):
    """The vehicle parameters that the controller assumes, and its gain."""

    mass: Number = believed("mass")
    inertia: Vector = believed("inertia")
    gravity: Number = given(lambda model: model.gravity)
    pole: Number = gain(6.0, "1/s", "all four poles of the position error", symbol="lambda", low=1.0, high=15.0)


class PlanarLinearisationMemory(NamedTuple):
    """thrust [N], thrust_rate [N/s]."""

    thrust: Number
    thrust_rate: Number


@dataclass(frozen=True)
class PlanarLinearisation(Controller):
    """Four equal poles for the error of the position."""

    name: ClassVar = "planar-linearisation"
    label: ClassVar = "dynamic feedback linearisation"
    source: ClassVar = "Mistler, Benallegue, M'Sirdi 2001"
    Gains: ClassVar = PlanarLinearisationGains
    measures: ClassVar = PlanarState

    def start(self, measured: PlanarState, gains: PlanarLinearisationGains) -> PlanarLinearisationMemory:
        return PlanarLinearisationMemory(gains.mass * gains.gravity, 0.0)

    def law(
        self, memory: PlanarLinearisationMemory, measured: PlanarState, reference: Reference,
        gains: PlanarLinearisationGains, t: Number, period: Number,
    ) -> tuple[PlanarCommand, PlanarLinearisationMemory]:  # fmt: skip
        m, pole, q = gains.mass, gains.pole, measured.rate
        u, u_dot = memory
        d = thrust_direction(measured.pitch)
        e = vector(-d[1], d[0])  # dd/dtheta
        acceleration = u / m * d - vector(0.0, gains.gravity)
        jerk = u_dot / m * d + u * q / m * e
        errors = [
            plane(wanted) - now
            for wanted, now in (
                (reference.position, measured.position),
                (reference.velocity, measured.velocity),
                (reference.acceleration, acceleration),
                (reference.jerk, jerk),
            )
        ]
        square = pole * pole
        snap = plane(reference.snap) + square * (square * errors[0] + 4.0 * pole * errors[1] + 6.0 * errors[2])
        snap = snap + 4.0 * pole * errors[3]
        u_dd = m * (snap @ d) + u * (q * q)
        turn = (m * (snap @ e) - 2.0 * u_dot * q) / u
        least = LEAST * m * gains.gravity
        following = PlanarLinearisationMemory(maximum(u + period * u_dot, least), u_dot + period * u_dd)
        return PlanarCommand(u, gains.inertia[1] * turn, measured.pitch), following

"""Controllers of the planar quadrotor: two proportional-derivative loops, position over pitch, and exact linearisation."""

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

from quadstep.interfaces.controller import Controller
from quadstep.interfaces.gain import believed, gain, given
from quadstep.interfaces.plant import Reference
from quadstep.numbers import Number, Vector, atan2, maximum, vector
from quadstep.vehicle.planar import PlanarCommand, PlanarState, plane, thrust_direction


class PlanarPdGains(NamedTuple):
    """The vehicle parameters that the controller assumes, and its gains."""

    mass: Number = believed("mass")
    inertia: Vector = believed("inertia")
    gravity: Number = given(lambda model: model.gravity)
    k_p: Number = gain(4.0, "1/s^2", "gain of the position error")
    k_v: Number = gain(3.5, "1/s", "gain of the velocity error")
    k_theta: Number = gain(120.0, "1/s^2", "gain of the pitch error")
    k_q: Number = gain(20.0, "1/s", "gain of the pitch rate error")


@dataclass(frozen=True)
class PlanarPd(Controller):
    """Position over pitch: the force that the position asks for gives thrust and pitch."""

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
    """Dynamic feedback linearisation, as the paper's [20] has it in space; four equal poles for the error of the position.

    The thrust becomes a state with its rate; its second derivative and the torque then decide the fourth derivative of the
    position: xi_dddd = (u_dd / m) d + 2 (u_d / m) theta_d e + (u / m) (theta_dd e - theta_d^2 d), d the direction of the
    thrust, e = dd/dtheta. Mistler, Benallegue, M'Sirdi (2001).
    """

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

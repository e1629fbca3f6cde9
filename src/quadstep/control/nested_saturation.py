"""Nested saturations, the controller of the paper's reference [11], tracking the same path.

Castillo, Lozano, Dzul, "Stabilization of a mini rotorcraft having four rotors", IEEE Control Systems Magazine 25 (2005).
Altitude and yaw are linear; y with roll and x with pitch are each stabilised by four nested saturations. It was made to
hold the origin; here it is given the path's position and velocity errors, on the paper's plant without acceleration
feed-forward. What is added for real vehicles is time: [11] places its poles at -1 rad/s.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import ClassVar, NamedTuple, Self

from quadstep.control.paper_on_airframe import PaperOnAirframe
from quadstep.interfaces.controller import Command, Condition, Controller
from quadstep.interfaces.gain import believed, gain, given, usual
from quadstep.interfaces.plant import Kinematics, Model, Reference
from quadstep.numbers import Number, Vector, clip, cos, vector
from quadstep.vehicle.paper import State, coriolis_torque, effective_inertia

PAIR = ("rate", "offset")


class NestedSaturationGains(NamedTuple):
    """slope_1, slope_2: Lambda_1, Lambda_2 [1/s] of the study, to log r1 and r2 on the scale of the paper's controller."""

    mass: Number = believed("mass")
    inertia: Vector = believed("inertia")
    gravity: Number = given(lambda model: model.gravity)
    altitude: Vector = gain((3.0, 0.5), "1/s, 1/s^2", "altitude: damping and stiffness", key="a_z", parts=PAIR)
    yaw: Vector = gain((2.374, 0.08), "1/s, 1/s^2", "yaw: damping and stiffness", key="a_psi", parts=PAIR)
    bounds: Vector = gain(
        (2.0, 1.0, 0.2, 0.1), "-", "bounds of the saturations; [11]: b_i >= 2 b_(i+1)", symbol="b", parts=("1", "2", "3", "4")
    )
    slope_1: Vector = given(lambda _: vector(1.0, 1.0, 1.0))
    slope_2: Vector = given(lambda _: vector(15.0, 15.0, 15.0))
    pace: Number = gain(1.0, "1/s", "speed of the loop: unsaturated, x and y have four poles at -pace each")


class NoMemory(NamedTuple):
    """A controller without memory."""


def nested(bounds: Vector, rate: Number, angle: Number, speed: Number, offset: Number) -> Number:
    """-s1(a_dot + s2(a + a_dot + s3(2a + a_dot + v + s4(a_dot + 3a + 3v + p)))) [rad/s^2]; s_i clips at +-b_i.

    a: angle [rad], a_dot: its rate [rad/s], v: speed / g [s], p: offset / g [s^2]. Unsaturated it places four poles at -1.
    """
    inner = rate + 3.0 * angle + 3.0 * speed + offset
    for bound, outside in zip(reversed(bounds.entries), (2.0 * angle + rate + speed, angle + rate, rate, 0.0), strict=True):
        inner = outside + clip(inner, -bound, bound)
    return -inner


class Chain(NamedTuple):
    """x with pitch, or y with roll. angle: [rad]; speed, offset: over g [s, s^2]; offset'' = speed' = angle."""

    rate: Number
    angle: Number
    speed: Number
    offset: Number


def paced(gains: NestedSaturationGains, chain: Chain) -> Number:
    """The nested saturations [rad/s^2] in units of time of 1 / pace."""
    pace = gains.pace
    square = pace * pace
    return square * nested(gains.bounds, chain.rate / pace, chain.angle, pace * chain.speed, square * chain.offset)


@dataclass(frozen=True)
class NestedSaturation(Controller):
    """[11]'s three loops. Its input change tau = C eta_dot + J tau~ compensates the attitude dynamics exactly.

    feed_forward: whether the path's acceleration and its rates are, as [11]'s small angles have it: theta = -x_dd / g.
    """

    name = "nested-saturation"
    label = "nested saturations [11]"
    source = "Castillo, Lozano, Dzul 2005"
    off_command = "the command leaves out how far the feedback leans the vehicle"
    Gains = NestedSaturationGains
    measures = State

    kinematics: Kinematics = Kinematics.STANDARD
    feed_forward: bool = False

    @classmethod
    def for_vehicle(cls, model: Model) -> Self:
        return cls(model.kinematics)

    def start(self, measured: State, gains: NestedSaturationGains) -> NoMemory:
        return NoMemory()

    def law(
        self, memory: NoMemory, measured: State, reference: Reference, gains: NestedSaturationGains, t: Number,
        period: Number,
    ) -> tuple[Command, NoMemory]:  # fmt: skip
        """One sample; thrust u = m (g - a_z1 z_dot - a_z2 z) / (cos theta cos phi) on path errors."""
        position = measured.position - reference.position
        velocity = measured.velocity - reference.velocity
        (x, y, z), (x_dot, y_dot, z_dot) = position, velocity
        psi, theta, phi = measured.attitude
        psi_dot, theta_dot, phi_dot = measured.rates
        g = gains.gravity
        lift = gains.mass * (g - gains.altitude[0] * z_dot - gains.altitude[1] * z)
        turn = -gains.yaw[0] * (psi_dot - reference.yaw_rate) - gains.yaw[1] * (psi - reference.yaw)
        along, across = Chain(theta_dot, theta, -x_dot / g, -x / g), Chain(phi_dot, phi, y_dot / g, y / g)
        desired = vector(reference.yaw, 0.0, 0.0)
        if self.feed_forward:
            lift = lift + gains.mass * reference.acceleration[2]
            desired = vector(reference.yaw, -reference.acceleration[0] / g, reference.acceleration[1] / g)
            along = along._replace(rate=theta_dot + reference.jerk[0] / g, angle=theta - desired[1])
            across = across._replace(rate=phi_dot - reference.jerk[1] / g, angle=phi - desired[2])
        wanted = vector(turn, paced(gains, along), paced(gains, across))
        if self.feed_forward:
            wanted = wanted + vector(0.0, -reference.snap[0] / g, reference.snap[1] / g)
        inertia = effective_inertia(measured.attitude, gains.inertia, self.kinematics)
        coupling = coriolis_torque(measured.attitude, measured.rates, gains.inertia, self.kinematics)
        e2 = desired - measured.attitude
        command = Command(
            thrust=lift / (cos(theta) * cos(phi)),
            torque=coupling + inertia @ wanted,
            desired_attitude=desired,
            r1=-velocity - gains.slope_1 * position,
            r2=vector(reference.yaw_rate, 0.0, 0.0) - measured.rates + gains.slope_2 * e2,
        )
        return command, memory

    def conditions(self, gains: NestedSaturationGains, model: Model) -> Sequence[Condition]:
        """Each saturation at least twice as wide as the one inside it."""
        return [
            Condition(f"b_{i + 1} >= 2 b_{i + 2}", outer, 2.0 * inner, "reference [11]", key="bounds")
            for i, (outer, inner) in enumerate(pairwise(gains.bounds))
        ]


@dataclass(frozen=True)
class NestedSaturationOnAirframe(PaperOnAirframe):
    """Nested saturations, paced for the vehicle; the third bound limits how far roll and pitch settle from the path's."""

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

"""Linear quadratic regulator about hover: one gain matrix for position, velocity, tilt and turn; with a planner too.

The errors are taken in axes turned by the heading alone, so the same gains serve any heading. Small tilt makes level
acceleration g times tilt, and torque over inertia the angular acceleration (Bouabdallah, Noth, Siegwart 2004).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

from quadstep.control.vectoring import PositionIntegral, integral_for, project
from quadstep.interfaces.controller import Command, Controller, Measured
from quadstep.interfaces.gain import believed, gain, given, usual
from quadstep.interfaces.plant import Model, Reference
from quadstep.numbers import Number, Vector, absolute, atan2, cos, sin, vector
from quadstep.numbers.rotations import conjugate, from_yaw_pitch_roll, heading, multiply, rotation_vector
from quadstep.numbers.solve import solve_square
from quadstep.numbers.structure import from_fields
from quadstep.world.paths import Point, Quintic, along, quintic

MOST_STEPS, SMALL = 1000, 1e-13
"""Of Newton's method, and the relative step after which it has converged: the one before was a few digits of that."""


LEVEL = ("integral", "position", "velocity", "tilt", "tilt rate", "input")
CLIMB, TURN = ("integral", "position", "velocity", "input"), ("heading", "rate", "input")
"""What has a weight; of all but the last, the input, the law has a gain."""


class LqrWeights(NamedTuple):
    """Assumed vehicle parameters, and the weights on squared errors: what one unit of each is worth."""

    mass: Number = believed("mass")
    inertia: Vector = believed("inertia")
    gravity: Number = given(lambda model: model.gravity)
    level: Vector = gain(
        usual((6.6, 12.4, 0.4, 0.097, 0.18, 0.003), (10, 8, 6, 4, 2, 0)),
        "-",
        "weights of integral, position, velocity, tilt, tilt rate and angular acceleration",
        parts=LEVEL,
    )
    climb: Vector = gain(
        usual((60.0, 26.0, 2.8, 1.0), (6, 4, 2, 0)),
        "-",
        "weights of integral, position, velocity and acceleration",
        parts=CLIMB,
    )
    turn: Vector = gain(
        usual((40.0, 4.0, 0.4), (4, 2, 0), "yaw"), "-", "weights of heading, its rate and angular acceleration", parts=TURN
    )
    integral_bound: Number = gain(5.0, "m s", "bound on the integral of the position error")


class LqrGains(NamedTuple):
    """What the law flies, worked out from `LqrWeights`.

    level: of one level axis, giving an angular acceleration. climb: giving an acceleration. turn: an angular acceleration.
    """

    mass: Number = believed("mass")
    inertia: Vector = believed("inertia")
    gravity: Number = given(lambda model: model.gravity)
    level: Vector = gain(None, "", "gains on integral, position, velocity, tilt and tilt rate", parts=LEVEL[:-1])
    climb: Vector = gain(None, "", "gains on integral, position and velocity", parts=CLIMB[:-1])
    turn: Vector = gain(None, "", "gains on heading and its rate", parts=TURN[:-1])
    integral_bound: Number = gain(None, "m s", "bound on the integral of the position error")


def regulator(links: Sequence[float], weights: Sequence[float], price: float) -> list[float]:
    """Gains K, u = -K x, that minimise the integral of sum_i weights_i x_i^2 + price u^2.

    Along a chain, x_i' = links_i x_(i+1) and x_n' = u; links: n - 1 factors; weights: n. With all links 1 and w_i the weights
    per price, the closed loop's polynomial p has p(s) p(-s) = s^n (-s)^n + sum_i w_i s^i (-s)^i, and its roots are on the left
    (Kalman 1964).
    """
    scales = [1.0]
    for link in reversed(links):
        scales.insert(0, scales[0] * link)
    even = [weight * scale * scale / price for weight, scale in zip(weights, scales, strict=True)]
    return [coefficient / scale for coefficient, scale in zip(spectral_factor(even), scales, strict=True)]


def spectral_factor(even: Sequence[float]) -> list[float]:
    """Coefficients p_0 to p_(n-1) of p(s) = s^n + ..., all roots on the left, with

        p(s) p(-s) = s^n (-s)^n + sum_i even_i s^i (-s)^i.

    Newton's method, which converges from any p with its roots on the left, as for the Riccati equation (Kleinman 1968): here
    from (s + w)^n, w a power of two beyond every root. Each step is solved for in proportion to the coefficients, which may be
    of very different sizes.
    """
    count = len(even)
    pace = 1.0
    while outgrown(even, pace):
        pace *= 2.0
    p = [1.0]
    for _ in range(count):  # times (s + w)
        p = [pace * low + high for low, high in zip((*p, 0.0), (0.0, *p), strict=True)]
    for _ in range(MOST_STEPS):
        rows = [[0.0] * count for _ in even]
        right = []
        for i, row in enumerate(rows):
            square = p[i] * p[i]
            product, sign = 0.5 * (even[i] / square - 1.0), 1.0
            row[i] = 1.0
            for j in range(1, min(i, count - i) + 1):
                sign = -sign
                part = sign * (p[i - j] * p[i + j] / square)
                product -= part
                row[i - j] += part
                if i + j < count:
                    row[i + j] += part
            right.append(product)
        steps = solve_square(rows, right)
        p = [*(one + one * step for one, step in zip(p, steps, strict=False)), 1.0]
        if max(map(absolute, steps)) < SMALL:
            break
    return p[:-1]


def outgrown(even: Sequence[float], pace: float) -> bool:
    """Whether some even_i is more than pace^(2 n - 2 i)."""
    power = 1.0
    for value in reversed(even):
        power *= pace * pace
        if power < value:
            return True
    return False


@dataclass(frozen=True)
class Lqr(Controller):
    """State feedback at the attitude loop's rate, with the path's acceleration fed forward as thrust and tilt."""

    name = "lqr"
    label = "linear quadratic regulator"
    source = "Bouabdallah, Noth, Siegwart 2004"
    off_command = "the command leaves out how far the feedback leans the vehicle"
    Gains = LqrWeights

    def prepare(self, gains: LqrWeights, model: Model) -> LqrGains:
        level, climb, turn = (one.entries for one in (gains.level, gains.climb, gains.turn))
        return from_fields(
            LqrGains,
            gains,
            level=Vector(regulator((1.0, 1.0, gains.gravity, 1.0), level[:-1], level[-1])),
            climb=Vector(regulator((1.0, 1.0), climb[:-1], climb[-1])),
            turn=Vector(regulator((1.0,), turn[:-1], turn[-1])),
        )

    def start(self, measured: Measured, gains: LqrGains) -> PositionIntegral:
        return PositionIntegral()

    def enter(self, measured: Measured, reference: Reference, gains: LqrGains) -> PositionIntegral:
        """The integral gives what the law would not command without it."""
        command, _ = Lqr.law(self, PositionIntegral(), measured, reference, gains, 0.0, 0.0)
        missing, yaw = measured.torque - command.torque, heading(measured.attitude)
        left, ahead = missing[0] / gains.inertia[0], -missing[1] / gains.inertia[1]
        s, c, rising = sin(yaw), cos(yaw), (command.thrust - measured.thrust) / gains.mass
        entries = vector(gains.level[0], gains.level[0], gains.climb[0])
        part = vector(c * ahead - s * left, s * ahead + c * left, rising)
        return PositionIntegral(integral_for(part, entries, gains.integral_bound))

    def law(
        self, memory: PositionIntegral, measured: Measured, reference: Reference, gains: LqrGains, t: Number, period: Number
    ) -> tuple[Command, PositionIntegral]:
        """One sample. Errors are state less wanted state; positive tilt is what accelerates along the axis."""
        yaw = heading(measured.attitude)
        s, c = sin(yaw), cos(yaw)

        def levelled(v: Vector) -> tuple[Number, Number]:
            return c * v[0] + s * v[1], c * v[1] - s * v[0]

        position, velocity = measured.position - reference.position, measured.velocity - reference.velocity
        forward, left = zip(*(levelled(v) for v in (memory.integral, position, velocity, reference.acceleration)), strict=True)
        tilt = rotation_vector(multiply(conjugate(from_yaw_pitch_roll(vector(yaw, 0.0, 0.0))), measured.attitude))
        lean_x = vector(*forward[:3], tilt[1] - forward[3] / gains.gravity, measured.rates[1])
        lean_y = vector(*left[:3], -tilt[0] - left[3] / gains.gravity, -measured.rates[0])
        turned = rotation_vector(
            multiply(
                conjugate(from_yaw_pitch_roll(vector(reference.yaw, 0.0, 0.0))), from_yaw_pitch_roll(vector(yaw, 0.0, 0.0))
            )
        )
        around = -(gains.turn @ vector(turned[2], measured.rates[2] - reference.yaw_rate))
        rising = -(gains.climb @ vector(memory.integral[2], position[2], velocity[2]))
        angular = vector(gains.level @ lean_y, -(gains.level @ lean_x), around)
        command = Command(
            thrust=gains.mass * (gains.gravity + reference.acceleration[2] + rising),
            torque=gains.inertia * angular,
            desired_attitude=vector(reference.yaw, forward[3] / gains.gravity, -left[3] / gains.gravity),
        )
        return command, PositionIntegral(project(memory.integral + period * position, gains.integral_bound))


HORIZON = 1.0
"""How far ahead a plan meets the path [s]."""


class PlannedLqrMemory(NamedTuple):
    """lqr: of the regulator. plan: of (x, y, z, yaw) [m, rad]. begun [s]: when it was made."""

    lqr: PositionIntegral
    plan: Quintic
    begun: Number


def output(reference: Reference) -> Point:
    """Place and heading of a path, with their rates."""
    return Point(
        Vector((*reference.position, reference.yaw)),
        Vector((*reference.velocity, reference.yaw_rate)),
        Vector((*reference.acceleration, 0.0)),
    )


def planned(memory: PlannedLqrMemory, t: Number) -> Reference:
    """The plan at time t [s]."""
    values, rates, changes, jerks, snaps = along(memory.plan, t - memory.begun, HORIZON)
    *_, yaw = values
    *_, yaw_rate = rates
    place, speed, pull, jerk, snap = (Vector(list(one)[:3]) for one in (values, rates, changes, jerks, snaps))
    return Reference(place, speed, pull, yaw, yaw_rate, jerk, snap)


@dataclass(frozen=True)
class PlannedLqr(Lqr):
    """A planner with LQR path following: the paper's reference [24]. `plan` is the planner, `law` the regulator.

    Cowling, Yakimenko, Whidborne, Cooke, "A prototype of an autonomous controller for a quadrotor UAV", European Control
    Conference (2007). The outputs, place and heading, determine every state and input of a quadrotor, so a plan is a
    polynomial in them: from where the vehicle is to where the path is a second later. It is replanned before that.
    """

    name = "planned-lqr"
    label = "planner with LQR [24]"
    source = "Cowling, Yakimenko, Whidborne, Cooke 2007"
    preview = (HORIZON,)
    defaults: ClassVar[Mapping[str, object]] = {"level": (40.0, 40.0, 4.0, 1.0, 0.3, 0.002), "climb": (20.0, 40.0, 4.0, 1.0)}
    rates = {"plan": 0.4, "law": 0.002}  # noqa: RUF012 (as the base class declares it)

    def start(self, measured: Measured, gains: LqrGains) -> PlannedLqrMemory:  # type: ignore[override]
        """A plan that stays where the vehicle is."""
        rest = vector(0.0, 0.0, 0.0, 0.0)
        here = Vector((*measured.position, heading(measured.attitude)))
        return PlannedLqrMemory(super().start(measured, gains), Quintic(here, rest, rest, rest, rest, rest), 0.0)

    def enter(self, measured: Measured, reference: Reference, gains: LqrGains) -> PlannedLqrMemory:  # type: ignore[override]
        return self.start(measured, gains)._replace(lqr=super().enter(measured, reference, gains))

    def plan(
        self, memory: PlannedLqrMemory, measured: Measured, reference: Reference, gains: LqrGains, t: Number,
        period: Number,
    ) -> PlannedLqrMemory:  # fmt: skip
        """A plan from where the vehicle is. Its accelerations, of the heading too, are the plan's before: the measured tilt
        also holds the wind.
        """
        (later,) = reference.ahead
        turned = heading(measured.attitude) - reference.yaw
        yaw = reference.yaw + atan2(sin(turned), cos(turned))  # on the turn of the path's
        _, _, change, *_ = along(memory.plan, t - memory.begun, HORIZON)
        start = Point(Vector((*measured.position, yaw)), Vector((*measured.velocity, measured.rates[2])), change)
        return memory._replace(plan=quintic(start, output(later), HORIZON), begun=t)

    def law(  # type: ignore[override]
        self, memory: PlannedLqrMemory, measured: Measured, reference: Reference, gains: LqrGains, t: Number, period: Number
    ) -> tuple[Command, PlannedLqrMemory]:
        """The regulator's sample on the plan, its integral that of the error to the path: a plan starts without one."""
        command, _ = super().law(memory.lqr, measured, planned(memory, t), gains, t, period)
        integral = memory.lqr.integral + period * (measured.position - reference.position)
        return command, memory._replace(lqr=PositionIntegral(project(integral, gains.integral_bound)))

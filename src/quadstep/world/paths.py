"""Paths over time: point to point with the least jerk (Eqs 68-75), closed curves, steps, and those of your own files.

A path is a `PathLaw`: from a time [s] and its parameters it computes a `Reference` in the world frame, z up. Missions name
paths in `[path]`; here they are laws over numbers, to evaluate, plot, or fly in your own plan. `pieces.py` has more.

>>> from quadstep.world.paths import MinimumJerk, MinimumJerkParameters
>>> from quadstep.numbers import vector
>>> up = MinimumJerkParameters(vector(0.0, 0.0, 0.0), vector(0.0, 0.0, 2.0), yaw_start=0.0, yaw_end=0.0, duration=4.0)
>>> [MinimumJerk().reference(t, up).position[2] for t in (0.0, 2.0, 4.0, 9.0)]
[0.0, 1.0, 2.0, 2.0]
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

from quadstep.interfaces.plant import PathLaw, Reference
from quadstep.numbers import Number, Table, Vector, clip, cos, maximum, sin, vector, where
from quadstep.numbers.functions import number, word

__all__ = [
    "DeclaredPath", "MinimumJerk", "MinimumJerkParameters", "Orbit", "OrbitParameters", "PathLaw", "Reference",
    "Step", "StepParameters",
]  # fmt: skip


@dataclass(frozen=True)
class DeclaredPath(ABC):
    """A `PathLaw`; structure only, so it has no fields. Numbers: declared, each with a default.

    >>> from typing import NamedTuple
    >>> from quadstep.interfaces.gain import gain
    >>> from quadstep.interfaces.plant import PathLaw, Reference
    >>> from quadstep.world.paths import DeclaredPath
    >>> from quadstep.numbers import vector
    >>> class ClimbNumbers(NamedTuple):
    ...     speed: float = gain(0.5, "m/s", "how fast it climbs")
    ...     height: float = gain(10.0, "m", "how high")
    >>> class Climb(DeclaredPath):
    ...     Numbers = ClimbNumbers
    ...     def length(self, numbers):
    ...         return numbers.height / numbers.speed
    ...     def reference(self, t, numbers):
    ...         rest = vector(0.0, 0.0, 0.0)
    ...         return Reference(vector(0.0, 0.0, numbers.speed * t), vector(0.0, 0.0, numbers.speed), rest, 0.0, 0.0)
    >>> Climb().length(ClimbNumbers(0.5, 10.0))
    20.0
    """

    Numbers: ClassVar[type]

    @abstractmethod
    def length(self, numbers: object) -> Number:
        """How long the path takes [s]: the flight's duration, unless the mission says another."""

    @abstractmethod
    def reference(self, t: Number, numbers: object) -> Reference:
        """The wanted motion at time t [s], also after the path's end."""


class Point(NamedTuple):
    """Value and its first and second rate; vectors of one length."""

    value: Vector
    rate: Vector
    change: Vector


class Quintic(NamedTuple):
    """p = sum of c_k s^k, s the share of the time that has passed. c0, c1, c2, c3, c4, c5: coefficients, in the unit of p."""

    c0: Vector
    c1: Vector
    c2: Vector
    c3: Vector
    c4: Vector
    c5: Vector


def quintic(start: Point, end: Point, span: Number) -> Quintic:
    """The polynomial that joins both in `span` [s]."""
    square = span * span
    c0, c1, c2 = start.value, span * start.rate, (0.5 * square) * start.change
    miss = end.value - c0 - c1 - c2
    slope = span * end.rate - c1 - 2.0 * c2
    bend = square * end.change - 2.0 * c2
    return Quintic(
        c0,
        c1,
        c2,
        10.0 * miss - 4.0 * slope + 0.5 * bend,
        7.0 * slope - 15.0 * miss - bend,
        6.0 * miss - 3.0 * slope + 0.5 * bend,
    )


def along(p: Quintic, time: Number, span: Number) -> tuple[Vector, Vector, Vector, Vector, Vector]:
    """Its value and its first four rates, `time` [s] after the start."""
    s, per = time / span, 1.0 / span
    value = p.c0 + s * (p.c1 + s * (p.c2 + s * (p.c3 + s * (p.c4 + s * p.c5))))
    rate = p.c1 + s * (2.0 * p.c2 + s * (3.0 * p.c3 + s * (4.0 * p.c4 + s * (5.0 * p.c5))))
    change = 2.0 * p.c2 + s * (6.0 * p.c3 + s * (12.0 * p.c4 + s * (20.0 * p.c5)))
    third = 6.0 * p.c3 + s * (24.0 * p.c4 + s * (60.0 * p.c5))
    fourth = 24.0 * p.c4 + s * (120.0 * p.c5)
    square = per * per
    return value, per * rate, square * change, (square * per) * third, (square * square) * fourth


class MinimumJerkParameters(NamedTuple):
    """start, end: xi_d at 0 and t_f [m]. yaw_start, yaw_end: psi_d there [rad]. duration: t_f [s]."""

    start: Vector
    end: Vector
    yaw_start: Number
    yaw_end: Number
    duration: Number


def blend(t: Number, duration: Number) -> tuple[Number, Number, Number]:
    """Share of the way done at time t [s], with its first [1/s] and second [1/s^2] rate.

    With a_3 = 10 d, a_4 = -15 d / t_f, a_5 = 6 d / t_f^2, the solution of Eq. 70 and Eq. 71, Eq. 72 is
    x_d0 + (x_df - x_d0) (10 s^3 - 15 s^4 + 6 s^5) with s = t / t_f; this form ends exactly at rest.
    """
    s = clip(t / duration, 0.0, 1.0)
    rest, per_time = 1.0 - s, 1.0 / duration
    share = s * s * s * (10.0 + s * (-15.0 + 6.0 * s))
    rate = 30.0 * s * s * rest * rest * per_time
    change = 60.0 * s * rest * (1.0 - 2.0 * s) * (per_time * per_time)
    return share, rate, change


def blend_bend(t: Number, duration: Number) -> tuple[Number, Number]:
    """Third [1/s^3] and fourth [1/s^4] rate of the blend: 60 (1 - 6 s + 6 s^2) / t_f^3 and 360 (2 s - 1) / t_f^4.

    Both jump at the ends: they are those of the way from 0 on, and zero before it and from t_f on.
    """
    s = t / duration
    third = (60.0 + 360.0 * s * (s - 1.0)) / (duration * duration * duration)
    fourth = (720.0 * s - 360.0) / (duration * duration * duration * duration)

    def on_the_way(x: Number) -> Number:
        return where(s < 0.0, 0.0, where(s < 1.0, x, 0.0))

    return on_the_way(third), on_the_way(fourth)


@dataclass(frozen=True)
class MinimumJerk:
    """Eq. 68, Eq. 69, Eq. 72, Eq. 73 and Eq. 74 along a straight line, yaw blended the same way.

    >>> from quadstep.world.paths import MinimumJerk, MinimumJerkParameters
    >>> from quadstep.numbers import vector
    >>> way = MinimumJerkParameters(vector(0.0, 0.0, 0.0), vector(1.0, 0.0, 2.0), yaw_start=0.0, yaw_end=0.5, duration=4.0)
    >>> halfway = MinimumJerk().reference(2.0, way)
    >>> halfway.position, halfway.yaw, halfway.velocity[0]  # 15/8 of the mean speed
    (Vector([0.5, 0.0, 1.0]), 0.25, 0.46875)
    """

    def reference(self, t: Number, parameters: MinimumJerkParameters) -> Reference:
        """The wanted motion at time t [s]; before 0 and after t_f it rests at the ends."""
        share, rate, change = blend(t, parameters.duration)
        third, fourth = blend_bend(t, parameters.duration)
        way = parameters.end - parameters.start
        turn = parameters.yaw_end - parameters.yaw_start
        return Reference(
            position=parameters.start + share * way,
            velocity=rate * way,
            acceleration=change * way,
            yaw=parameters.yaw_start + share * turn,
            yaw_rate=rate * turn,
            jerk=third * way,
            snap=fourth * way,
            yaw_acceleration=change * turn,
        )


class OrbitParameters(NamedTuple):
    """Axis i follows centre_i + amplitude_i sin(frequency_i s + phase_i), s the time flown at full speed [s].

    centre, amplitude [m]; frequency [rad/s]; phase [rad]; yaw at the start [rad]; yaw_rate at full speed [rad/s];
    ramp: seconds over which the speed along the curve rises from rest (0: at full speed at once).
    """

    centre: Vector
    amplitude: Vector
    frequency: Vector
    phase: Vector
    yaw: Number
    yaw_rate: Number
    ramp: Number


def ramped_time(t: Number, ramp: Number) -> tuple[Number, Number, Number]:
    """Time along the curve [s] at clock time t [s], its rate (0 to 1) and the rate of that [1/s].

    The rate rises as the minimum-jerk blend, whose integral over the ramp T is T (5/2 w^4 - 3 w^5 + w^6), w = t / T.
    """
    length = where(ramp > 0.0, ramp, 1.0)
    w = clip(t / length, 0.0, 1.0)
    share, change, _ = blend(t, length)
    entering = length * (w * w * w * w * (2.5 + w * (w - 3.0)))
    s = where(t < length, entering, t - 0.5 * length)
    instant = ramp <= 0.0
    return where(instant, t, s), where(instant, 1.0, share), where(instant, 0.0, change)


def ramp_bend(t: Number, ramp: Number) -> tuple[Number, Number]:
    """Third [1/s^2] and fourth [1/s^3] rate of the time along the curve: second and third of the blend."""
    length = where(ramp > 0.0, ramp, 1.0)
    _, _, third = blend(t, length)
    fourth, _ = blend_bend(t, length)
    instant = ramp <= 0.0
    return where(instant, 0.0, third), where(instant, 0.0, fourth)


@dataclass(frozen=True)
class Orbit:
    """A circle (equal frequencies, phases a quarter turn apart) or a figure eight (one axis at twice the frequency).

    >>> from quadstep.world.paths import Orbit, OrbitParameters
    >>> from quadstep.numbers import vector
    >>> zero, rate, quarter = vector(0.0, 0.0, 0.0), vector(0.5, 0.5, 0.5), vector(1.5707963267948966, 0.0, 0.0)
    >>> circle = OrbitParameters(zero, vector(2.0, 2.0, 0.0), rate, quarter, yaw=0.0, yaw_rate=0.0, ramp=0.0)
    >>> start = Orbit().reference(0.0, circle)
    >>> start.position, start.velocity[1]
    (Vector([2.0, 0.0, 0.0]), 1.0)
    """

    def reference(self, t: Number, parameters: OrbitParameters) -> Reference:
        """The wanted motion at time t [s], repeated for ever."""
        s, rate, change = ramped_time(t, parameters.ramp)
        third, fourth = ramp_bend(t, parameters.ramp)
        angle = s * parameters.frequency + parameters.phase
        sine, cosine = Vector(sin(a) for a in angle), Vector(cos(a) for a in angle)
        along = parameters.amplitude * parameters.frequency * cosine
        bend = -(parameters.amplitude * parameters.frequency * parameters.frequency * sine)
        squares = parameters.frequency * parameters.frequency
        back, over = -(squares * along), -(squares * bend)  # third and fourth rate along the curve
        return Reference(
            position=parameters.centre + parameters.amplitude * sine,
            velocity=rate * along,
            acceleration=(rate * rate) * bend + change * along,
            yaw=parameters.yaw + parameters.yaw_rate * s,
            yaw_rate=parameters.yaw_rate * rate,
            # chain rule for the third and fourth rate of a curve run through at a changing speed
            jerk=(rate * rate * rate) * back + (3.0 * rate * change) * bend + third * along,
            snap=(rate * rate * rate * rate) * over
            + (6.0 * rate * rate * change) * back
            + (3.0 * change * change + 4.0 * rate * third) * bend
            + fourth * along,
            yaw_acceleration=parameters.yaw_rate * change,
        )


class StepParameters(NamedTuple):
    """start, end: xi_d before and after [m]. time: of the jump [s]. yaw [rad]."""

    start: Vector
    end: Vector
    time: Number
    yaw: Number


@dataclass(frozen=True)
class Step:
    """Not a motion a vehicle can follow; what a controller makes of it is told by its overshoot and settling.

    >>> from quadstep.world.paths import Step, StepParameters
    >>> from quadstep.numbers import vector
    >>> jump = StepParameters(vector(0.0, 0.0, 1.0), vector(0.0, 0.0, 2.0), time=1.0, yaw=0.0)
    >>> [Step().reference(t, jump).position[2] for t in (0.5, 1.0, 1.5)]
    [1.0, 2.0, 2.0]
    """

    def reference(self, t: Number, parameters: StepParameters) -> Reference:
        """The wanted position at time t [s], all rates zero."""
        after = where(t >= parameters.time, 1.0, 0.0)
        zero = vector(0.0, 0.0, 0.0)
        position = parameters.start + after * (parameters.end - parameters.start)
        return Reference(position, zero, zero, parameters.yaw, 0.0)


class SetpointParameters(NamedTuple):
    """position: x, y, z [m]; yaw [rad]; from time 0 on every `period` [s]."""

    position: tuple[Table, Table, Table]
    yaw: Table
    period: Number


@dataclass(frozen=True)
class Setpoints:
    """What a vehicle was told while it flew.

    >>> from quadstep.world.paths import SetpointParameters, Setpoints
    >>> from quadstep.numbers import Table
    >>> still = Table([0.0, 0.0])
    >>> Setpoints().reference(0.15, SetpointParameters((Table([1.0, 2.0]), still, still), still, 0.1)).position
    Vector([2.0, 0.0, 0.0])
    """

    def reference(self, t: Number, parameters: SetpointParameters) -> Reference:
        """The setpoint held at time t [s]."""
        place = number(word(maximum(t * (1.0 / parameters.period) + 1e-6, 0.0)))
        zero = vector(0.0, 0.0, 0.0)
        position = Vector(table.at(place) for table in parameters.position)
        return Reference(position, zero, zero, parameters.yaw.at(place), 0.0)

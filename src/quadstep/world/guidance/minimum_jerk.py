"""Point to point with the least jerk, Eqs 68-75; the end point is held afterwards. And any polynomial of fifth degree, from
one place, velocity and acceleration to another in a given time.
"""

from dataclasses import dataclass
from typing import NamedTuple

from quadstep.interfaces.reference import Reference
from quadstep.numbers import Number, Vector, clip, where


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

    >>> from quadstep.world.guidance import MinimumJerk, MinimumJerkParameters
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

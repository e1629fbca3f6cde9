"""A polynomial of fifth degree from one place, velocity and acceleration to another in a given time."""

from typing import NamedTuple

from quadstep.numbers import Number, Vector


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

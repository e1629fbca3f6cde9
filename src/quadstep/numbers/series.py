"""Enclosures of functions of a square that are smooth at zero, where the law takes a root and divides by it: power series."""

from __future__ import annotations

from collections.abc import Sequence
from math import factorial

import numpy as np

from quadstep.numbers.affine import ELEMENTARY, Array, Enclosure, Operand, Third, without_fresh_error

FEW, MANY = 12, 60

COSINE = [(-0.25) ** k / factorial(2 * k) for k in range(FEW)]
"""cos(a / 2) in powers of a^2; the truncation error is below 1e-22 for a^2 <= 1."""

SINE = [0.5 * (-0.25) ** k / factorial(2 * k + 1) for k in range(FEW)]
"""sin(a / 2) / a in powers of a^2."""

ANGLE = [(-1.0) ** k / (2 * k + 1) for k in range(MANY)]
"""arctan(t) / t in powers of t^2; the truncation error is below 1e-20 for t^2 <= 0.4, that of its third slope below 1e-15."""

FARTHEST, WIDEST = 1.0, 0.4
"""Largest a^2 and t^2."""

LEFT_OUT = 1e-18
"""More than the error of the laws' own parabolas near zero."""


def horner(coefficients: Sequence[float], x: Array) -> Array:
    """The polynomial's value."""
    value = np.zeros_like(x)
    for one in reversed(coefficients):
        value = value * x + one
    return value


def slopes(coefficients: Sequence[float], times: int) -> list[float]:
    """Coefficients of its derivative of this order."""
    found = list(coefficients)
    for _ in range(times):
        found = [k * one for k, one in enumerate(found)][1:]
    return found


def series(x: Enclosure, coefficients: Sequence[float]) -> Enclosure:
    """The function at numbers within its range."""
    value, slope = horner(coefficients, x.centre), horner(slopes(coefficients, 1), x.centre)
    second = slopes(coefficients, 2)
    most = np.abs(x.centre) + x.tight
    width, room = x.tight, 1.0 + 1e-9
    bend = 0.5 * horner(np.abs(second).tolist(), most) * width * width * room
    left = horner(np.abs(slopes(coefficients, 3)).tolist(), most) * width * width * width / 6.0 * room
    third = Third(0.5 * horner(second, x.centre), left)
    return without_fresh_error(x, value, slope, bend, 2.0 * ELEMENTARY + LEFT_OUT, third)


def within(x: Enclosure, most: float) -> bool:
    """Whether a series may be used."""
    return bool(np.all(np.abs(x.centre) + x.tight <= most))


def half_turn(square: Enclosure) -> tuple[Enclosure, Enclosure] | None:
    """cos(a / 2) and sin(a / 2) / a of an angle's square; None where it may be too large."""
    return (series(square, COSINE), series(square, SINE)) if within(square, FARTHEST) else None


def turn_ratio(square: Operand, cosine: Operand) -> Enclosure | None:
    """2 atan2(s, c) / s from s^2 and c > 0, for a quaternion of any length; for tiny s laws assume length 1.

    None where the angle may be too large.
    """
    if not isinstance(square, Enclosure) or not np.all((cosine.low if isinstance(cosine, Enclosure) else cosine) > 0.5):
        return None
    over = 1.0 / cosine
    ratio = square * (over * over)
    if not isinstance(ratio, Enclosure) or not within(ratio, WIDEST):
        return None
    found = 2.0 * over * series(ratio, ANGLE)
    assert isinstance(found, Enclosure)
    if not np.any(square.low < 1e-10):
        return found
    other = 2.0 * (over - 1.0)
    off = (other.size if isinstance(other, Enclosure) else np.abs(other)) + 1e-9
    return found.made(found.centre, found.parts, found.rest, found.reach, off)

"""The own elementary functions on their short intervals, as `elementary.py` computes them: what Gappa and rationals are asked.

A test feeds floats through these formulas and through the functions that fly, and wants the same bits.
"""

import math
from collections.abc import Callable
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from quadstep.numbers.kinds import Number
from quadstep.numbers.operation import ARCTANGENT, COSINE, EXPONENTIAL, LOGARITHM, POWER_OF_TWO, QUARTER_TURN, SINE, polynomial

PLACES = 40
LN2 = Fraction(round(Fraction("0.69314718055994530941723212145817656807550013436026") * 2**110), 2**110)
"""Off by less than 2^-110; with the coefficients rounded so, 2^r is off by less than 2^-104: the remainder has room."""


class Kernel(NamedTuple):
    """result = lead + tail(r), |r| <= most. lead: 0, 1 or r itself, exactly.

    tail: in numbers, of r and whether in f64. series: Taylor's coefficients of the true function. remainder: bounds what
    the series leaves off, times r^len(series), there.
    """

    name: str
    tail: Callable[[Number, bool], Number]
    whole: Callable[[Number, bool], Number]
    most: Fraction
    relative: bool
    series: tuple[Fraction, ...]
    remainder: Fraction


def kept(table: dict[bool, tuple[float, ...]], double: bool) -> tuple[float, ...]:
    """A table's numbers as f64 or f32 holds them."""
    return table[True] if double else tuple(float(np.float32(number)) for number in table[False])


def sine_tail(r: Number, double: bool) -> Number:
    """What sine adds to r."""
    z = r * r
    value: Number = (r * z) * polynomial(z, kept(SINE, double))
    return value


def arctangent_tail(r: Number, double: bool) -> Number:
    """What the arctangent adds to r."""
    z = r * r
    value: Number = r * (z * polynomial(z, kept(ARCTANGENT, double)))
    return value


def cosine(r: Number, double: bool) -> Number:
    """1 - r^2 / 2 + ..."""
    z = r * r
    value: Number = 1.0 - (0.5 * z - (z * z) * polynomial(z, kept(COSINE, double)))
    return value


def exponential(r: Number, double: bool) -> Number:
    """1 + r + ..."""
    value: Number = 1.0 + (r + (r * r) * polynomial(r, kept(EXPONENTIAL, double)))
    return value


def power_of_two(r: Number, double: bool) -> Number:
    """2^r."""
    value: Number = 1.0 + r * polynomial(r, kept(POWER_OF_TWO, double))
    return value


def logarithm_tail(s: Number, double: bool) -> Number:
    """log((1 + s) / (1 - s)) - 2 s over s: what is added to f - f^2 / 2 by way of s = f / (2 + f)."""
    z = s * s
    value: Number = z * polynomial(z, kept(LOGARITHM, double))
    return value


def reduced(x: Number, count: Number, double: bool) -> Number:
    """An angle less `count` quarter turns."""
    high, middle, low = kept(QUARTER_TURN, double)
    return x - count * high - count * middle - count * low


def alternating(first: int, step: int, of: Callable[[int], Fraction]) -> tuple[Fraction, ...]:
    """Coefficients (-1)^k of(first + step k) at r^(first + step k), zeros between, up to PLACES."""
    row = [Fraction(0)] * PLACES
    for k, place in enumerate(range(first, PLACES, step)):
        row[place] = (-1) ** k * of(place)
    return tuple(row)


def factorial(place: int) -> Fraction:
    """1 / place!"""
    return Fraction(1, math.factorial(place))


EIGHTH = Fraction(7855, 10000)
"""A little above pi / 4: the reduction rounds."""

KERNELS = (
    Kernel("sin", sine_tail, lambda r, d: r + sine_tail(r, d), EIGHTH, True, alternating(1, 2, factorial), factorial(PLACES)),
    Kernel("cos", cosine, cosine, EIGHTH, False, alternating(0, 2, factorial), factorial(PLACES)),
    Kernel("exp", exponential, exponential, Fraction(3466, 10000), False,
           tuple(factorial(k) for k in range(PLACES)), 2 * factorial(PLACES)),
    Kernel("2^r", power_of_two, power_of_two, Fraction(1, 2), False,
           tuple(round(factorial(k) * LN2**k * 2**110) / Fraction(2**110) for k in range(PLACES)), Fraction(1, 2**60)),
    Kernel("atan", arctangent_tail, lambda r, d: r + arctangent_tail(r, d), Fraction(4143, 10000), True,
           alternating(1, 2, lambda k: Fraction(1, k)), Fraction(1, 20)),
    Kernel("log", logarithm_tail, logarithm_tail, Fraction(17158, 100000), False,
           tuple(Fraction(2, k + 1) if k % 2 == 0 and k else Fraction(0) for k in range(PLACES)), Fraction(1, 10)),
)  # fmt: skip

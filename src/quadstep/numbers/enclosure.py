"""The functions of `quadstep.numbers` for enclosures: each by its slope at the centre and a bound on the deviation from it.
Functions of a square that are smooth at zero, where the law takes a root and divides by it, are power series.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import factorial
from typing import overload

import numpy as np

from quadstep.numbers.affine import (
    ELEMENTARY,
    PLAIN,
    ROUNDING,
    TINY,
    Array,
    Enclosure,
    Fresh,
    Operand,
    Plain,
    Third,
    UndefinedError,
    added,
    ball,
    elementary_function,
    inverse,
    merged,
    straight,
    zeros_like,
)
from quadstep.numbers.functions import sinc
from quadstep.numbers.kinds import ARRAYS, Choice, Truth
from quadstep.numbers.operation import Kind, Operation, Rule, place
from quadstep.numbers.undecided import lifted, undecided
from quadstep.numbers.vectors import Matrix, Vector

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
    return elementary_function(x, value, slope, bend, 2.0 * ELEMENTARY + LEFT_OUT, third)


def series_applies(x: Enclosure, most: float) -> bool:
    """Whether a series may be used."""
    return bool(np.all(np.abs(x.centre) + x.tight <= most))


def half_turn(square: Enclosure) -> tuple[Enclosure, Enclosure] | None:
    """cos(a / 2) and sin(a / 2) / a of an angle's square; None where it may be too large."""
    return (series(square, COSINE), series(square, SINE)) if series_applies(square, FARTHEST) else None


def turn_ratio(square: Operand, cosine: Operand) -> Enclosure | None:
    """2 atan2(s, c) / s from s^2 and c > 0, for a quaternion of any length; for tiny s laws assume length 1.

    None where the angle may be too large.
    """
    if not isinstance(square, Enclosure) or not np.all((cosine.low if isinstance(cosine, Enclosure) else cosine) > 0.5):
        return None
    over = 1.0 / cosine
    ratio = square * (over * over)
    if not isinstance(ratio, Enclosure) or not series_applies(ratio, WIDEST):
        return None
    found = 2.0 * over * series(ratio, ANGLE)
    assert isinstance(found, Enclosure)
    if not np.any(square.low < 1e-10):
        return found
    other = 2.0 * (over - 1.0)
    off = (other.size if isinstance(other, Enclosure) else np.abs(other)) + 1e-9
    return found.made(found.centre, found.parts, found.rest, found.reach, off)


__all__ = [
    "ENCLOSURES", "PLAIN", "Array", "Choice", "Enclosure", "Fresh", "Operand", "Plain", "Truth", "UndefinedError", "ball",
    "inverse",
]  # fmt: skip


class Enclosures(Kind):
    """The functions of `quadstep.numbers` for them. Values at the centre are those of floats, to the bit."""

    refusal = UndefinedError

    @staticmethod
    def rule(operation: Operation) -> Rule:
        return lambda _, *given: operation.enclosure(*given)

    def sinc(self, x: Enclosure) -> Enclosure:
        """sin(x) / x: its second derivative is 1/3 at most."""
        small = np.abs(x.centre) < 1e-3
        safe = np.where(small, 1.0, x.centre)
        slope = np.where(small, -x.centre / 3.0, (ARRAYS.cos(safe) - ARRAYS.sin(safe) / safe) / safe)
        lost = 1e-9 * x.tight  # x^3 / 30 of the slope, and its cancellation
        value = np.asarray(sinc(x.centre))  # type: ignore[arg-type]
        return elementary_function(x, value, slope, x.tight * x.tight / 6.0 + lost)

    def sqrt(self, x: Enclosure) -> Enclosure:
        """For a radicand that is a sum of squares and may vanish: anything between zero and the root of its largest value."""
        low, high = x.low, x.high
        if not np.all(low >= 0.0):
            raise UndefinedError(f"a square root of a number that may be negative ({place()})")
        low = np.minimum(low, x.centre)  # a floor may lie above the centre, where the line is drawn
        far = low > 0.25 * high
        centre = np.where(far, x.centre, 1.0)
        value = np.sqrt(centre)
        least = np.where(far, low, 1.0)
        slope, bend = 0.5 / value, 0.125 * x.tight * x.tight / (least * np.sqrt(least))
        third = Third(-0.125 / (centre * value), 0.5 * bend * x.tight / least)
        found = straight(x, value, slope, bend * (1.0 + 1e-12), third)
        if not np.all(far):
            half = 0.5 * np.sqrt(high) * (1.0 + ROUNDING)
            found = merged(far, found, x.made(half, zeros_like(x.parts), half, half, ROUNDING * half))
        found.floor = np.zeros_like(high)
        return found

    @overload
    def where(self, condition: Truth | Choice | bool, yes: Enclosure, no: Enclosure) -> Enclosure: ...
    @overload
    def where(self, condition: Truth | Choice | bool, yes: Operand, no: Operand) -> Operand: ...
    def where(self, condition: Truth | Choice | bool, yes: Operand, no: Operand) -> Operand:
        """The branch decided sample by sample; both branches where the condition is undecided."""
        if isinstance(condition, bool):
            return yes if condition else no
        if not isinstance(condition, Truth):
            condition = Truth(condition, ~np.asarray(condition))
        if not np.any(condition.fails):
            return yes
        if not np.any(condition.holds):
            return no
        if not isinstance(yes, Enclosure) and not isinstance(no, Enclosure):
            if np.all(np.asarray(yes) == np.asarray(no)):
                return yes
            if not np.any(condition.holds & condition.fails):
                return np.where(condition.holds, yes, no)
        like = yes if isinstance(yes, Enclosure) else no
        like = like if isinstance(like, Enclosure) else ball(np.zeros(condition.holds.shape))
        chosen = merged(~condition.fails, lifted(yes, like), lifted(no, like))
        unsure = condition.holds & condition.fails
        return merged(~unsure, chosen, undecided(condition, yes, no, like)) if np.any(unsure) else chosen

    def solve_symmetric(self, m: Matrix, b: Vector) -> Vector:
        """x of M x = b for a 3x3 M, without its cofactors: with C near the inverse of M's centre,

        x = C b + (I - C M) x, so that the range of x enters once beside that of M, not once per cofactor.
        """
        like = next(one for one in (*(entry for row in m for entry in row), *b) if isinstance(one, Enclosure))
        rows = [[lifted(entry, like) for entry in row] for row in m]
        right = [lifted(one, like) for one in b]
        middle, width = (np.array([[getattr(one, name) for one in row] for row in rows]) for name in ("centre", "tight"))
        b0, moved = (np.array([getattr(one, name) for one in right]) for name in ("centre", "tight"))
        size, (adjugate, determinant) = np.abs(middle) + width, cofactors(middle)
        most_adjugate, most = cofactors(size, 1.0)
        least = np.abs(determinant) - (most - cofactors(np.abs(middle), 1.0)[1]) - 1e-12 * most
        if not np.all(least > 0.0):
            raise UndefinedError(f"a system of equations that may be singular ({place()})")
        c = adjugate / determinant
        x0, c_size = np.einsum("ijs,js->is", c, b0), np.abs(c)
        identity = np.abs(np.einsum("ijs,jks->iks", c, middle) - np.eye(3)[:, :, None])
        off = identity + ROUNDING * np.einsum("ijs,jks->iks", c_size, np.abs(middle))
        spread = np.einsum("ijs,jks->iks", c_size, width) + off
        base = np.einsum("ijs,js->is", c_size, moved) + np.einsum("iks,ks->is", spread, np.abs(x0))
        base = base + ROUNDING * np.einsum("ijs,js->is", c_size, np.abs(b0))
        share = spread.sum(axis=1).max(axis=0)
        if not np.all(share < 0.5):
            raise UndefinedError(f"a system of equations that may be singular ({place()})")
        reach = base + share / (1.0 - share) * base.max(axis=0)
        flown = np.einsum("ijs,js->is", most_adjugate, np.abs(b0) + moved) / least + most / least * (np.abs(x0) + reach)
        found = []
        drawn = [
            total_parts([(one.parts, 1.0)] + [(rows[j][k].parts, -x0[k]) for k in range(3)]) for j, one in enumerate(right)
        ]
        rests = [one.rest + sum(rows[j][k].rest * np.abs(x0[k]) for k in range(3)) for j, one in enumerate(right)]
        for i in range(3):
            parts = total_parts([(drawn[j], c[i, j]) for j in range(3)])
            bend = np.einsum("ks,ks->s", spread[i], reach) + np.einsum("ks,ks->s", off[i], np.abs(x0))
            rest = bend + sum(c_size[i, j] * rests[j] for j in range(3))
            lost = ELEMENTARY * (flown[i] + base[i] + np.abs(x0[i])) + TINY
            found.append(like.made(x0[i], parts, rest * (1.0 + 1e-12), reach[i] * (1.0 + 1e-12), lost))
        return Vector(found)  # type: ignore[arg-type]

    half_turn = staticmethod(half_turn)
    turn_ratio = staticmethod(turn_ratio)


def cofactors(m: Array, sign: float = -1.0) -> tuple[Array, Array]:
    """Adjugate and determinant of symmetric matrices (3, 3, samples). sign: 1 for bounds, of sizes."""
    (m11, m12, m13), (_, m22, m23), (_, _, m33) = m
    a11, a12, a13 = m22 * m33 + sign * m23 * m23, m13 * m23 + sign * m12 * m33, m12 * m23 + sign * m13 * m22
    a22, a23, a33 = m11 * m33 + sign * m13 * m13, m12 * m13 + sign * m11 * m23, m11 * m22 + sign * m12 * m12
    return np.array([[a11, a12, a13], [a12, a22, a23], [a13, a23, a33]]), m11 * a11 + m12 * a12 + m13 * a13


def total_parts(terms: list[tuple[Array | None, Plain]]) -> Array | None:
    """The sum of forms' parts, each times a number."""
    total: Array | None = None
    for parts, factor in terms:
        if parts is not None:
            total = added(total, parts * factor)
    return total


ENCLOSURES = Enclosures()
Enclosure.functions = Truth.functions = ENCLOSURES

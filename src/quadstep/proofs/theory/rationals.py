"""Exact arithmetic for a certificate: roots rounded outwards, positive definiteness by elimination."""

from collections.abc import Sequence
from fractions import Fraction
from math import isqrt
from typing import TypeAlias

Rational: TypeAlias = Fraction
Row: TypeAlias = list[Fraction]

GRID = 2**40
"""Numbers are rounded to multiples of 1 over this, on the safe side, so that exact elimination stays quick."""


def above(x: Fraction) -> Fraction:
    """x rounded up."""
    return Fraction(-(-x.numerator * GRID // x.denominator), GRID)


def root_above(x: Fraction) -> Fraction:
    """A number not below sqrt(x), x >= 0."""
    scaled = above(x) * GRID * GRID
    return Fraction(isqrt(int(scaled)) + 1, GRID)


def positive_definite(matrix: Sequence[Sequence[Fraction]]) -> bool:
    """Whether x^T M x > 0 for every x != 0, M symmetric: every pivot of the elimination is positive. Exact."""
    rows = [list(row) for row in matrix]
    for i, pivot in enumerate(rows):
        if pivot[i] <= 0:
            return False
        for row in rows[i + 1 :]:
            factor = row[i] / pivot[i]
            for k in range(i, len(row)):
                row[k] -= factor * pivot[k]
    return True


def support(matrix: Sequence[Sequence[Fraction]], direction: Sequence[Fraction]) -> Fraction:
    """direction^T M^-1 direction, M positive definite: the square of the largest direction . x where x^T M x <= 1. Exact."""
    size = len(direction)
    rows = [[*matrix[i], direction[i]] for i in range(size)]
    for i in range(size):
        for j in range(i + 1, size):
            factor = rows[j][i] / rows[i][i]
            rows[j] = [x - factor * y for x, y in zip(rows[j], rows[i], strict=True)]
    solution = [Fraction(0)] * size
    for i in reversed(range(size)):
        rest = sum((rows[i][j] * solution[j] for j in range(i + 1, size)), Fraction(0))
        solution[i] = (rows[i][size] - rest) / rows[i][i]
    return sum((a * b for a, b in zip(direction, solution, strict=True)), Fraction(0))

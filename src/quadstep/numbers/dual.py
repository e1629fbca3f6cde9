"""Dual numbers: a value and its slopes along many directions at once, so that any law yields its own derivative.

Forward differentiation (Griewank and Walther, "Evaluating Derivatives", 2008, chapter 3). The value is a Python float computed
as `quadstep.numbers` computes it, so a law takes the same branches as in flight. Two cases have no derivative, and are
detected instead of guessed:

* A comparison of equal numbers, the edge of a `where`. The branch is that of a state moved a little to one side (`Seeds`), so
  that all edges are decided for one and the same neighbour. The caller differentiates for both sides and compares.
* A slope that does not exist: a square root at zero, a quotient by zero. The number is `lost`, with the place in the law; a
  factor of zero restores it, as in |v| v at v = 0.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from operator import ge, gt, le, lt
from typing import TypeAlias, cast

import numpy as np
from numpy.typing import NDArray

from quadstep.numbers.functions import power
from quadstep.numbers.kinds import FLOATS, REALS, Number
from quadstep.numbers.operation import Arithmetic, Kind, Operation, Rule, place

Slopes: TypeAlias = NDArray[np.float64]

CLOSE = 1e-11
"""Numbers that differ by less, relative to 1 and their size, are on an edge: an equilibrium is known only up to rounding."""


class NotDifferentiableError(Exception):
    """A law that dual numbers cannot evaluate: one line that says why, and where."""


def compared(relation: Callable[[float, float], bool]) -> Callable[[Dual, Dual | float], bool]:
    return lambda one, other: relation(one.over(other), 0.0)


class Seeds:
    """State shared by the duals of one differentiation.

    count: of directions. side: +1.0 or -1.0, to which side of an edge the state is moved; or
    way: by how much along each direction. edges: places of comparisons that
    were decided so.
    """

    def __init__(self, count: int, side: float, way: Slopes | None = None) -> None:
        self.count = count
        self.edges: dict[str, None] = {}
        if way is not None:
            self.aside = way
            return
        spread = np.array([place * 0.6180339887498949 % 1.0 + 0.5 for place in range(1, count + 1)])  # no two balance
        spread[1::2] *= -1.0
        self.aside = side * spread

    def seeded(self, values: Sequence[float], first: int) -> list[Number]:
        """Duals of these values, the i-th along direction first + i."""
        rows = np.zeros((len(values), self.count))
        rows[np.arange(len(values)), first + np.arange(len(values))] = 1.0
        return [cast(Number, Dual(value, row, self)) for value, row in zip(values, rows, strict=True)]


class Dual(Arithmetic["Dual | float"]):
    """value, slopes of shape (directions,), and where the slopes were lost, if they were."""

    __slots__ = ("lost", "seeds", "slopes", "value")
    __array_ufunc__ = None
    functions: Duals

    def __init__(self, value: float, slopes: Slopes, seeds: Seeds, lost: str | None = None) -> None:
        self.value, self.slopes, self.seeds, self.lost = value, slopes, seeds, lost

    def __repr__(self) -> str:
        return f"Dual({self.value!r}, {self.slopes!r})"

    def __int__(self) -> int:
        return int(self.value)

    def __add__(self, other: Dual | float) -> Dual:
        if isinstance(other, Dual):
            return Dual(self.value + other.value, self.slopes + other.slopes, self.seeds, self.lost or other.lost)
        if isinstance(other, REALS):
            return Dual(self.value + other, self.slopes, self.seeds, self.lost)
        return NotImplemented

    __radd__ = __add__

    def __mul__(self, other: Dual | float) -> Dual:
        if isinstance(other, Dual):
            slopes = self.slopes * other.value + other.slopes * self.value
            lost = self.lost or other.lost
            if lost:  # a lost slope is bounded, so a factor of zero cancels it
                kept = (self.lost if abs(other.value) > CLOSE else None), (other.lost if abs(self.value) > CLOSE else None)
                lost = kept[0] or kept[1]
            return Dual(self.value * other.value, slopes, self.seeds, lost)
        if isinstance(other, REALS):
            return Dual(self.value * other, self.slopes * other, self.seeds, self.lost if other else None)
        return NotImplemented

    __rmul__ = __mul__

    def __truediv__(self, other: Dual | float) -> Dual:
        if isinstance(other, REALS):
            if other == 0.0:
                return lost(self, place())
            return Dual(self.value / other, self.slopes / other, self.seeds, self.lost)
        if not isinstance(other, Dual):
            return NotImplemented
        if other.value == 0.0:
            return lost(self, place())
        value = self.value / other.value
        slopes = (self.slopes - other.slopes * value) / other.value
        return Dual(value, slopes, self.seeds, self.lost or (other.lost if abs(self.value) > CLOSE else None))

    def __rtruediv__(self, other: float) -> Dual:
        if not isinstance(other, REALS):
            return NotImplemented
        if self.value == 0.0:
            return lost(self, place())
        value = other / self.value
        return Dual(value, self.slopes * (-value / self.value), self.seeds, self.lost if other else None)

    def __neg__(self) -> Dual:
        return Dual(-self.value, -self.slopes, self.seeds, self.lost)

    def __abs__(self) -> Dual:
        return -self if self < 0.0 else self

    def over(self, other: Dual | float) -> float:
        """self - other for a comparison: on an edge, decided by the side to which the state is moved."""
        value, slopes = (other.value, self.slopes - other.slopes) if isinstance(other, Dual) else (other, self.slopes)
        gap = self.value - value
        if abs(gap) <= CLOSE * (1.0 + abs(value)):
            moved = float(slopes @ self.seeds.aside)
            if abs(moved) > CLOSE:
                self.seeds.edges[place()] = None
                return moved
        return gap

    __lt__, __le__, __gt__, __ge__ = map(compared, (lt, le, gt, ge))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Dual | float | int) and self.over(other) == 0.0

    __hash__ = None  # type: ignore[assignment]


def lost(x: Dual, where: str) -> Dual:
    """The result of a division by zero."""
    return Dual(FLOATS.sqrt(-1.0), np.zeros_like(x.slopes), x.seeds, f"a division by zero ({where})")


def value_of(x: Dual | float) -> float:
    return x.value if isinstance(x, Dual) else x


class Duals(Kind):
    """The functions of `quadstep.numbers` for them. Values are those of floats, to the bit."""

    refusal = NotDifferentiableError

    @staticmethod
    def rule(operation: Operation) -> Rule:
        """The value, and of each slope its tangent, or none where that does not exist."""

        def dual(_: Duals, *given: Dual | float) -> Dual:
            values = [value_of(one) for one in given]
            moving = [(one, tangent) for one, tangent in zip(given, operation.tangents, strict=True) if isinstance(one, Dual)]
            seeds, slopes = moving[0][0].seeds, np.zeros_like(moving[0][0].slopes)
            value = operation.steps(FLOATS, *values)
            lost = next((one.lost for one, _ in moving if one.lost), None)
            if not operation.singular(*values):
                for one, tangent in moving:
                    slopes = slopes + tangent(one.slopes, *values, value)
            elif any(one.slopes.any() for one, _ in moving):
                lost = lost or f"{operation.undefined} ({place()})"
            return Dual(value, slopes, seeds, lost)

        return dual

    def sqrt(self, x: Dual) -> Dual:
        value = FLOATS.sqrt(0.0 if -CLOSE < x.value < 0.0 else x.value)  # below zero: a size on the other side of its edge
        if value > CLOSE:
            return Dual(value, x.slopes * (0.5 / value), x.seeds, x.lost)
        broken = x.lost or (f"a square root or norm at zero ({place()})" if x.slopes.any() else None)
        return Dual(value, np.zeros_like(x.slopes), x.seeds, broken)

    def signed_power(self, x: Dual | float, exponent: Dual | float) -> Dual:
        base, raised = value_of(x), value_of(exponent)
        value = power(base, raised)
        some = x if isinstance(x, Dual) else exponent
        assert isinstance(some, Dual)
        slopes, size = np.zeros_like(some.slopes), abs(base)
        broken = (x.lost if isinstance(x, Dual) else None) or (exponent.lost if isinstance(exponent, Dual) else None)
        if isinstance(exponent, Dual) and size > 0.0:
            slopes = exponent.slopes * (value * FLOATS.log(size))
        if isinstance(x, Dual) and x.slopes.any():
            if size > CLOSE or raised == 1.0:
                slopes = slopes + x.slopes * (raised * (abs(value) / size if size > CLOSE else 1.0))
            elif raised < 1.0:
                broken = broken or f"a power below 1 of zero ({place()})"
        return Dual(value, slopes, some.seeds, broken)

    def length(self, square: Dual, entries: Sequence[Dual | float]) -> Dual:
        """The root of a sum of squares: at its tip an edge, with the slope towards the side that the state is moved to."""
        if square.value > CLOSE * CLOSE:
            return self.sqrt(square)
        known = [one for one in entries if isinstance(one, Dual)]
        ways = np.array([one.slopes for one in known])
        moved = ways @ square.seeds.aside
        size = float(np.sqrt(moved @ moved))
        lost = next((one.lost for one in known if one.lost), None)
        if size > CLOSE:
            square.seeds.edges[place()] = None
            return Dual(FLOATS.sqrt(square.value), moved @ ways / size, square.seeds, lost)
        if ways.any():
            lost = lost or f"a norm at zero ({place()})"
        return Dual(FLOATS.sqrt(square.value), np.zeros_like(square.slopes), square.seeds, lost)

    def where(self, condition: bool, yes: Dual | float, no: Dual | float) -> Dual | float:
        return yes if condition else no


Dual.functions = Duals()


def slopes_of(
    numbers: Sequence[Number | Dual], count: int
) -> tuple[NDArray[np.float64], NDArray[np.float64], list[str | None]]:
    """Values of shape (numbers,), slopes of shape (numbers, count), and where those of each were lost."""
    values = np.array([value_of(one) for one in numbers], dtype=np.float64)
    slopes = np.array([one.slopes if isinstance(one, Dual) else np.zeros(count) for one in numbers]).reshape(-1, count)
    return values, slopes, [one.lost if isinstance(one, Dual) else None for one in numbers]

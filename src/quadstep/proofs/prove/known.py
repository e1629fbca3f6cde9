"""Numbers known exactly or not at all, to show that a state is an equilibrium in exact arithmetic.

A fraction, or None for a number whose exact value is not known; zero times any number is zero.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from math import isqrt
from typing import NoReturn, TypeAlias

from quadstep.numbers.operation import Kind, Operation, Rule

Operand: TypeAlias = "ExactNumber | float"


class ExactNumber:
    """value: exact, or None."""

    __slots__ = ("value",)
    __array_ufunc__ = None
    functions: Knowns

    def __init__(self, value: Fraction | None) -> None:
        self.value = value

    def __add__(self, other: Operand) -> ExactNumber:
        return both(self, other, lambda a, b: a + b)

    __radd__ = __add__

    def __neg__(self) -> ExactNumber:
        return ExactNumber(None if self.value is None else -self.value)

    def __pos__(self) -> ExactNumber:
        return self

    def __sub__(self, other: Operand) -> ExactNumber:
        return self + -exact(other)

    def __rsub__(self, other: Operand) -> ExactNumber:
        return exact(other) + -self

    def __mul__(self, other: Operand) -> ExactNumber:
        if not isinstance(other, ExactNumber | float | int):
            return NotImplemented
        other = exact(other)
        return ExactNumber(Fraction(0)) if 0 in (self.value, other.value) else both(self, other, lambda a, b: a * b)

    __rmul__ = __mul__

    def __truediv__(self, other: Operand) -> ExactNumber:
        other = exact(other)
        if other.value == 0:
            return ExactNumber(None)
        return self * ExactNumber(None if other.value is None else 1 / other.value)

    def __rtruediv__(self, other: Operand) -> ExactNumber:
        return exact(other) / self

    def __abs__(self) -> ExactNumber:
        return ExactNumber(None if self.value is None else abs(self.value))

    def __lt__(self, other: Operand) -> bool | ExactNumber:
        return compared(self, other, lambda a, b: a < b)

    def __le__(self, other: Operand) -> bool | ExactNumber:
        return compared(self, other, lambda a, b: a <= b)

    def __gt__(self, other: Operand) -> bool | ExactNumber:
        return compared(self, other, lambda a, b: a > b)

    def __ge__(self, other: Operand) -> bool | ExactNumber:
        return compared(self, other, lambda a, b: a >= b)


def exact(x: Operand) -> ExactNumber:
    """A number as one of these."""
    if isinstance(x, ExactNumber):
        return x
    try:
        return ExactNumber(Fraction(float(x)))
    except (OverflowError, ValueError):  # infinite or NaN
        return ExactNumber(None)


def both(a: ExactNumber, b: Operand, operation: Callable[[Fraction, Fraction], Fraction]) -> ExactNumber:
    """An operation on two known numbers."""
    b = exact(b)
    return ExactNumber(None if a.value is None or b.value is None else operation(a.value, b.value))


def compared(a: ExactNumber, b: Operand, relation: Callable[[Fraction, float | Fraction], bool]) -> bool | ExactNumber:
    """Whether a relation holds, or that this is not known."""
    other = exact(b)
    right = float(b) if other.value is None and not isinstance(b, ExactNumber) else other.value
    return ExactNumber(None) if a.value is None or right is None else relation(a.value, right)


class Knowns(Kind):
    """The functions of `quadstep.numbers`, where their values are fractions."""

    @staticmethod
    def rule(operation: Operation) -> Rule:
        """Its exact value."""
        return lambda _, *given: ExactNumber(operation.exact(*(exact(one).value for one in given)))

    def sqrt(self, x: ExactNumber) -> ExactNumber:
        if x.value is None or x.value < 0:
            return ExactNumber(None)
        root = Fraction(isqrt(x.value.numerator), isqrt(x.value.denominator))
        return ExactNumber(root if root * root == x.value else None)

    def where(self, condition: bool | ExactNumber, yes: Operand, no: Operand) -> Operand:
        return condition if isinstance(condition, ExactNumber) else yes if condition else no

    def word(self, x: ExactNumber) -> NoReturn:
        raise TypeError("the law manipulates the bits of a number")

    def opaque(self, *_: object) -> NoReturn:
        raise TypeError("it calls an opaque function")


ExactNumber.functions = Knowns()

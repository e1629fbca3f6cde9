"""Numbers known exactly or not at all, to show that a state is an equilibrium in exact arithmetic.

A fraction, or None for a number whose exact value is not known; zero times any number is zero.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from math import isqrt
from typing import NoReturn, TypeAlias

from quadstep.numbers.operation import Kind, Operation, Rule

Operand: TypeAlias = "Known | float"


class Known:
    """value: exact, or None."""

    __slots__ = ("value",)
    __array_ufunc__ = None
    functions: Knowns

    def __init__(self, value: Fraction | None) -> None:
        self.value = value

    def __add__(self, other: Operand) -> Known:
        return both(self, other, lambda a, b: a + b)

    __radd__ = __add__

    def __neg__(self) -> Known:
        return Known(None if self.value is None else -self.value)

    def __pos__(self) -> Known:
        return self

    def __sub__(self, other: Operand) -> Known:
        return self + -exact(other)

    def __rsub__(self, other: Operand) -> Known:
        return exact(other) + -self

    def __mul__(self, other: Operand) -> Known:
        if not isinstance(other, Known | float | int):
            return NotImplemented
        other = exact(other)
        return Known(Fraction(0)) if 0 in (self.value, other.value) else both(self, other, lambda a, b: a * b)

    __rmul__ = __mul__

    def __truediv__(self, other: Operand) -> Known:
        other = exact(other)
        if other.value == 0:
            return Known(None)
        return self * Known(None if other.value is None else 1 / other.value)

    def __rtruediv__(self, other: Operand) -> Known:
        return exact(other) / self

    def __abs__(self) -> Known:
        return Known(None if self.value is None else abs(self.value))

    def __lt__(self, other: Operand) -> bool | Known:
        return compared(self, other, lambda a, b: a < b)

    def __le__(self, other: Operand) -> bool | Known:
        return compared(self, other, lambda a, b: a <= b)

    def __gt__(self, other: Operand) -> bool | Known:
        return compared(self, other, lambda a, b: a > b)

    def __ge__(self, other: Operand) -> bool | Known:
        return compared(self, other, lambda a, b: a >= b)


def exact(x: Operand) -> Known:
    """A number as one of these."""
    if isinstance(x, Known):
        return x
    try:
        return Known(Fraction(float(x)))
    except (OverflowError, ValueError):  # infinite or NaN
        return Known(None)


def both(a: Known, b: Operand, operation: Callable[[Fraction, Fraction], Fraction]) -> Known:
    """An operation on two known numbers."""
    b = exact(b)
    return Known(None if a.value is None or b.value is None else operation(a.value, b.value))


def compared(a: Known, b: Operand, relation: Callable[[Fraction, float | Fraction], bool]) -> bool | Known:
    """Whether a relation holds, or that this is not known."""
    other = exact(b)
    right = float(b) if other.value is None and not isinstance(b, Known) else other.value
    return Known(None) if a.value is None or right is None else relation(a.value, right)


class Knowns(Kind):
    """The functions of `quadstep.numbers`, where their values are fractions."""

    @staticmethod
    def rule(operation: Operation) -> Rule:
        """Its exact value."""
        return lambda _, *given: Known(operation.exact(*(exact(one).value for one in given)))

    def sqrt(self, x: Known) -> Known:
        if x.value is None or x.value < 0:
            return Known(None)
        root = Fraction(isqrt(x.value.numerator), isqrt(x.value.denominator))
        return Known(root if root * root == x.value else None)

    def where(self, condition: bool | Known, yes: Operand, no: Operand) -> Operand:
        return condition if isinstance(condition, Known) else yes if condition else no

    def word(self, x: Known) -> NoReturn:
        raise TypeError("the law manipulates the bits of a number")

    def opaque(self, *_: object) -> NoReturn:
        raise TypeError("it calls an opaque function")


Known.functions = Knowns()

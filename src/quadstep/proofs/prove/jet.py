"""Derivatives, enclosed: a value and its slopes along some directions, both as balls.

A norm is not differentiable at zero. It is Lipschitz, so that its product with a number that is exactly zero there has the
slope zero. So it is with a choice by two numbers that are equal there, as in |x| at 0, if those that it chooses from are equal
too; if not, the law jumps. Slopes that are unbounded stay so whatever is computed from them: a number is a norm at zero only
if its radicand is known to be of second order, as a sum of squares of numbers with bounded slopes is.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import reduce
from operator import add, ge, gt, le, lt
from typing import TypeAlias, TypeVar, cast, overload

import numpy as np

from quadstep.numbers.enclosure import ENCLOSURES, PLAIN, Choice, Enclosure, Plain, Truth, UndefinedError, ball, inverse
from quadstep.numbers.operation import Arithmetic, Kind, Operation, Rule

Operand: TypeAlias = "Jet | Plain"

Yes = TypeVar("Yes")
No = TypeVar("No")


def compared(relation: Callable[[Enclosure, Enclosure | Plain], Truth]) -> Callable[[Jet, Operand], JetChoice]:
    return lambda one, other: decided(relation(one.value, plain(other)), one - other)


class Jet(Arithmetic["Operand"]):
    """value: a ball of shape (1,). slopes: of shape (directions, 1). kinked: a norm or a bend, Lipschitz, but its slopes are
    unknown. flat: zero, and of second order nearby.
    """

    __slots__ = ("flat", "kinked", "slopes", "value")
    __array_ufunc__ = None
    functions: Jets

    def __init__(self, value: Enclosure, slopes: Enclosure, kinked: bool = False, flat: bool = False) -> None:
        self.value, self.slopes, self.kinked, self.flat = value, slopes, kinked, flat

    def __add__(self, other: Operand) -> Jet:
        if isinstance(other, Jet):
            flat = self.flat and other.flat
            return Jet(self.value + other.value, self.slopes + other.slopes, self.kinked or other.kinked, flat)
        if isinstance(other, PLAIN):
            return Jet(self.value + other, self.slopes, self.kinked, self.flat and level(other))
        return NotImplemented

    __radd__ = __add__

    def __neg__(self) -> Jet:
        return Jet(-self.value, -self.slopes, self.kinked, self.flat)

    @overload
    def __mul__(self, other: Jet) -> Jet: ...
    @overload
    def __mul__(self, other: Plain) -> Jet | float: ...
    def __mul__(self, other: Operand) -> Jet | float:
        if isinstance(other, Jet):
            small = zero(self.value) and zero(other.value)
            flat = bounded(self) and bounded(other) and (self.flat or other.flat or small)
            if other is self:
                return Jet(self.value * self.value, self.slopes * self.value.scaled(2.0), self.kinked and not small, flat)
            kinked = (self.kinked and not zero(other.value)) or (other.kinked and not zero(self.value))
            return Jet(self.value * other.value, self.slopes * other.value + other.slopes * self.value, kinked, flat)
        if not isinstance(other, PLAIN):
            return NotImplemented
        if np.all(np.asarray(other) == 0.0):
            return 0.0
        return Jet(self.value.scaled(other), self.slopes.scaled(other), self.kinked, self.flat)

    __rmul__ = __mul__

    def __truediv__(self, other: Operand) -> Jet:
        if isinstance(other, Jet):
            value = inverse(other.value)
            return self * Jet(value, other.slopes * -(value * value), other.kinked)
        if isinstance(other, PLAIN):
            return Jet(self.value / other, self.slopes / other, self.kinked, self.flat)
        return NotImplemented

    def __rtruediv__(self, other: Plain) -> Jet | float:
        value = inverse(self.value)
        return Jet(value, self.slopes * -(value * value), self.kinked) * other

    def __abs__(self) -> Jet:
        return Jet.functions.where(self < 0.0, -self, self)

    __lt__, __le__, __gt__, __ge__ = map(compared, (lt, le, gt, ge))


class JetChoice(Truth):
    """What comparing jets gives: a choice between jets."""

    __slots__ = ()


def decided(truth: Truth, gap: Jet) -> JetChoice:
    """The same, of jets. gap: of what is compared. If that may be zero, either may be the larger nearby."""
    edge = (gap.value.low <= 0.0) & (gap.value.high >= 0.0)
    return JetChoice(truth.holds | edge, truth.fails | edge)


UNBOUNDED = ball(np.zeros((1, 1)), np.inf)
"""Slopes where there are none: no matter, if the number is used no further."""


def plain(x: Operand) -> Enclosure | Plain:
    return x.value if isinstance(x, Jet) else x


def whole(x: object) -> Enclosure:
    return x.value if isinstance(x, Jet) else ball([cast(float, x)])


def bounded(x: object) -> bool:
    """Whether its slopes are, so that it is continuous."""
    return not isinstance(x, Jet) or bool(np.all(np.isfinite(x.slopes.centre) & np.isfinite(x.slopes.tight)))


def level(x: object) -> bool:
    """Whether it is zero and of second order nearby."""
    return x.flat if isinstance(x, Jet) else bool(np.all(np.asarray(x) == 0.0))


def zero(x: Enclosure) -> bool:
    return bool(np.all((x.centre == 0.0) & (x.reach == 0.0)))


class Jets(Kind):
    """The functions of `quadstep.numbers` for them."""

    refusal = UndefinedError

    @staticmethod
    def rule(operation: Operation) -> Rule:
        """The value's enclosure, and the tangent's."""

        def jet(_: Jets, *given: Operand) -> Jet:
            values = [plain(one) for one in given]
            value = cast(Enclosure, operation.enclosure(*values))
            moving = [(one, tangent) for one, tangent in zip(given, operation.tangents, strict=True) if isinstance(one, Jet)]
            nothing = ball(np.zeros_like(moving[0][0].slopes.centre))  # times 0 is 0, of no shape
            slopes = [tangent(one.slopes, *values, value) for one, tangent in moving]
            return Jet(value, reduce(add, slopes, nothing), any(one.kinked for one, _ in moving))

        return jet

    def sqrt(self, x: Jet) -> Jet:
        value = ENCLOSURES.sqrt(x.value)
        if np.all(value.low > 0.0):
            return Jet(value, x.slopes * inverse(value).scaled(0.5), x.kinked)
        if x.flat and x.value.floor is not None:
            return Jet(value, ball(np.zeros_like(x.slopes.centre)), True)
        return Jet(value, UNBOUNDED)

    def where(self, condition: Truth | Choice | bool, yes: Yes, no: No) -> Yes | No:
        if not isinstance(condition, Truth):
            return yes if np.all(condition) else no
        if not np.any(condition.holds & condition.fails):
            return yes if np.all(condition.holds) else no
        if yes is no:
            return yes
        if bounded(yes) and bounded(no) and zero(whole(yes) - whole(no)):
            moving = [one for one in (yes, no) if isinstance(one, Jet)]
            if not moving:
                return yes
            nothing, flat = ball(np.zeros_like(moving[0].slopes.centre)), level(yes) and level(no)
            straight = all(zero(one.slopes) and not one.kinked for one in moving)
            positive = all(one.value.floor is not None for one in moving)
            value = moving[0].value if positive else ball(moving[0].value.centre)
            return cast(Yes, Jet(value, nothing, not (straight or flat), flat))
        either = ENCLOSURES.where(Truth(condition.holds, condition.fails), whole(yes), whole(no))
        return cast(Yes, Jet(either, UNBOUNDED))


Jet.functions = JetChoice.functions = Jets()


def jets(values: list[float]) -> list[Jet]:
    """One for each value, the i-th along direction i."""
    unit = np.eye(len(values))[:, :, None]
    return [Jet(ball([value]), ball(row)) for value, row in zip(values, unit, strict=True)]

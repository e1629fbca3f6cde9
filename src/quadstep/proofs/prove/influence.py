"""Dependence of numbers: evaluate a law on these, and each result knows the inputs that it depends on."""

from __future__ import annotations

from typing import NoReturn, TypeAlias

import numpy as np

from quadstep.numbers.enclosure import PLAIN
from quadstep.numbers.operation import Kind, Operation, Rule

Operand: TypeAlias = "Influence | float"


class Influence:
    """The inputs, by place, that a number depends on. A product with zero depends on none."""

    __slots__ = ("of",)
    __array_ufunc__ = None
    functions: Influences

    def __init__(self, of: frozenset[int]) -> None:
        self.of = of

    def with_(self, *others: Operand) -> Influence:
        """The same number, depending on these inputs too."""
        return Influence(self.of.union(*(one.of for one in others if isinstance(one, Influence))))

    def __add__(self, other: Operand) -> Influence:
        return self.with_(other) if isinstance(other, (Influence, *PLAIN)) else NotImplemented

    __radd__ = __sub__ = __rsub__ = __truediv__ = __rtruediv__ = __add__
    __lt__ = __le__ = __gt__ = __ge__ = __add__

    def __mul__(self, other: Operand) -> Operand:
        if isinstance(other, PLAIN) and np.all(np.asarray(other) == 0.0):
            return 0.0
        return self.__add__(other)

    __rmul__ = __mul__
    __and__ = __or__ = __rand__ = __ror__ = __add__

    def __neg__(self) -> Influence:
        return self

    __pos__ = __abs__ = __invert__ = __neg__


class Influences(Kind):
    """The functions of `quadstep.numbers` for them."""

    @staticmethod
    def rule(_: Operation) -> Rule:
        """All arguments' inputs."""
        return lambda _, *given: Influence(frozenset()).with_(*given)

    def sqrt(self, x: Operand) -> Operand:
        return x

    def where(self, condition: Operand, yes: Operand, no: Operand) -> Operand:
        if not isinstance(condition, Influence):
            decided = np.asarray(condition)
            if np.all(decided):
                return yes
            if not np.any(decided):
                return no
        return Influence(frozenset()).with_(condition, yes, no)

    def word(self, x: Operand) -> NoReturn:
        raise TypeError("the law manipulates the bits of a number")

    def opaque(self, *_: object) -> NoReturn:
        raise TypeError("it calls an opaque function")


Influence.functions = Influences()


def of(x: object) -> frozenset[int]:
    """The inputs that a number depends on; none for a constant."""
    return x.of if isinstance(x, Influence) else frozenset()

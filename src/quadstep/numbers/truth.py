"""What comparing enclosures gives."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np

Operand: TypeAlias = Any
"""A number of any kind, or the other operand of one."""


class Truth:
    """holds, fails: sample by sample, whether it can hold, and whether it can fail. ordered: two numbers of which the first is
    the smaller where it holds, the second where it fails.
    """

    __slots__ = ("fails", "holds", "ordered")
    functions: Operand

    def __init__(self, holds: Operand, fails: Operand, ordered: tuple[Operand, Operand] | None = None) -> None:
        self.holds, self.fails, self.ordered = np.asarray(holds), np.asarray(fails), ordered

    def __and__(self, other: Truth) -> Truth:
        return Truth(self.holds & other.holds, self.fails | other.fails)

    def __or__(self, other: Truth) -> Truth:
        return Truth(self.holds | other.holds, self.fails & other.fails)

    def __invert__(self) -> Truth:
        return Truth(self.fails, self.holds, self.ordered and self.ordered[::-1])

    def __bool__(self) -> bool:
        raise TypeError("a law chooses with `where`, never with `if`")

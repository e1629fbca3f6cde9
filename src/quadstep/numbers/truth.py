"""What comparing enclosures gives."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Choice: TypeAlias = NDArray[np.bool_]
"""A condition that is known, sample by sample."""


class Truth:
    """holds, fails: sample by sample, whether it can hold, and whether it can fail. ordered: two numbers of which the first is
    the smaller where it holds, the second where it fails.
    """

    __slots__ = ("fails", "holds", "ordered")
    functions: object

    def __init__(self, holds: bool | Choice, fails: bool | Choice, ordered: tuple[object, object] | None = None) -> None:
        self.holds, self.fails, self.ordered = np.asarray(holds), np.asarray(fails), ordered

    def __and__(self, other: Truth) -> Truth:
        return type(self)(self.holds & other.holds, self.fails | other.fails)

    def __or__(self, other: Truth) -> Truth:
        return type(self)(self.holds | other.holds, self.fails & other.fails)

    def __invert__(self) -> Truth:
        return type(self)(self.fails, self.holds, self.ordered and self.ordered[::-1])

    def __bool__(self) -> bool:
        raise TypeError("a law chooses with `where`, never with `if`")

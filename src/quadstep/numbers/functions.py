"""The functions of a number, dispatched on what the number is.

A law calls these and never `math` or `numpy`, and it never branches on a number: `where` chooses between two values.
A kind of number joins in by carrying a class attribute `functions` with the methods of `Functions`.
"""

import math
from typing import Any, Protocol, TypeAlias

import numpy as np

Number: TypeAlias = float
"""A number in a law. The type checker reads a law as if it were over floats; any other kind behaves the same."""

Condition: TypeAlias = bool
"""What comparing two numbers gives. Feed it to `where`; a lane's condition refuses `if`."""

Word: TypeAlias = int
"""Bits of a number: adds, shifts, ands, ors and xors as a whole number does. At least 32 bits; mask what may grow beyond."""


class Functions(Protocol):
    """What a kind of number must provide."""

    def sin(self, x: Any) -> Any: ...
    def cos(self, x: Any) -> Any: ...
    def exp(self, x: Any) -> Any: ...
    def log(self, x: Any) -> Any: ...
    def sqrt(self, x: Any) -> Any: ...
    def atan2(self, y: Any, x: Any) -> Any: ...
    def where(self, condition: Any, yes: Any, no: Any) -> Any: ...
    def word(self, x: Any) -> Any: ...
    def number(self, word: Any) -> Any: ...


class Floats:
    """Python floats, with IEEE results where `math` would raise: a diverging flight is an outcome, not an exception."""

    def sin(self, x: float) -> float:
        return math.sin(x) if math.isfinite(x) else math.nan

    def cos(self, x: float) -> float:
        return math.cos(x) if math.isfinite(x) else math.nan

    def exp(self, x: float) -> float:
        try:
            return math.exp(x)
        except OverflowError:
            return math.inf

    def log(self, x: float) -> float:
        return math.log(x) if x > 0.0 else -math.inf if x == 0.0 else math.nan

    def sqrt(self, x: float) -> float:
        return math.sqrt(x) if x >= 0.0 else math.nan

    def atan2(self, y: float, x: float) -> float:
        return math.atan2(y + 0.0, x + 0.0)  # -0.0 counts as 0.0, as in lanes

    def where(self, condition: bool, yes: float, no: float) -> float:
        return yes if condition else no

    def word(self, x: float) -> int:
        return int(x)

    def number(self, word: int) -> float:
        return float(word)


class Arrays:
    """NumPy arrays: one flight an element."""

    sin = staticmethod(np.sin)
    cos = staticmethod(np.cos)
    exp = staticmethod(np.exp)
    log = staticmethod(np.log)
    sqrt = staticmethod(np.sqrt)
    where = staticmethod(np.where)

    def atan2(self, y: Any, x: Any) -> Any:
        return np.arctan2(y + 0.0, x + 0.0)

    def word(self, x: Any) -> Any:
        return x.astype(np.uint64)

    def number(self, word: Any) -> Any:
        return word.astype(np.float64)


FLOATS = Floats()
ARRAYS = Arrays()


def functions_of(*values: Any) -> Any:
    """The functions for these values: the first that is neither a float nor an int decides."""
    for value in values:
        if isinstance(value, float | int):
            continue
        if isinstance(value, np.ndarray | np.generic):
            return ARRAYS
        return value.functions if hasattr(value, "functions") else foreign_functions(value)
    return FLOATS


def foreign_functions(value: Any) -> Any:
    """The functions for a number of another package, which need not be installed: SymPy."""
    if type(value).__module__.partition(".")[0] == "sympy":
        from quadstep.numbers.symbols import SYMBOLS  # noqa: PLC0415 (loaded only where it is used)

        return SYMBOLS
    raise TypeError(f"{type(value).__name__} is not a number that a law can take")


def sin(x: Number) -> Number:
    """Sine of an angle [rad]."""
    result: Number = functions_of(x).sin(x)
    return result


def cos(x: Number) -> Number:
    """Cosine of an angle [rad]."""
    result: Number = functions_of(x).cos(x)
    return result


def exp(x: Number) -> Number:
    """Exponential."""
    result: Number = functions_of(x).exp(x)
    return result


def log(x: Number) -> Number:
    """Natural logarithm; -inf at zero, NaN below. On lanes it stops falling below the smallest normal number."""
    result: Number = functions_of(x).log(x)
    return result


def sqrt(x: Number) -> Number:
    """Square root; NaN below zero."""
    result: Number = functions_of(x).sqrt(x)
    return result


def atan2(y: Number, x: Number) -> Number:
    """Angle of the point (x, y), in (-pi, pi] [rad]; zero at the origin."""
    result: Number = functions_of(y, x).atan2(y, x)
    return result


def where(condition: Condition, yes: Number, no: Number) -> Number:
    """`yes` where the condition holds, else `no`. Both are computed."""
    result: Number = functions_of(condition, yes, no).where(condition, yes, no)
    return result


def word(x: Number) -> Word:
    """The bits of a whole number in [0, 2^31)."""
    result: Word = functions_of(x).word(x)
    return result


def number(bits: Word) -> Number:
    """The whole number in [0, 2^31) that has these bits."""
    result: Number = functions_of(bits).number(bits)
    return result


def minimum(a: Number, b: Number) -> Number:
    """The smaller of two numbers."""
    return where(a < b, a, b)


def maximum(a: Number, b: Number) -> Number:
    """The larger of two numbers."""
    return where(a > b, a, b)


def clip(x: Number, low: Number, high: Number) -> Number:
    """`x` held between `low` and `high`."""
    return minimum(maximum(x, low), high)


def absolute(x: Number) -> Number:
    """Magnitude."""
    return where(x < 0.0, -x, x)


def sigmoid(x: Number) -> Number:
    """Logistic function 1 / (1 + exp(-x))."""
    return 1.0 / (1.0 + exp(-x))

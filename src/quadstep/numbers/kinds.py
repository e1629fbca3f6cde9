"""Python floats and NumPy arrays as numbers of laws, and which kind a number is; conditions of enclosures, which may be open.

A new kind of number needs a class attribute `functions`: a `Kind` with the methods that laws call.
"""

from __future__ import annotations

import math
import struct
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from quadstep.numbers.operation import Elementary, Kind, Operation, Rule

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


Array: TypeAlias = NDArray[np.float64]

Number: TypeAlias = float
"""A number in a law. The type checker reads a law as if it were over floats; any other kind behaves the same."""

Condition: TypeAlias = bool
"""The result of comparing two numbers. Pass it to `where`; a lane's condition refuses `if`."""

Word: TypeAlias = int
"""Bits of a number: adds, shifts, ands, ors and xors like an integer. At least 32 bits; mask anything that may grow beyond."""

REALS = float, int
"""Python's own numbers, and its conditions: a tuple, which is asked for three times as fast as `float | int`."""

DOUBLE, WHOLE = struct.Struct("<d"), struct.Struct("<q")
EXPONENT_BIAS, MANTISSA_BITS = 1023, 52
MANTISSA = (1 << MANTISSA_BITS) - 1
EXPONENT = (1 << 11) - 1


def bits_of(x: float) -> int:
    """The 64 bits of a float, as a whole number with sign."""
    return WHOLE.unpack(DOUBLE.pack(x))[0]


def float_of(bits: int) -> float:
    """The float of these bits, below 2^63."""
    return DOUBLE.unpack(WHOLE.pack(bits))[0]


class Floats(Elementary):
    """Python floats, with IEEE results where `math` would raise: a diverging flight is an outcome, not an exception."""

    def precise(self, x: float) -> bool:
        return True

    def bit(self, x: float, place: int) -> bool:
        return bits_of(x) >> place & 1 == 1

    def power(self, m: float) -> float:
        return float_of((bits_of(m) + EXPONENT_BIAS & EXPONENT) << MANTISSA_BITS)

    def fraction(self, x: float) -> float:
        return float_of(bits_of(x) & MANTISSA | EXPONENT_BIAS - 1 << MANTISSA_BITS)

    def exponent(self, x: float) -> float:
        return float((bits_of(x) >> MANTISSA_BITS & EXPONENT) - EXPONENT_BIAS + 1)

    def sqrt(self, x: float) -> float:
        return math.sqrt(x) if x >= 0.0 else math.nan

    def where(self, condition: bool, yes: float, no: float) -> float:
        return yes if condition else no

    def word(self, x: float) -> int:
        return int(x)

    def number(self, word: int) -> float:
        return float(word)


class Arrays(Elementary):
    """NumPy arrays of f64, which others become: one flight per element."""

    @staticmethod
    def rule(operation: Operation) -> Rule:
        """Its steps, on f64: the bits of other numbers lie elsewhere."""
        return lambda kind, *given: operation.steps(kind, *(np.asarray(one, dtype=np.float64) for one in given))

    sqrt = staticmethod(np.sqrt)
    where = staticmethod(np.where)

    def precise(self, x: Array) -> bool:
        return True

    def bit(self, x: Array, place: int) -> NDArray[np.bool_]:
        return x.view(np.int64) >> place & 1 == 1

    def power(self, m: Array) -> Array:
        return ((m.view(np.int64) + EXPONENT_BIAS & EXPONENT) << MANTISSA_BITS).view(np.float64)

    def fraction(self, x: Array) -> Array:
        return (np.asarray(x).view(np.int64) & MANTISSA | EXPONENT_BIAS - 1 << MANTISSA_BITS).view(np.float64)

    def exponent(self, x: Array) -> Array:
        return ((np.asarray(x).view(np.int64) >> MANTISSA_BITS & EXPONENT) - EXPONENT_BIAS + 1).astype(np.float64)

    def word(self, x: Array) -> NDArray[np.uint64]:
        return x.astype(np.uint64)

    def number(self, word: NDArray[np.uint64]) -> Array:
        return word.astype(np.float64)


FLOATS = Floats()
ARRAYS = Arrays()


def functions_of(*values: object) -> Kind:
    """The functions for these values: the first that is neither a float nor an int decides."""
    for value in values:
        if isinstance(value, REALS):
            continue
        if isinstance(value, np.ndarray | np.generic):
            return ARRAYS
        if hasattr(value, "functions"):
            return value.functions
        return foreign_functions(value)
    return FLOATS


def foreign_functions(value: object) -> Kind:
    """The functions for a number of another package, which need not be installed: SymPy."""
    if type(value).__module__.partition(".")[0] == "sympy":
        from quadstep.numbers.symbols import SYMBOLS  # noqa: PLC0415 (loaded only where it is used)

        return SYMBOLS
    raise TypeError(f"{type(value).__name__} is not a number that a law can use")

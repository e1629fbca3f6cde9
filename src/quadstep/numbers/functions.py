"""The functions of a number, dispatched on the kind of number.

Laws call these functions, never `math` or `numpy`, and never branch on a number: `where` chooses between two values.
A new kind of number needs a class attribute `functions` with the methods of `Functions`.
"""

import math
import struct
from collections.abc import Iterable, Sequence
from functools import reduce
from typing import Protocol, TypeAlias, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from quadstep.numbers.elementary import Elementary

Number: TypeAlias = float
"""A number in a law. The type checker reads a law as if it were over floats; any other kind behaves the same."""

Condition: TypeAlias = bool
"""The result of comparing two numbers. Pass it to `where`; a lane's condition refuses `if`."""

Word: TypeAlias = int
"""Bits of a number: adds, shifts, ands, ors and xors like an integer. At least 32 bits; mask anything that may grow beyond."""


Array: TypeAlias = NDArray[np.float64]

N = TypeVar("N")
C_contra = TypeVar("C_contra", contravariant=True)
W = TypeVar("W")


class Functions(Protocol[N, C_contra, W]):
    """The functions that a kind of number N must provide; comparisons of such numbers return C, their bits are W."""

    def sin(self, x: N) -> N: ...
    def cos(self, x: N) -> N: ...
    def exp(self, x: N) -> N: ...
    def sigmoid(self, x: N) -> N: ...
    def log(self, x: N) -> N: ...
    def sqrt(self, x: N) -> N: ...
    def atan2(self, y: N, x: N) -> N: ...
    def where(self, condition: C_contra, yes: N, no: N) -> N: ...
    def word(self, x: N) -> W: ...
    def number(self, word: W) -> N: ...


OfLaw: TypeAlias = Functions[Number, Condition, Word]
"""The functions as a law sees them, whatever kind its numbers are."""

DOUBLE, WHOLE = struct.Struct("<d"), struct.Struct("<q")
EXPONENT_BIAS, MANTISSA_BITS = 1023, 52
MANTISSA = (1 << MANTISSA_BITS) - 1
EXPONENT = (1 << 11) - 1


def bits_of(x: float) -> int:
    """The 64 bits of a float, as a whole number with sign."""
    bits: int = WHOLE.unpack(DOUBLE.pack(x))[0]
    return bits


def float_of(bits: int) -> float:
    """The float of these bits, below 2^63."""
    x: float = DOUBLE.unpack(WHOLE.pack(bits))[0]
    return x


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
    """NumPy arrays: one flight per element."""

    sqrt = staticmethod(np.sqrt)
    where = staticmethod(np.where)

    def precise(self, x: Array) -> bool:
        return True

    def bit(self, x: Array, place: int) -> NDArray[np.bool_]:
        is_set: NDArray[np.bool_] = x.view(np.int64) >> place & 1 == 1
        return is_set

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
ARRAYS = cast("Functions[Array, NDArray[np.bool_], NDArray[np.uint64]]", Arrays())


def functions_of(*values: object) -> OfLaw:
    """The functions for these values: the first that is neither a float nor an int decides."""
    for value in values:
        if isinstance(value, float | int):
            continue
        if isinstance(value, np.ndarray | np.generic):
            return cast(OfLaw, ARRAYS)
        if hasattr(value, "functions"):
            found: OfLaw = value.functions
            return found
        return foreign_functions(value)
    return FLOATS


def foreign_functions(value: object) -> OfLaw:
    """The functions for a number of another package, which need not be installed: SymPy."""
    if type(value).__module__.partition(".")[0] == "sympy":
        from quadstep.numbers.symbols import SYMBOLS  # noqa: PLC0415 (loaded only where it is used)

        return cast(OfLaw, SYMBOLS)
    raise TypeError(f"{type(value).__name__} is not a number that a law can use")


def sin(x: Number) -> Number:
    """Sine of an angle [rad], at most 1.6e6 (f32: 12867); NaN beyond. The same to the bit on every engine.

    >>> from quadstep.numbers import sin
    >>> sin(0.5)
    0.479425538604203
    """
    result: Number = functions_of(x).sin(x)
    return result


def cos(x: Number) -> Number:
    """Cosine of an angle [rad], at most 1.6e6 (f32: 12867); NaN beyond. The same to the bit on every engine.

    >>> from quadstep.numbers import cos
    >>> cos(0.0)
    1.0
    """
    result: Number = functions_of(x).cos(x)
    return result


def exp(x: Number) -> Number:
    """Exponential; infinite above 709.4 (f32: 88.3), zero below -708.7 (f32: -87.6).

    >>> from quadstep.numbers import exp
    >>> exp(0.0), exp(-800.0)
    (1.0, 0.0)
    """
    result: Number = functions_of(x).exp(x)
    return result


def sigmoid(x: Number) -> Number:
    """Logistic function 1 / (1 + exp(-x)), the activation of the paper's nets.

    >>> from quadstep.numbers import sigmoid
    >>> sigmoid(0.0)
    0.5
    """
    result: Number = functions_of(x).sigmoid(x)
    return result


def log(x: Number) -> Number:
    """Natural logarithm; -inf at zero, NaN below. It is constant below the smallest normal number.

    >>> from quadstep.numbers import log
    >>> log(1.0), log(-1.0)
    (0.0, nan)
    """
    result: Number = functions_of(x).log(x)
    return result


def sqrt(x: Number) -> Number:
    """Square root; NaN below zero.

    >>> from quadstep.numbers import sqrt
    >>> sqrt(9.0), sqrt(-1.0)
    (3.0, nan)
    """
    result: Number = functions_of(x).sqrt(x)
    return result


def atan2(y: Number, x: Number) -> Number:
    """Angle of the point (x, y), in (-pi, pi] [rad]; zero at the origin.

    >>> from quadstep.numbers import atan2
    >>> atan2(1.0, 0.0), atan2(0.0, 0.0)
    (1.5707963267948966, 0.0)
    """
    result: Number = functions_of(y, x).atan2(y, x)
    return result


def where(condition: Condition, yes: Number, no: Number) -> Number:
    """`yes` where the condition holds, else `no`. Both are computed; laws use it instead of `if`.

    >>> from quadstep.numbers import where
    >>> where(2.0 > 1.0, 3.0, 4.0)
    3.0
    >>> import numpy as np
    >>> where(np.array([0.5, 1.5]) > 1.0, 3.0, 4.0)
    array([4., 3.])
    """
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
    """The smaller of two numbers.

    >>> from quadstep.numbers import minimum
    >>> minimum(2.0, 3.0)
    2.0
    """
    return where(a < b, a, b)


def maximum(a: Number, b: Number) -> Number:
    """The larger of two numbers.

    >>> from quadstep.numbers import maximum
    >>> maximum(2.0, 3.0)
    3.0
    """
    return where(a > b, a, b)


def smallest(values: Iterable[Number]) -> Number:
    """The smallest of some numbers."""
    return reduce(minimum, values)


def largest(values: Iterable[Number]) -> Number:
    """The largest of some numbers."""
    return reduce(maximum, values)


def clip(x: Number, low: Number, high: Number) -> Number:
    """`x` clipped to `low` and `high`.

    >>> from quadstep.numbers import clip
    >>> clip(5.0, -1.0, 1.0)
    1.0
    """
    return minimum(maximum(x, low), high)


def absolute(x: Number) -> Number:
    """Magnitude.

    >>> from quadstep.numbers import absolute
    >>> absolute(-2.0)
    2.0
    """
    return abs(x)


def power(x: Number, exponent: Number) -> Number:
    """|x|^exponent with the sign of x, for an exponent above 0: zero at zero, odd, and of a positive x its power.

    Its slope at zero is 0 for exponents above 1, and without bound below, where `quadstep linear` has no margins at x = 0.

    >>> from quadstep.numbers import power
    >>> power(4.0, 0.5), power(-4.0, 1.5), power(0.0, 0.5)
    (2.0, -7.999999999999998, 0.0)
    """
    own = getattr(functions_of(x, exponent), "signed_power", None)
    if own is not None:
        result: Number = own(x, exponent)
        return result
    size = absolute(x)
    raised = exp(exponent * log(where(size > 0.0, size, 1.0)))
    return where(x > 0.0, raised, where(x < 0.0, -raised, x))


def sinc(x: Number) -> Number:
    """sin(x) / x, 1 at zero; a kind of number may provide a better one.

    >>> from quadstep.numbers.functions import sinc
    >>> sinc(0.0), sinc(1.0)
    (1.0, 0.8414709848078965)
    """
    own = getattr(functions_of(x), "sinc", None)
    if own is not None:
        result: Number = own(x)
        return result
    small = absolute(x) < 1e-4
    return where(small, 1.0 - x * x / 6.0, sin(x) / where(small, 1.0, x))


def length(square: Number, entries: Sequence[Number]) -> Number:
    """The root of the sum of squares of `entries`, given that sum; a kind of number may know better."""
    own = getattr(functions_of(square), "length", None)
    result: Number = own(square, entries) if own is not None else sqrt(square)
    return result


def entry(index: Number, size: int) -> Number:
    """A whole index limited to the entries of a table, 0 to size - 1; in a diverged flight, NaN gives the last."""
    return where(index < size - 1.0, where(index > 0.0, index, 0.0), size - 1.0)

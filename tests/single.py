"""Single-precision numbers: f32 one operation at a time, as lanes and processors compute it.

A Python float beside one is a constant of the law and rounded before it is used. Comparisons give plain truth values.
"""

from __future__ import annotations

import operator
from collections.abc import Callable

import numpy as np

from quadstep.numbers.operation import Elementary

EXPONENT_BIAS, MANTISSA_BITS = 127, 23
MANTISSA = (1 << MANTISSA_BITS) - 1
EXPONENT = (1 << 8) - 1


class Single:
    """One f32. Infinities and NaN arise as in IEEE 754: NumPy's warnings are best suppressed around a whole law."""

    __slots__ = ("value",)
    functions: Singles

    def __init__(self, value: float | np.float32) -> None:
        self.value = np.float32(value)

    def __float__(self) -> float:
        return float(self.value)

    def __repr__(self) -> str:
        return f"Single({float(self)!r})"

    def __add__(self, other: Single | float) -> Single:
        return calculated(operator.add, self, other)

    def __radd__(self, other: float) -> Single:
        return calculated(operator.add, other, self)

    def __sub__(self, other: Single | float) -> Single:
        return calculated(operator.sub, self, other)

    def __rsub__(self, other: float) -> Single:
        return calculated(operator.sub, other, self)

    def __mul__(self, other: Single | float) -> Single:
        return calculated(operator.mul, self, other)

    def __rmul__(self, other: float) -> Single:
        return calculated(operator.mul, other, self)

    def __truediv__(self, other: Single | float) -> Single:
        return calculated(operator.truediv, self, other)

    def __rtruediv__(self, other: float) -> Single:
        return calculated(operator.truediv, other, self)

    def __neg__(self) -> Single:
        return Single(-self.value)

    def __pos__(self) -> Single:
        return self

    def __abs__(self) -> Single:
        return Single(abs(self.value))

    def __lt__(self, other: Single | float) -> bool:
        return bool(self.value < rounded(other))

    def __le__(self, other: Single | float) -> bool:
        return bool(self.value <= rounded(other))

    def __gt__(self, other: Single | float) -> bool:
        return bool(self.value > rounded(other))

    def __ge__(self, other: Single | float) -> bool:
        return bool(self.value >= rounded(other))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Single | float | int) and bool(self.value == rounded(other))

    __hash__ = None  # type: ignore[assignment]


OPERANDS = (Single, float, int)


def rounded(number: Single | float) -> np.float32:
    """The nearest f32."""
    return number.value if isinstance(number, Single) else np.float32(number)


def calculated(operation: Callable[[np.float32, np.float32], np.float32], a: Single | float, b: Single | float) -> Single:
    """One operation, rounded once; a vector operand handles the operation itself."""
    if not isinstance(a, OPERANDS) or not isinstance(b, OPERANDS):
        return NotImplemented
    return Single(operation(rounded(a), rounded(b)))


def bits_of(x: Single) -> int:
    """The 32 bits."""
    return int(x.value.view(np.uint32))


def of_bits(bits: int) -> Single:
    """The number of these 32 bits."""
    return Single(np.uint32(bits & 0xFFFFFFFF).view(np.float32))


class Singles(Elementary):
    """The functions of `quadstep.numbers` for them."""

    def precise(self, x: Single) -> bool:
        return False

    def bit(self, x: Single, place: int) -> bool:
        return bits_of(x) >> place & 1 == 1

    def power(self, m: Single) -> Single:
        return of_bits((bits_of(m) + EXPONENT_BIAS & EXPONENT) << MANTISSA_BITS)

    def fraction(self, x: Single) -> Single:
        return of_bits(bits_of(x) & MANTISSA | EXPONENT_BIAS - 1 << MANTISSA_BITS)

    def exponent(self, x: Single) -> Single:
        return Single((bits_of(x) >> MANTISSA_BITS & EXPONENT) - EXPONENT_BIAS + 1)

    def sqrt(self, x: Single) -> Single:
        return Single(np.sqrt(x.value))

    def where(self, condition: bool, yes: Single | float, no: Single | float) -> Single:
        chosen = yes if condition else no
        return chosen if isinstance(chosen, Single) else Single(chosen)

    def word(self, x: Single) -> SingleWord:
        return SingleWord(int(x.value))

    def number(self, word: SingleWord) -> Single:
        return Single(np.float32(np.uint32(word.bits)))


class SingleWord:
    """Bits from an f32 that may become one again; as a Python int, like a constant."""

    __slots__ = ("bits",)
    functions: Singles

    def __init__(self, bits: int) -> None:
        self.bits = bits

    def __index__(self) -> int:
        return self.bits

    def __and__(self, other: SingleWord | int) -> SingleWord:
        return SingleWord(self.bits & operator.index(other))

    def __or__(self, other: SingleWord | int) -> SingleWord:
        return SingleWord(self.bits | operator.index(other))

    def __xor__(self, other: SingleWord | int) -> SingleWord:
        return SingleWord(self.bits ^ operator.index(other))

    def __add__(self, other: SingleWord | int) -> SingleWord:
        return SingleWord(self.bits + operator.index(other))

    def __lshift__(self, bits: int) -> SingleWord:
        return SingleWord(self.bits << bits)

    def __rshift__(self, bits: int) -> SingleWord:
        return SingleWord(self.bits >> bits)

    __radd__, __rxor__ = __add__, __xor__


Single.functions = SingleWord.functions = Singles()

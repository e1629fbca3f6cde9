"""The functions of a number, dispatched on the kind of number.

Laws call these functions, never `math` or `numpy`, and never branch on a number: `where` chooses between two values.
"""

from collections.abc import Iterable, Sequence
from functools import reduce

from quadstep.numbers.elementary import exp, log, sin
from quadstep.numbers.kinds import Condition, Number, Word, functions_of


def evenly_spaced(low: float, high: float, count: int) -> list[float]:
    """`count` numbers from low to high, both included exactly; only low if count is 1."""
    step = (high - low) / max(count - 1, 1)
    numbers = [low + i * step for i in range(count)]
    if count > 1:
        numbers[-1] = high
    return numbers


def sqrt(x: Number) -> Number:
    """Square root; NaN below zero.

    >>> from quadstep.numbers import sqrt
    >>> sqrt(9.0), sqrt(-1.0)
    (3.0, nan)
    """
    return functions_of(x).sqrt(x)


def where(condition: Condition, yes: Number, no: Number) -> Number:
    """`yes` where the condition holds, else `no`. Both are computed; laws use it instead of `if`.

    >>> from quadstep.numbers import where
    >>> where(2.0 > 1.0, 3.0, 4.0)
    3.0
    >>> import numpy as np
    >>> where(np.array([0.5, 1.5]) > 1.0, 3.0, 4.0)
    array([4., 3.])
    """
    if type(condition) is bool and type(yes) is float and type(no) is float:  # as `Floats` has it, without asking for it
        return yes if condition else no
    if type(condition) is int:  # Python's ~True is -2 and ~False -1: the lowest bit is right, and stays so under & and |
        condition = bool(condition & 1)
    return functions_of(condition, yes, no).where(condition, yes, no)


def word(x: Number) -> Word:
    """The bits of a whole number in [0, 2^31)."""
    return functions_of(x).word(x)


def number(bits: Word) -> Number:
    """The whole number in [0, 2^31) that has these bits."""
    return functions_of(bits).number(bits)


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
        return own(x, exponent)
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
        return own(x)
    small = absolute(x) < 1e-4
    return where(small, 1.0 - x * x / 6.0, sin(x) / where(small, 1.0, x))


def length(square: Number, entries: Sequence[Number]) -> Number:
    """The root of the sum of squares of `entries`, given that sum; a kind of number may know better."""
    own = getattr(functions_of(square), "length", None)
    return own(square, entries) if own is not None else sqrt(square)


def entry(index: Number, size: int) -> Number:
    """A whole index limited to the entries of a table, 0 to size - 1; in a diverged flight, NaN gives the last."""
    return where(index < size - 1.0, where(index > 0.0, index, 0.0), size - 1.0)

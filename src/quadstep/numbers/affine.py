"""Enclosures: numbers that contain every value of a law while its inputs stay in a box, in f64 and in exact arithmetic.

An affine form (Stolfi and de Figueiredo, "Self-validated numerical methods and applications", 1997): the value is

    centre + sum of parts_i e_i + something of size `rest` at most,    each e_i in [-1, 1],

where e_1, e_2 ... are the box's directions. Linear terms in the inputs cancel as they do in the law; nonlinear ones, and every
rounding, go into `rest`: that of the flown operation, whose f64 result the form contains as well as the exact one, and that
of the form itself. Without directions it is a ball. Arrays throughout: one operation encloses many samples.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, TypeAlias, overload

import numpy as np
from numpy.typing import NDArray

from quadstep.numbers.kinds import Choice, Truth
from quadstep.numbers.operation import Arithmetic, Kind, place

Array: TypeAlias = NDArray[np.float64]

Plain: TypeAlias = float | Array
"""A known number, or one for each sample."""

Operand: TypeAlias = "Enclosure | Plain"
"""What a law combines: enclosures with one another, and with known numbers."""

ROUNDING = 2.0**-49
"""Sixteen half units in the last place: more than the flown operation and the few that compute its form lose together."""

HALF_UNIT = 2.0**-53
"""The most that one operation loses by rounding, relative to its result."""

MOST_SUMMED = 2**16
"""Positive numbers in one sum whose rounding `UP` covers; the largest are over pairs of directions, of up to 255 states."""

UP = 1.0 + 2.0**-36
"""The factor from such a sum as computed, in any order, to more than the exact one, in proofs and their checks.

n numbers lose at most n h / (1 - n h) of the sum, h being HALF_UNIT (Higham 2002, section 4.2): for 2^16 of them 2^-37 and a
little. The other half is for the few operations around the sum, and for what `UP` itself rounds.
"""

CLEAR = 1.0 + 1e-6
"""Factor by which a distance from zero must exceed what may be subtracted from it, for their difference to be accurate."""

ELEMENTARY = 2.0**-48
"""Relative error allowed for `elementary.py`. `make proofs` checks that the polynomials, rounding included, use a
quarter of it at most; the largest measured error is 2.3 of its 16 units in the last place (docs/decisions/0012).
"""

REDUCED = 2.0**-51
"""Its error relative to 1 where an angle is reduced, or a sigmoid's argument is converted to octaves."""

TINY = 1e-300
"""More than any loss by underflow."""

PLAIN = (float, int, np.ndarray, np.generic)
"""The classes of known numbers."""


class UndefinedError(Exception):
    """A law has no bounded value on all of a box; says what fails, and where."""


class Fresh:
    """Directions that functions may still use for their nonlinear remainders, so that these cancel too.

    second: for this many first directions every product has its own direction, in rows after them: e_i e_j in row second +
    i second + j. Second-order terms then cancel, and only third-order terms are left to the rest.
    """

    def __init__(self, first: int, past: int, second: int = 0) -> None:
        self.next, self.past, self.second = first, past, second


class Enclosure(Arithmetic["Operand"]):
    """centre, rest, reach: of one shape S; parts: (directions, *S), or None for a ball.

    reach: how far a value may be from the centre, at most. floor: what it is never below, known beside the form: zero of a sum
    of squares, the larger lower bound of a `maximum`.
    """

    __slots__ = ("centre", "floor", "fresh", "known", "parts", "reach", "rest")
    __array_ufunc__ = None
    functions: Kind

    def __init__(
        self, centre: Array, parts: Array | None, rest: Array, reach: Array, fresh: Fresh | None = None,
        floor: Array | None = None,
    ) -> None:  # fmt: skip
        self.centre, self.parts, self.rest, self.reach = centre, parts, rest, reach
        self.fresh, self.floor = fresh, floor
        self.known = parts is None

    def __repr__(self) -> str:
        return f"Enclosure({self.centre!r} +- {self.tight!r})"

    @property
    def tight(self) -> Array:
        """How far a value may be from the centre, summed over the parts."""
        if not self.known:
            assert self.parts is not None
            summed = np.abs(self.parts).sum(axis=0)
            self.reach = np.minimum(self.reach, (summed + self.rest) * (1.0 + 1e-13) + TINY)
            self.known = True
        return self.reach

    @property
    def low(self) -> Array:
        width = self.tight
        low: Array = np.where(width == 0.0, self.centre, np.nextafter(self.centre - width, -np.inf))
        return low if self.floor is None else np.maximum(low, self.floor)

    @property
    def high(self) -> Array:
        width = self.tight
        return np.where(width == 0.0, self.centre, np.nextafter(self.centre + width, np.inf))

    @property
    def size(self) -> Array:
        """A bound on its magnitude."""
        return (np.abs(self.centre) + self.tight) * (1.0 + ROUNDING)

    def made(
        self, centre: Array, parts: Array | None, rest: Array, reach: Array, lost: Plain, floor: Array | None = None
    ) -> Enclosure:
        """The form with a loss of `lost` by rounding in its operations."""
        return Enclosure(centre, parts, rest + lost, reach + lost, self.fresh, floor)

    def __add__(self, other: Operand) -> Enclosure:
        if isinstance(other, Enclosure):
            centre, reach = self.centre + other.centre, self.reach + other.reach
            lost = ROUNDING * (np.abs(centre) + reach)
            parts = added(self.parts, other.parts)
            floor = None if self.floor is None or other.floor is None else below(self.floor + other.floor)
            return self.made(centre, parts, self.rest + other.rest, reach, lost, floor)
        if not isinstance(other, PLAIN):
            return NotImplemented
        if isinstance(other, float | int) and other == 0.0:
            return self
        centre = self.centre + other
        lost = ROUNDING * (np.abs(centre) + self.reach)
        floor = None if self.floor is None else below(self.floor + other)
        return self.made(centre, self.parts, self.rest, self.reach, lost, floor)

    __radd__ = __add__

    def __neg__(self) -> Enclosure:
        return Enclosure(-self.centre, None if self.parts is None else -self.parts, self.rest, self.reach, self.fresh)

    @overload
    def __mul__(self, other: Enclosure) -> Enclosure: ...
    @overload
    def __mul__(self, other: Plain) -> Enclosure | float: ...
    def __mul__(self, other: Operand) -> Enclosure | float:
        if isinstance(other, Enclosure):
            return self.squared() if other is self else product(self, other)
        if not isinstance(other, PLAIN):
            return NotImplemented
        return 0.0 if np.all(np.asarray(other) == 0.0) else self.scaled(other)

    __rmul__ = __mul__

    def scaled(self, factor: Plain) -> Enclosure:
        """Its product with a known number; `*` gives 0.0 where that is zero."""
        if isinstance(factor, float | int) and factor == 1.0:
            return self
        size, centre = np.abs(factor), self.centre * factor
        reach = size * self.reach
        parts = None if self.parts is None else self.parts * factor
        lost = ROUNDING * (np.abs(centre) + reach) + underflow(self)
        floor = None if self.floor is None or np.any(np.asarray(factor) < 0.0) else below(self.floor * factor)
        return self.made(centre, parts, size * self.rest, reach, lost, floor)

    def squared(self) -> Enclosure:
        """Its product with itself: centre^2 + 2 centre d + d^2, d^2 between 0 and the reach's square."""
        if self.fresh is not None and self.fresh.second:
            found = product(self, self)
            found.floor = np.zeros_like(found.centre)
            return found
        size, half = np.abs(self.centre), 0.5 * self.tight * self.tight
        centre = self.centre * self.centre + half
        parts = None if self.parts is None else (2.0 * self.centre) * self.parts
        reach = 2.0 * size * self.reach + half
        lost = ROUNDING * (centre + reach) + underflow(self)
        return self.made(centre, parts, 2.0 * size * self.rest + half, reach, lost, np.zeros_like(centre))

    def __truediv__(self, other: Operand) -> Enclosure:
        if isinstance(other, Enclosure):
            return self * inverse(other)
        if isinstance(other, PLAIN):
            if np.any(np.asarray(other) == 0.0):
                raise UndefinedError(f"a division by zero ({place()})")
            size, centre = np.abs(other), self.centre / other
            reach = self.reach / size
            parts = None if self.parts is None else self.parts / other
            return self.made(centre, parts, self.rest / size, reach, ROUNDING * (np.abs(centre) + reach) + underflow(self))
        return NotImplemented

    def __rtruediv__(self, other: Plain) -> Enclosure | float:
        return inverse(self) * other

    def __abs__(self) -> Enclosure:
        chosen = Enclosure.functions.where(self < 0.0, -self, self)
        return Enclosure(chosen.centre, chosen.parts, chosen.rest, chosen.reach, chosen.fresh, np.zeros_like(chosen.centre))

    def over(self, other: Operand) -> Enclosure:
        """self - other, for a comparison: an infinite limit is treated like a far one."""
        if isinstance(other, float) and abs(other) == np.inf:
            return self - float(np.copysign(1e300, other))
        return self - other

    def __lt__(self, other: Operand) -> Truth:
        if other is self:
            return Truth(np.zeros_like(self.centre, dtype=bool), np.ones_like(self.centre, dtype=bool))
        gap = self.over(other)
        return Truth(~(gap.low >= 0.0), ~(gap.high < 0.0), (self, other))  # NaN is undecided

    def __le__(self, other: Operand) -> Truth:
        if other is self:
            return Truth(np.ones_like(self.centre, dtype=bool), np.zeros_like(self.centre, dtype=bool))
        gap = self.over(other)
        return Truth(~(gap.low > 0.0), ~(gap.high <= 0.0), (self, other))

    def __gt__(self, other: Operand) -> Truth:
        return ~self.__le__(other)

    def __ge__(self, other: Operand) -> Truth:
        return ~self.__lt__(other)


def below(x: Plain) -> Array:
    """A number that the same operation of floats, and of real numbers, is never below."""
    return x - (ROUNDING * np.abs(x) + TINY * (np.asarray(x) != 0.0))


def underflow(a: Enclosure, b: Enclosure | None = None) -> Array:
    """What a product may lose by underflow: nothing if a factor is exactly zero."""
    may: Array = TINY * ((np.abs(a.centre) + a.reach) != 0.0)
    return may if b is None else may * ((np.abs(b.centre) + b.reach) != 0.0)


def ball(centre: Plain | list[float], rest: Plain = 0.0) -> Enclosure:
    centre = np.asarray(centre, dtype=np.float64)
    width = np.broadcast_to(np.asarray(rest, dtype=np.float64), centre.shape)
    return Enclosure(centre, None, width, width)


def added(a: Array | None, b: Array | None) -> Array | None:
    """The sum of two forms' parts."""
    if a is None or b is None:
        return a if b is None else b
    return a + b


def product(a: Enclosure, b: Enclosure) -> Enclosure:
    """centre_a centre_b + centre_a d_b + centre_b d_a + d_a d_b."""
    size_a, size_b, bend = np.abs(a.centre), np.abs(b.centre), a.tight * b.tight
    centre = a.centre * b.centre
    parts = added(None if a.parts is None else a.parts * b.centre, None if b.parts is None else b.parts * a.centre)
    reach = size_a * b.reach + size_b * a.reach + bend
    parts, bend = curved(parts, a, b, 1.0, bend)
    rest = size_a * b.rest + size_b * a.rest + bend
    return a.made(centre, parts, rest, reach, ROUNDING * (np.abs(centre) + reach) + underflow(a, b))


def curved(parts: Array | None, a: Enclosure, b: Enclosure, curve: Plain, bend: Array) -> tuple[Array | None, Array]:
    """Parts of a form with curve d_a d_b added, and the remainder outside the parts; `bend` where the parts have no room.

    d: deviation of a form from its centre.
    """
    n = a.fresh.second if a.fresh is not None else 0
    if not n or parts is None or a.parts is None or b.parts is None:
        return parts, bend
    line_a, line_b = a.parts[:n], b.parts[:n]
    whole = parts.copy()
    whole[n : n + n * n] += (line_a[:, None] * (curve * line_b)).reshape(n * n, -1)
    other_a = np.abs(a.parts[n:]).sum(axis=0) + a.rest
    other_b = other_a if b is a else np.abs(b.parts[n:]).sum(axis=0) + b.rest
    left = other_a * b.tight + np.abs(line_a).sum(axis=0) * other_b
    return whole, np.abs(curve) * left * (1.0 + 1e-12)


class Third(NamedTuple):
    """A smooth function's parabola at the centre. curve: half its second derivative. bend: bound on the deviation from it."""

    curve: Array
    bend: Array


def smooth(
    x: Enclosure, value: Array, slope: Array, bend: Array, third: Third | None, lost: Callable[[Array], Plain],
    wide: float = 1.0,
) -> Enclosure:  # fmt: skip
    """A smooth function: its value and slope at the centre, and a bound on its deviation from that line, or its parabola where
    there is room for one. lost: by rounding, from the reach. wide: factor on the bounds, for what they round themselves.
    """
    size, left, parts = np.abs(slope), bend, None if x.parts is None else slope * x.parts
    reach = size * x.reach + bend * wide
    if third is not None and x.fresh is not None and x.fresh.second and parts is not None:
        parts, left = curved(parts, x, x, third.curve, bend)
        left = left + third.bend * (1.0 + 1e-12)
    return x.made(value, parts, size * x.rest + left * wide, reach, lost(reach))


def straight(x: Enclosure, value: Array, slope: Array, bend: Array, third: Third) -> Enclosure:
    """A smooth function that is flown in one operation, its rest as a separate direction."""
    return of_its_own(smooth(x, value, slope, bend, third, lambda reach: ROUNDING * (np.abs(value) + reach + x.reach) + TINY))


def elementary_function(
    x: Enclosure, value: Array, slope: Array, bend: Array, also: Plain = 0.0, third: Third | None = None
) -> Enclosure:
    """A smooth function whose value and slope have the error of `elementary.py`. also: further error of the value."""

    def lost(reach: Array) -> Plain:
        return ELEMENTARY * (np.abs(value) + reach + x.reach) + also + TINY

    return smooth(x, value, slope, bend, third, lost, 1.0 + 1e-12)


def of_its_own(x: Enclosure) -> Enclosure:
    """The form with its rest as a separate direction, if one is left."""
    if x.fresh is None or x.parts is None or x.fresh.next >= x.fresh.past:
        return x
    parts = x.parts.copy()
    parts[x.fresh.next] = x.rest
    x.fresh.next += 1
    return Enclosure(x.centre, parts, np.zeros_like(x.rest), x.reach, x.fresh, x.floor)


def inverse(x: Enclosure) -> Enclosure:
    """1 / x: off its tangent by d^2 / (c^2 (c + d)); where only the floor keeps x from zero, all that lies between."""
    size, width = np.abs(x.centre), x.tight
    near = ~(size > width * CLEAR + TINY)
    if not np.any(near):
        return tangent(x, x.centre, width)
    low = x.low
    if not np.all(~near | (low > TINY)):
        raise UndefinedError(f"a division by a number that may be zero ({place()})")
    least, most = 1.0 / x.high, 1.0 / np.where(near, low, 1.0)
    middle, half = 0.5 * (most + least), 0.5 * (most - least)
    range_ = x.made(middle, zeros_like(x.parts), half, half, ROUNDING * most)
    return merged(near, range_, tangent(x, np.where(near, 1.0, x.centre), np.where(near, 0.0, width)))


def tangent(x: Enclosure, centre: Array, width: Array) -> Enclosure:
    """1 / x, with the line at the centre."""
    value = 1.0 / centre
    square = value * value
    bend = width * width * square / (np.abs(centre) - width) * (1.0 + 1e-12)
    third = Third(square * value, bend * width * np.abs(value))
    return smooth(x, value, -square, bend, third, lambda reach: ROUNDING * 4.0 * (np.abs(value) + reach) + TINY)


def finite(x: Array) -> Array:
    """The same. Raises UndefinedError."""
    if not np.all(np.isfinite(x)):
        raise UndefinedError(f"an unbounded angle or exponent ({place()})")
    return x


def zeros_like(parts: Array | None) -> Array | None:
    """No parts, of the same shape."""
    return None if parts is None else np.zeros_like(parts)


def merged(choice: Choice, yes: Enclosure, no: Enclosure) -> Enclosure:
    """`yes` for some samples, `no` for the others."""
    parts = None
    if yes.parts is not None or no.parts is not None:
        parts = np.where(choice, 0.0 if yes.parts is None else yes.parts, 0.0 if no.parts is None else no.parts)
    centre, rest, reach = (np.where(choice, getattr(yes, name), getattr(no, name)) for name in ("centre", "rest", "reach"))
    floor = None
    if yes.floor is not None or no.floor is not None:
        floor = np.where(choice, yes.low if yes.floor is None else yes.floor, no.low if no.floor is None else no.floor)
    return Enclosure(centre, parts, rest, reach, yes.fresh or no.fresh, floor)

"""Boxes of states as enclosures, and images of a law as arrays; products of matrices with bounds on their rounding."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from quadstep.numbers.affine import HALF_UNIT, UP
from quadstep.numbers.enclosure import Array, Enclosure, Fresh, Operand, ball


def lost(count: int) -> float:
    """Bound on a sum's rounding for `count` products, relative to their sizes, in any order (Higham 2002, section 3.5)."""
    return count * HALF_UNIT / (1.0 - count * HALF_UNIT) * UP


def summed(count: int) -> float:
    """More than a sum of so many products of positive numbers loses by rounding, relative to itself."""
    return UP * (1.0 + lost(count + 2))


class BoundedMatrix(NamedTuple):
    """Matrices, and bounds on their distance from the exact ones, entry by entry; with the same leading axes."""

    middle: Array
    off: Array

    def times(self, other: BoundedMatrix) -> BoundedMatrix:
        size = np.abs(self.middle)
        rounded = lost(self.middle.shape[-1] + 2) * (size @ np.abs(other.middle))
        off = (rounded + size @ other.off + self.off @ (np.abs(other.middle) + other.off)) * UP
        return BoundedMatrix(self.middle @ other.middle, off)

    @property
    def size(self) -> Array:
        """A bound of the entries' magnitudes."""
        return (np.abs(self.middle) + self.off) * UP


def powers(base: BoundedMatrix, count: int) -> BoundedMatrix:
    """base^0 to base^count, stacked."""
    n = len(base.middle)
    now = BoundedMatrix(np.eye(n), np.zeros((n, n)))
    found = [now]
    for _ in range(count):
        now = now.times(base)
        found.append(now)
    return BoundedMatrix(np.stack([one.middle for one in found]), np.stack([one.off for one in found]))


def seeded(centres: Array, spread: Array, spare: int = 0, second: int = 0) -> list[Enclosure]:
    """Numbers that fill a box: centres + spread e, with e in [-1, 1].

    centres: (numbers, samples). spread: (numbers, directions), or (numbers, directions, samples). spare: directions left for
    nonlinear terms; with `second`, for the products of that many first directions and for more, see `Fresh`.
    """
    count, samples = centres.shape
    directions = spread.shape[1]
    parts = np.zeros((count, directions + spare, samples))
    parts[:, :directions] = spread if spread.ndim == 3 else spread[:, :, None]
    reach = np.abs(parts).sum(axis=1) * UP
    fresh = Fresh(directions, directions if second else directions + spare, second) if spare else None
    nothing = np.zeros(samples)
    return [Enclosure(c, p, nothing, r, fresh) for c, p, r in zip(centres, parts, reach, strict=True)]


def widened(number: Enclosure | float, directions: int) -> Enclosure:
    """The same with so many further directions, on which it does not depend."""
    if not isinstance(number, Enclosure) or number.parts is None:
        return number if isinstance(number, Enclosure) else ball(np.array([number]))
    parts = np.concatenate([number.parts, np.zeros((directions, *number.centre.shape))])
    return Enclosure(number.centre, parts, number.rest, number.reach, None, number.floor)


class Image(NamedTuple):
    """A law's image of a box: centre + parts e + rest. Shapes (numbers, samples), of parts (numbers, directions, samples)."""

    centre: Array
    parts: Array
    rest: Array


def image(numbers: Sequence[Operand], directions: int, samples: int) -> Image:
    """The numbers as arrays; directions beyond those asked for count as rest."""
    centre, rest = np.zeros((len(numbers), samples)), np.zeros((len(numbers), samples))
    parts = np.zeros((len(numbers), directions, samples))
    for i, number in enumerate(numbers):
        one = number if isinstance(number, Enclosure) else ball(number)
        centre[i], rest[i] = one.centre, one.rest
        if one.parts is not None:
            parts[i] = one.parts[:directions]
            rest[i] += np.abs(one.parts[directions:]).sum(axis=0) * UP
    return Image(centre, parts, rest)

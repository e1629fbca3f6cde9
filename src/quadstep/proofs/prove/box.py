"""Boxes of states as enclosures, and images of a law as arrays."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from quadstep.numbers.enclosure import Array, Enclosure, Fresh, Operand, ball


def seeded(centres: Array, spread: Array, spare: int = 0, second: int = 0) -> list[Enclosure]:
    """Numbers that fill a box: centres + spread e, with e in [-1, 1].

    centres: (numbers, samples). spread: (numbers, directions), or (numbers, directions, samples). spare: directions left for
    nonlinear terms; with `second`, for the products of that many first directions and for more, see `Fresh`.
    """
    count, samples = centres.shape
    directions = spread.shape[1]
    parts = np.zeros((count, directions + spare, samples))
    parts[:, :directions] = spread if spread.ndim == 3 else spread[:, :, None]
    reach = np.abs(parts).sum(axis=1) * (1.0 + 1e-12)
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
            rest[i] += np.abs(one.parts[directions:]).sum(axis=0) * (1.0 + 1e-12)
    return Image(centre, parts, rest)

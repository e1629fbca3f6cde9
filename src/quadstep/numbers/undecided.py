"""Choices between enclosures that a comparison does not decide."""

from __future__ import annotations

import numpy as np

from quadstep.numbers.affine import ROUNDING, Enclosure, Operand
from quadstep.numbers.kinds import Truth


def lifted(x: Operand, like: Enclosure) -> Enclosure:
    """A number as an enclosure of the same shape."""
    if isinstance(x, Enclosure):
        return x
    centre = np.broadcast_to(np.asarray(x, dtype=np.float64), np.broadcast_shapes(np.shape(x), like.centre.shape))
    nothing = np.zeros_like(centre)
    return Enclosure(centre, None, nothing, nothing, like.fresh)


def undecided(condition: Truth, yes: Operand, no: Operand, like: Enclosure) -> Enclosure:
    """What holds both; of what is compared itself, the larger or the smaller."""
    small, large = condition.ordered or (None, None)
    one, other = lifted(yes, like), lifted(no, like)
    if yes is large and no is small:
        return larger(one, other)
    if yes is small and no is large:
        found = -larger(-one, -other)
        found.floor = np.minimum(one.low, other.low)
        return found
    return either(one, other)


def either(yes: Enclosure, no: Enclosure) -> Enclosure:
    """Half of each, and as much as they are apart."""
    yes_half, no_half = yes.scaled(0.5), no.scaled(0.5)
    middle, far = yes_half + no_half, (yes_half - no_half).size
    floor = None if yes.floor is None and no.floor is None else np.minimum(yes.low, no.low)
    return Enclosure(middle.centre, middle.parts, middle.rest + far, middle.reach + far, middle.fresh, floor)


def larger(a: Enclosure, b: Enclosure) -> Enclosure:
    """b + max(a - b, 0), with the line that is nearest to max(d, 0) between d's bounds l < 0 < h: share d + bend +- bend,

    share = h / (h - l), bend = -share l / 2.
    """
    gap = a - b
    low, high = np.minimum(gap.low, 0.0), np.maximum(gap.high, 0.0)
    share = np.where(high > low, high / np.where(high > low, high - low, 1.0), 0.5)
    bend = -0.5 * share * low + ROUNDING * (high - low)  # the second for the rounding of `share`
    line = b + (share * gap + bend)
    floor = np.maximum(a.low, b.low)
    return Enclosure(line.centre, line.parts, line.rest + bend, line.reach + bend, line.fresh, floor)

"""Products of matrices with bounds on their rounding, and powers."""

from typing import NamedTuple

import numpy as np

from quadstep.proofs.prove.sampled import Array

HALF_UNIT = 2.0**-53
UP = 1.0 + 1e-12
"""More than sums of up to 8,000 positive numbers lose by rounding, relative to themselves; `summed` for longer ones."""


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

    def times(self, other: "BoundedMatrix") -> "BoundedMatrix":
        """The product."""
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

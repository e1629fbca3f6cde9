"""Enclosed eigenvalues of a matrix that is known to within a radius: Gershgorin discs in its approximate eigenvectors.

For A within R of M, entry by entry, and M T = T D up to a defect, T^-1 A T = D + T^-1 (A T - T D). The defect is bounded
with the rounding of its own computation (Higham, "Accuracy and Stability of Numerical Algorithms", 2002, section 3.5), T^-1 by
an approximate inverse Y with |I - Y T| < 1 (Rump, "Verification methods", 2010, section 10).

Also the coordinates in which a sampled loop is nearly diagonal: its eigenvectors, those of equal eigenvalues kept apart. No
proof depends on them: any coordinates will do, good ones give larger sets.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadstep.numbers.affine import HALF_UNIT, UP

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


class Spectrum(NamedTuple):
    """Discs that contain all eigenvalues, the largest first. Each connected set of discs contains as many as it has discs."""

    centres: ComplexArray
    radii: Array

    @property
    def outside(self) -> int:
        """The number of eigenvalues that are certainly outside the unit circle."""
        size = np.abs(self.centres)
        out = size - self.radii > 1.0 + 1e-15
        inner, outer = np.flatnonzero(~out), np.flatnonzero(out)
        while len(outer):  # discs that touch one that is not outside prove nothing
            apart = np.abs(self.centres[outer, None] - self.centres[None, inner]) * (1.0 - 1e-12)
            touching = ~(apart > self.radii[outer, None] + self.radii[None, inner]).all(axis=1)
            if not touching.any():
                break
            inner, outer = np.concatenate([inner, outer[touching]]), outer[~touching]
        return len(outer)

    @property
    def inside(self) -> bool:
        """Whether all eigenvalues are certainly inside the unit circle."""
        return bool(np.all(np.abs(self.centres) + self.radii < 1.0 - 1e-15))


def products(count: int) -> float:
    """The most that a sum of `count` complex products loses by rounding, relative to the sum of their magnitudes."""
    return 4.0 * count * HALF_UNIT / (1.0 - 4.0 * count * HALF_UNIT)


def spectrum(middle: Array, radius: Array) -> Spectrum | None:
    """The discs for all matrices within `radius` of `middle`, both (n, n); None if the eigenvectors are nearly dependent."""
    count = len(middle)
    values, t = np.linalg.eig(middle)
    try:
        y = np.linalg.inv(t)
    except np.linalg.LinAlgError:
        return None
    size = np.abs(t)
    rounded = products(count + 4) * (np.abs(middle) @ size + size * np.abs(values))
    defect = np.abs(middle @ t - t * values) + rounded + radius @ size
    identity = np.abs(y @ t - np.eye(count)) + products(count + 2) * (np.abs(y) @ size)
    q = float(identity.sum(axis=1).max()) * UP
    if not q < 0.5:
        return None
    bound = np.abs(y) @ defect * UP
    bound = bound + q / (1.0 - q) * bound.max(axis=0)
    order = np.argsort(-np.abs(values))
    return Spectrum(values[order], (bound.sum(axis=1) * UP)[order])


COUPLED, EQUAL = 1e-12, 1e-3
"""Slopes below the first count as zero; eigenvalues nearer to each other than the second's share of their distance from 1
count as equal.
"""


NOTHING = 1e-90
"""Entries of eigenvectors below this are zero."""


class Eigenbasis(NamedTuple):
    """e = spread z: columns are eigenvectors, for a complex pair the real and the imaginary part. pairs: the first
    columns of pairs. values: the eigenvalue of every column; a pair has one as it is and one conjugate.
    """

    spread: Array
    pairs: tuple[int, ...]
    values: ComplexArray


def modes(slopes: Array) -> Eigenbasis:
    """The modes of the loop's slopes (states, states). Raises LinAlgError if eigenvectors are dependent."""
    count = len(slopes)
    spread, values, pairs = np.zeros((count, count)), np.zeros(count, dtype=complex), []
    column = 0
    for group in coupled(np.abs(slopes) > COUPLED):
        found, vectors = np.linalg.eig(slopes[np.ix_(group, group)])
        rows = np.linalg.inv(vectors)
        left = [i for i in range(len(group)) if found[i].imag >= 0.0]
        while left:
            same = [
                i
                for i in left
                if abs(found[i] - found[left[0]]) < EQUAL * abs(1.0 - found[i]) and alike(found[i], found[left[0]])
            ]
            left = [i for i in left if i not in same]
            for value, vector in zip(found[same], apart(vectors[:, same], rows[same]).T, strict=True):
                spread[group, column], values[column] = vector.real, value
                if value.imag:
                    pairs.append(column)
                    column += 1
                    spread[group, column], values[column] = vector.imag, value.conjugate()
                column += 1
    return Eigenbasis(np.where(np.abs(spread) < NOTHING, 0.0, spread), tuple(pairs), values)


def alike(a: complex, b: complex) -> bool:
    return bool((a.imag == 0.0) == (b.imag == 0.0))


def coupled(slopes: NDArray[np.bool_]) -> list[NDArray[np.intp]]:
    """The states in groups that do not depend on each other."""
    reach = slopes | slopes.T | np.eye(len(slopes), dtype=bool)
    for _ in range(len(slopes).bit_length()):
        reach = reach @ reach
    return [np.flatnonzero(row) for i, row in enumerate(reach) if not row[:i].any()]


def apart(vectors: ComplexArray, rows: ComplexArray) -> ComplexArray:
    """Another basis of the span of these eigenvectors, each with zeros where the others are largest.

    Along x and y a vehicle has the same modes; any mixture of two is one too, and a box of mixtures is larger than need be.
    """
    count = vectors.shape[1]
    if count == 1:
        return vectors
    weighed = vectors * np.sqrt((np.abs(rows) ** 2).sum(axis=0))[:, None]
    left, chosen = weighed.copy(), []
    for _ in range(count):
        size = np.sqrt((np.abs(left) ** 2).sum(axis=1))
        chosen.append(int(np.argmax(size * (1.0 - 1e-6 * np.arange(len(size))))))  # the first of equal ones
        along = left[chosen[-1]].conj() / size[chosen[-1]]
        left = left - np.outer(left @ along, along.conj())
    result: ComplexArray = vectors @ np.linalg.inv(weighed[chosen])
    return result

"""Coordinates in which a sampled loop is nearly diagonal: its eigenvectors, those of equal eigenvalues kept apart.

No proof depends on them: any coordinates will do, good ones give larger sets.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadstep.proofs.prove.sampled import Array

ComplexArray = NDArray[np.complex128]

COUPLED, EQUAL = 1e-12, 1e-3
"""Slopes below the first count as zero; eigenvalues nearer to each other than the second's share of their distance from 1
count as equal.
"""


NOTHING = 1e-90
"""Entries of eigenvectors below this are zero."""


class Modes(NamedTuple):
    """e = spread z: columns are eigenvectors, for a complex pair the real and the imaginary part. pairs: the first
    columns of pairs. values: the eigenvalue of every column; a pair has one as it is and one conjugate.
    """

    spread: Array
    pairs: tuple[int, ...]
    values: ComplexArray


def modes(slopes: Array) -> Modes:
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
    return Modes(np.where(np.abs(spread) < NOTHING, 0.0, spread), tuple(pairs), values)


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

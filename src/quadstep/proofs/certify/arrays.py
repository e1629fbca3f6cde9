"""Conversions between the laws' vectors of numbers and NumPy arrays of whole flights, one row per sample."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from quadstep.numbers import Matrix, Number, Vector

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


def as_vector(rows: Array) -> Vector:
    """A vector whose entries are the columns of `rows`, shape (n, k)."""
    return Vector(rows.T)


def as_rows(entries: Iterable[Number], count: int) -> Array:
    """A vector of arrays or numbers as an array of shape (count, k)."""
    return np.stack([np.broadcast_to(np.asarray(entry, dtype=np.float64), count) for entry in entries], axis=1)


def as_stack(matrix: Matrix, count: int) -> Array:
    """A matrix of arrays or numbers as an array of shape (count, rows, columns)."""
    return np.stack([as_rows(row, count) for row in matrix], axis=1)


def dot(a: Array, b: Array) -> Array:
    """Inner product of each sample's vectors, shape (n,)."""
    product: Array = np.einsum("...i,...i->...", a, b)
    return product


def apply(matrices: Array, vectors: Array) -> Array:
    """Each sample's matrix times its vector, shape (n, k)."""
    product: Array = np.einsum("nij,nj->ni", matrices, vectors)
    return product


def lengths(rows: Array) -> Array:
    """Euclidean length of each sample's vector, or Frobenius norm of its matrix, shape (n,)."""
    result: Array = np.sqrt(np.square(rows).reshape(len(rows), -1).sum(axis=1))
    return result

"""Vectors of laws as NumPy arrays, one row per sample; and a second implementation, in plain NumPy, of what
the completed and the rotation law are made of.
"""

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
    return np.einsum("...i,...i->...", a, b)


def apply(matrices: Array, vectors: Array) -> Array:
    """Each sample's matrix times its vector, shape (n, k)."""
    return np.einsum("nij,nj->ni", matrices, vectors)


def lengths(rows: Array) -> Array:
    """Euclidean length of each sample's vector, or Frobenius norm of its matrix, shape (n,)."""
    return np.sqrt(np.square(rows).reshape(len(rows), -1).sum(axis=1))


Plain = NDArray[np.float64]
Complex = NDArray[np.complex128]
STEP = 1e-30
"""Imaginary step, for derivatives without differences."""


def rows(numbers: Vector) -> Plain:
    """A vector of batches as (count, entries)."""
    return np.stack(np.broadcast_arrays(*numbers), axis=-1)


def blocks(m: Matrix) -> Plain:
    """A matrix of batches as (count, rows, columns)."""
    entries = np.broadcast_arrays(*(entry for row in m for entry in row))
    return np.stack(entries, axis=-1).reshape(-1, len(m.rows), len(m.rows[0].entries))


def size(entries: Plain) -> Plain:
    """Norm over all entries of each closed loop, (count, 1)."""
    return lengths(entries)[:, None]


def limited(entries: Plain, bound: Plain) -> Plain:
    """The vectors scaled down to a length of at most the bound, (count, 1)."""
    shorter = np.minimum(1.0, bound / size(entries))
    return entries * shorter.reshape(len(entries), *[1] * (entries.ndim - 1))


def neurons(input_weights: Matrix, inputs: Plain) -> Plain:
    """mu of a net: sigmoids of weighted inputs and a bias."""
    weights = blocks(input_weights)
    return 1.0 / (1.0 + np.exp(-(np.einsum("bni,bi->bn", weights[:, :, :-1], inputs) + weights[:, :, -1])))


def learnt(weights: Plain, mu: Plain, r: Plain, length: Plain, rate: Plain, kappa: Plain, period: Plain) -> Plain:
    """The weights after a sample of Eq. 54. length, rate, kappa, period: (count, 1)."""
    growth = mu[:, :, None] * r[:, None, :] - (kappa * length)[:, :, None] * weights
    return weights + (period * rate)[:, :, None] * growth


def body_rates(eta: Plain | Complex) -> Complex:
    """T_eta of R = Rz Ry Rx, from the columns of rates about z, then y, then x."""
    theta, phi = eta[:, 1], eta[:, 2]
    zero, one = 0.0 * theta, 1.0 + 0.0 * theta
    by_psi = [-np.sin(theta), np.cos(theta) * np.sin(phi), np.cos(theta) * np.cos(phi)]
    columns = [by_psi, [zero, np.cos(phi), -np.sin(phi)], [one, zero, zero]]
    return np.stack([np.stack(column, axis=-1) for column in columns], axis=-1)


def inertia(eta: Plain | Complex, sigma: Plain) -> Complex:
    """J of Eq. 4."""
    t = body_rates(eta)
    return np.einsum("bki,bk,bkj->bij", t, sigma, t)


def christoffel(eta: Plain, rates: Plain, sigma: Plain) -> Plain:
    """C of Christoffel's symbols, from derivatives of J by an imaginary step."""
    slopes = np.stack([inertia(eta + 1j * STEP * axis, sigma).imag / STEP for axis in np.eye(3)], axis=1)
    first = np.einsum("bkij,bk->bij", slopes, rates)
    second = np.einsum("bjik,bk->bij", slopes, rates)
    return 0.5 * (first + second - second.swapaxes(1, 2))

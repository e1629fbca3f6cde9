"""One block of samples as one linear map with a remainder, and the growth of a box on its way through; enclosed eigenvalues of
a matrix that is known to within a radius: Gershgorin discs in its approximate eigenvectors.

For A within R of M, entry by entry, and M T = T D up to a defect, T^-1 A T = D + T^-1 (A T - T D). The defect is bounded with
the rounding of its own computation (Higham, "Accuracy and Stability of Numerical Algorithms", 2002, section 3.5), T^-1 by an
approximate inverse Y with |I - Y T| < 1 (Rump, "Verification methods", 2010, section 10).

Also the coordinates in which a sampled loop is nearly diagonal: its eigenvectors, those of equal eigenvalues kept apart. No
proof depends on them: any coordinates will do, good ones give larger sets.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadstep.numbers import leaf_names
from quadstep.numbers.affine import HALF_UNIT, UP
from quadstep.numbers.enclosure import Enclosure, UndefinedError
from quadstep.proofs.prove.sampled import Array, SampledLoop
from quadstep.proofs.prove.unknown import (
    CONSTANTS,
    PUSHES,
    BoundedMatrix,
    Image,
    Unknown,
    image,
    seeded,
    sum_rounding,
    with_unknown,
)

SPARE = 6
"""Directions for the nonlinear remainders of functions."""


class Coordinates(NamedTuple):
    """e = spread z, z = into e, exactly: the box is in z. Both (states, states), the position's rows and columns unit."""

    into: Array
    spread: Array


class Block(NamedTuple):
    """Samples `first` to `past` - 1. e_(k+1) = step e_k + pushes w + constants c + d, |w|, |c| <= 1, |d| <= rest."""

    first: int
    past: int
    step: Array
    pushes: Array
    constants: Array
    rest: Array


def block(
    loop: SampledLoop, flown: Array, unknown: Unknown, coordinates: Coordinates, box: Array, first: int, past: int
) -> Block:
    """The block, for all states within `box` (in z) of the flown ones. Raises UndefinedError."""
    count, samples = len(box), past - first
    known = count + PUSHES + CONSTANTS
    width = np.zeros((count, known))
    width[:, :count] = coordinates.spread * box
    numbers = seeded(flown[first:past].T, width, SPARE)
    p = with_unknown(loop.parameters, unknown, count, known + SPARE, samples)
    ticks = np.arange(first, past, dtype=np.float64) * float(loop.span)
    with np.errstate(all="ignore"):
        found = image(loop.step(numbers, ticks, p), known, samples)
    return straightened(found, flown[first + 1 : past + 1].T, coordinates, box, first)


def straightened(image: Image, after: Array, coordinates: Coordinates, box: Array, first: int) -> Block:
    """One linear map for all samples, that of the middle one; the others' differences from it go into the remainder."""
    count, samples = after.shape
    parts, middle = image.parts, samples // 2
    step = (parts[:, :count, middle] / box) @ coordinates.into
    kept = np.concatenate([(step @ coordinates.spread) * box, parts[:, count:, middle]], axis=1)
    rest = image.rest + np.abs(image.centre - after) * UP + np.abs(parts - kept[:, :, None]).sum(axis=1) * UP
    rounded = sum_rounding(count + 2) * (np.abs(step) @ np.abs(coordinates.spread) @ box)
    pushes, constants = kept[:, count : count + PUSHES], kept[:, count + PUSHES :]
    return Block(first, first + samples, step, pushes, constants, (rest.max(axis=1) + rounded) * UP)


def after_each(maps: BoundedMatrix, sources: Array) -> BoundedMatrix:
    """Each of the stacked maps times the sources."""
    size = np.abs(sources)
    off = (sum_rounding(sources.shape[0] + 2) * (np.abs(maps.middle) @ size) + maps.off @ size) * UP
    return BoundedMatrix(maps.middle @ sources, off)


def through(rows: Array, maps: BoundedMatrix) -> Array:
    """Bounds on |rows| of each of the stacked maps."""
    rounded = sum_rounding(rows.shape[1] + 2) * (np.abs(rows) @ np.abs(maps.middle)) + np.abs(rows) @ maps.off
    return (np.abs(rows @ maps.middle) + rounded) * UP


def coordinates(loop: SampledLoop, flown: Array, unknown: Unknown) -> Coordinates:
    """The torque in place of the rates, as far as it is linear in the state half way, so that cancellations in it are seen.

    Used if the inertia, by which the torque is divided, is unknown; else, and if there is no torque that every rate
    affects, the state is used as it is, whose boxes are smaller.
    """
    states = len(loop.places)
    plain = Coordinates(np.eye(states), np.eye(states))
    rates = [i for i, name in enumerate(loop.names) if name.startswith("rates.")]
    torque = [i for i, name in enumerate(leaf_names(loop.like)) if name.startswith("held.torque.")]
    if not unknown.inertia or len(rates) != len(torque) or len(rates) != 3:
        return plain
    sample, small = len(flown) // 2, 1e-9
    leaves: list[Enclosure | float] = [*loop.start]
    for place, number in zip(loop.places, seeded(flown[sample : sample + 1].T, np.eye(states) * small), strict=True):
        leaves[place] = number
    try:
        after = image(loop.run(leaves, np.array([float(sample * loop.span)])), states, 1)
    except UndefinedError:
        return plain
    slopes = after.parts[torque, :, 0] / small
    if abs(np.linalg.det(slopes[:, rates])) < 1e-12 * np.abs(slopes[:, rates]).max() ** 3:
        return plain
    shear = np.linalg.solve(slopes[:, rates], slopes)
    shear[:, rates] = 0.0
    into, spread = np.eye(states), np.eye(states)
    into[rates], spread[rates] = into[rates] + shear, spread[rates] - shear
    return Coordinates(into, spread)


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


COUPLED, EQUAL, ROUNDING = 1e-12, 1e-3, 1e-9
"""Slopes below the first count as zero; eigenvalues nearer to each other than the second's share of their distance from 1
count as equal, and as real where their imaginary part is less than the third's.
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
        parted = np.abs(found.imag) < ROUNDING * np.abs(1.0 - found)  # a real one that stands twice, made a pair by rounding
        vectors = np.where(parted, np.where(found.imag < 0.0, vectors.imag, vectors.real), vectors)
        found = np.where(parted, found.real, found)
        rows = np.linalg.inv(vectors)
        left = [i for i in range(len(group)) if found[i].imag >= 0.0]
        while left:
            same = [
                i
                for i in left
                if abs(found[i] - found[left[0]]) < EQUAL * abs(1.0 - found[i]) and alike(found[i], found[left[0]])
            ]
            left = [i for i in left if i not in same]
            for value, vector in zip(found[same], separated_basis(vectors[:, same], rows[same]).T, strict=True):
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


def separated_basis(vectors: ComplexArray, rows: ComplexArray) -> ComplexArray:
    """Another basis of the span of these eigenvectors, each with zeros where the others are largest.

    Along x and y a vehicle has the same modes; any mixture of two is one too, and a box of mixtures is larger than need be.
    """
    count = vectors.shape[1]
    if count == 1:
        return vectors
    shares, chosen = vectors @ rows, []  # the projection onto the span, whatever basis of it is given
    first = 1.0 - 1e-6 * np.arange(len(shares))  # of equal ones
    for _ in range(count):
        chosen.append(int(np.argmax(np.abs(shares.diagonal()) * first)))
        shares = shares - np.outer(shares[:, chosen[-1]], shares[chosen[-1]]) / shares[chosen[-1], chosen[-1]]
    return vectors @ np.linalg.inv(vectors[chosen])

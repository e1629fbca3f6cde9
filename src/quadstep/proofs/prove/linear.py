"""One block of samples as one linear map with a remainder, and the growth of a box on its way through."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from quadstep.numbers import leaf_names
from quadstep.numbers.affine import UP
from quadstep.numbers.enclosure import Enclosure, UndefinedError
from quadstep.proofs.prove.sampled import Array, Sampled
from quadstep.proofs.prove.unknown import (
    CONSTANTS,
    PUSHES,
    BoundedMatrix,
    Image,
    Unknown,
    image,
    lost,
    powers,
    seeded,
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


def block(loop: Sampled, flown: Array, unknown: Unknown, coordinates: Coordinates, box: Array, first: int, past: int) -> Block:
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


def straightened(found: Image, after: Array, coordinates: Coordinates, box: Array, first: int) -> Block:
    """One linear map for all samples, that of the middle one; the others' differences from it go into the remainder."""
    count, samples = after.shape
    parts, middle = found.parts, samples // 2
    step = (parts[:, :count, middle] / box) @ coordinates.into
    kept = np.concatenate([(step @ coordinates.spread) * box, parts[:, count:, middle]], axis=1)
    rest = found.rest + np.abs(found.centre - after) * UP + np.abs(parts - kept[:, :, None]).sum(axis=1) * UP
    rounded = lost(count + 2) * (np.abs(step) @ np.abs(coordinates.spread) @ box)
    pushes, constants = kept[:, count : count + PUSHES], kept[:, count + PUSHES :]
    return Block(first, first + samples, step, pushes, constants, (rest.max(axis=1) + rounded) * UP)


def ways(one: Block) -> BoundedMatrix:
    """The powers of a block's map, from its start to every later sample: 0 to its number of samples."""
    return powers(BoundedMatrix(one.step, np.zeros_like(one.step)), one.past - one.first)


def after_each(maps: BoundedMatrix, sources: Array) -> BoundedMatrix:
    """Each of the stacked maps times the sources."""
    size = np.abs(sources)
    off = (lost(sources.shape[0] + 2) * (np.abs(maps.middle) @ size) + maps.off @ size) * UP
    return BoundedMatrix(maps.middle @ sources, off)


def through(rows: Array, maps: BoundedMatrix) -> Array:
    """Bounds on |rows| of each of the stacked maps."""
    rounded = lost(rows.shape[1] + 2) * (np.abs(rows) @ np.abs(maps.middle)) + np.abs(rows) @ maps.off
    result: Array = (np.abs(rows @ maps.middle) + rounded) * UP
    return result


def coordinates(loop: Sampled, flown: Array, unknown: Unknown) -> Coordinates:
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

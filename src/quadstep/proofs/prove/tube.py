"""A tube around a flight in which every flight with its unknowns stays, sample by sample.

At a deviation e from the flight, the sampled loop is e' = A e + B w + C c + d, with A and B of a block of samples and |d|
bounded by its enclosure over a box. The later effect of the unknown w of every sample on e is kept as a column each, never
reduced (a zonotope), so that the sums over magnitudes are those of an optimal linear bound; d, of second order, as a box per
block. If the result stays within the box at all samples of a block, the bound holds, by induction from sample to sample.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from quadstep.numbers.affine import UP
from quadstep.numbers.enclosure import UndefinedError
from quadstep.proofs.prove.linear_maps import Block, Coordinates, after_each, block, through
from quadstep.proofs.prove.sampled import Array, SampledLoop
from quadstep.proofs.prove.unknown import (
    CONSTANTS,
    PUSHES,
    STARTS,
    BoundedMatrix,
    Unknown,
    image,
    powers,
    sum_rounding,
    summed,
)

SAMPLES = 25
"""Most samples of a block."""

MEMORY = 4
"""Blocks after which the recent past begins anew: it reaches back by four to eight blocks, until what is fast has decayed."""

STRIDE = 5
"""Samples of a block after which the position is bounded from the whole past again."""

TRIES, LARGER, SLACK, LEAST, MOST = 25, 1.03, 1.002, 1e-12, 1e3


class Tube(NamedTuple):
    """boxes: (blocks, states), half widths in z, valid at every sample of a block. position: (samples + 1, axes) [m], how
    far a flight may be from the one flown.
    """

    boxes: Array
    position: Array


class OpenTube(NamedTuple):
    """A tube that did not close. sample: where; why: in words; boxes, position: up to there."""

    sample: int
    why: str
    boxes: Array
    position: Array


class Past:
    """The effects of the past: columns with their weights; constants have their own columns, whose parts add up.

    size: bounds on |e|, without the constants.
    """

    def __init__(self, columns: Array, weights: Array, constants: Array, capacity: int) -> None:
        states, begun = columns.shape
        self.columns, self.other = np.zeros((2, states, capacity + begun))
        self.weights = np.zeros(capacity + begun)
        self.used = 0
        self.constants = constants
        self.add(columns, weights)
        self.size = self.magnitude()

    def add(self, columns: Array, weights: Array) -> None:
        self.columns[:, self.used : self.used + columns.shape[1]] = columns
        self.weights[self.used : self.used + columns.shape[1]] = weights
        self.used += columns.shape[1]

    def since(self, coordinates: Coordinates, capacity: int) -> Past:
        """The same with everything until now as one box."""
        box = self.moving(coordinates.into)
        return Past(coordinates.spread, box, self.constants, capacity)

    def moving(self, rows: Array) -> Array:
        """Bounds on |rows e| without the constants' part. The identity's rows need no product."""
        found, same = np.zeros(len(rows)), np.all(rows == np.eye(*rows.shape), axis=1)
        same[len(self.columns) :] = False  # a row of zeros is not the identity's
        found[same] = self.size[np.flatnonzero(same)]
        other = rows[~same]
        made = np.abs(other @ self.columns[:, : self.used]) @ self.weights[: self.used]
        found[~same] = (made + sum_rounding(len(self.columns) + 2) * (np.abs(other) @ self.size)) * summed(self.used)
        return found

    def bound(self, rows: Array, also: Array | None = None) -> Array:
        """Bounds on |rows e|. also: the constants' part, (rows, constants)."""
        constants = rows @ self.constants + (0.0 if also is None else also)
        rounded = sum_rounding(2 * len(self.columns)) * (np.abs(rows) @ np.abs(self.constants).sum(axis=1))
        return (self.moving(rows) + np.abs(constants).sum(axis=1) + rounded) * UP

    def magnitude(self) -> Array:
        """Bounds on |e|, without the constants."""
        return np.abs(self.columns[:, : self.used]) @ self.weights[: self.used] * summed(self.used)

    def move(self, one: Block, on: BoundedMatrix, box: Array) -> None:
        """Move to the end of a block, where it has added this box and the rounding here."""
        last = BoundedMatrix(on.middle[-1], on.off[-1])
        size = self.size + np.abs(self.constants).sum(axis=1) * UP
        rounded = (sum_rounding(len(size) + 2) * np.abs(last.middle) + last.off) @ size
        np.matmul(last.middle, self.columns[:, : self.used], out=self.other[:, : self.used])
        self.columns, self.other = self.other, self.columns
        begun = BoundedMatrix(on.middle[:-1], on.off[:-1])
        pushes, constants = after_each(begun, one.pushes), after_each(begun, one.constants)
        self.constants = last.middle @ self.constants + constants.middle.sum(axis=0)
        added = np.abs(constants.middle).sum(axis=(0, 2))
        rounded += (
            pushes.off.sum(axis=(0, 2)) + constants.off.sum(axis=(0, 2)) + sum_rounding(one.past - one.first + 4) * added
        )
        rounded += sum_rounding(4) * np.abs(self.constants).sum(axis=1)
        self.add(pushes.middle.transpose(1, 0, 2).reshape(len(size), -1), np.ones(PUSHES * (one.past - one.first)))
        self.add(np.eye(len(size)), (box + rounded) * UP)
        self.size = self.magnitude()


class BlockBounds(NamedTuple):
    """inside: bounds on z at all samples of a block. position: (samples, axes), after each one. box: what the nonlinear part
    has added to e by the block's end.
    """

    inside: Array
    position: Array
    box: Array


def grown(
    one: Block, on: BoundedMatrix, coordinates: Coordinates, past: Past, recent: Past, start: Array, axes: int
) -> BlockBounds:
    """Bounds on e in a block, given those on z at its start: the least of what follows from the recent past, sharp for what
    is fast; from the sample before, sharp for what is slow; and, of the position, from the whole past at every stride.
    """
    t, v = coordinates
    count = len(t)
    begun = BoundedMatrix(on.middle[:-1], on.off[:-1])
    pushes, constants = after_each(begun, one.pushes), after_each(begun, one.constants)
    summed = np.concatenate([np.zeros((1, *one.constants.shape)), np.cumsum(constants.middle, axis=0)])
    rounded = constants.off.sum(axis=2) + sum_rounding(len(begun.middle) + 4) * np.abs(constants.middle).sum(axis=2)
    added = through(t, pushes).sum(axis=2) + through(t, begun) @ one.rest + rounded @ np.abs(t).T
    local = np.concatenate([np.zeros((1, count)), np.cumsum(added, axis=0)])
    size = past.size + np.abs(past.constants).sum(axis=1)
    local += (sum_rounding(count + 2) * (np.abs(t) @ np.abs(on.middle)) + np.abs(t) @ on.off) @ size

    rows, parts = t @ on.middle, t @ summed
    found = recent.bound(rows.reshape(-1, count), parts.reshape(-1, CONSTANTS)).reshape(local.shape) + local
    found[0] = np.minimum(found[0], start)
    some = np.s_[STRIDE::STRIDE, :axes]
    whole = past.bound(rows[some].reshape(-1, count), parts[some].reshape(-1, CONSTANTS))
    found[some] = np.minimum(found[some], whole.reshape(-1, axes) + local[some])
    carry = through(t, after_each(BoundedMatrix(on.middle[1], on.off[1]), v))
    more = added[0] + np.abs(t) @ np.abs(one.constants).sum(axis=1)
    for sample in range(len(added)):
        found[sample + 1] = np.minimum(found[sample + 1], (carry @ found[sample] + more) * UP)
    box = through(np.eye(count), begun).sum(axis=0) @ one.rest * UP
    return BlockBounds(found.max(axis=0) * UP, found[1:, :axes] * UP, box)


def beginning(loop: SampledLoop, unknown: Unknown) -> tuple[Array, Array]:
    """The deviations of all starts: columns, each between its negative and itself, and their weights.

    Raises UserError, UndefinedError.
    """
    found, count = image(loop.starts(unknown), STARTS, 1), len(loop.places)
    off = (found.rest + np.abs(found.centre - np.array(loop.at_rest(loop.like))[:, None]) * UP)[:, 0]
    return np.hstack([found.parts[:, :, 0], np.eye(count)]), np.concatenate([np.ones(STARTS), off])


def tube(
    loop: SampledLoop, flown: Array, unknown: Unknown, coordinates: Coordinates, axes: int,
    progress: Callable[[int], None] = lambda _: None,
) -> Tube | OpenTube:  # fmt: skip
    """The tube of a flight. flown: its states before every sample, (samples + 1, states). axes: of the position."""
    count, samples = flown.shape[1], len(flown) - 1
    blocks = -(-samples // SAMPLES)
    each = SAMPLES * PUSHES + count
    past = Past(*beginning(loop, unknown), np.zeros((count, CONSTANTS)), blocks * each)
    recent = later = past
    boxes, position = np.zeros((blocks, count)), np.zeros((samples + 1, axes))
    position[0] = past.size[:axes]
    box = np.maximum(past.bound(coordinates.into) * 1.5, 1e-9)
    for place in range(blocks):
        if place % MEMORY == 0:
            recent, later = later, past.since(coordinates, 2 * MEMORY * each)
        first, last, begun = place * SAMPLES, min((place + 1) * SAMPLES, samples), past.bound(coordinates.into)
        for _ in range(TRIES):
            try:
                one = block(loop, flown, unknown, coordinates, box, first, last)
            except UndefinedError as error:
                return OpenTube(first, str(error), boxes[:place], position[: first + 1])
            on = powers(BoundedMatrix(one.step, np.zeros_like(one.step)), one.past - one.first)  # to every later sample
            found = grown(one, on, coordinates, past, recent, begun, axes)
            if np.all(found.inside * SLACK <= box):
                break
            if not np.all(found.inside < MOST):
                return OpenTube(
                    first,
                    f"{loop.in_words(loop.names[int(np.argmax(found.inside))])} grew without bound",
                    boxes[:place],
                    position[: first + 1],
                )
            box = np.maximum(box, found.inside * LARGER)
        else:
            widest = loop.in_words(loop.names[int(np.argmax(found.inside / box))])
            return OpenTube(first, f"the bound of {widest} kept growing", boxes[:place], position[: first + 1])
        for one_past in dict.fromkeys((past, recent, later)):
            one_past.move(one, on, found.box)
        boxes[place], position[first + 1 : last + 1] = box, found.position
        box = np.maximum(found.inside * LARGER, LEAST)
        progress(last - first)
    return Tube(boxes, position)

"""A tube around a flight in which every flight with its unknowns stays, sample by sample.

At a deviation e from the flight, the sampled loop is e' = A e + B w + C c + d, with A and B of a block of samples and |d|
bounded by its enclosure over a box. The later effect of the unknown w of every sample on e is kept as a column each, never
reduced (a zonotope), so that the sums over magnitudes are those of an optimal linear bound; d, of second order, as a box per
stride. If the result stays within the box at all samples of a block, the bound holds, by induction from sample to sample.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from quadstep.numbers.enclosure import UndefinedError
from quadstep.prove.linear import STRIDE, Block, Coordinates, Way, after_each, block, through, way
from quadstep.prove.products import UP, Known, lost
from quadstep.prove.sampled import Array, Sampled
from quadstep.prove.unknown import CONSTANTS, PUSHES, Unknown

SAMPLES = 10 * STRIDE
"""Most samples of a block."""

TRIES, LARGER, SLACK, LEAST, MOST = 25, 1.03, 1.002, 1e-12, 1e3


class Tube(NamedTuple):
    """boxes: (blocks, states), half widths in z, valid at every sample of a block. position: (samples + 1, axes) [m], how
    far a flight may be from the one flown.
    """

    boxes: Array
    position: Array


class Open(NamedTuple):
    """A tube that did not close. sample: where; why: in words; boxes, position: up to there."""

    sample: int
    why: str
    boxes: Array
    position: Array


class Past:
    """The effects of the past: columns with their weights; constants have their own columns, whose parts add up."""

    def __init__(self, start: Array, capacity: int) -> None:
        states = len(start)
        self.columns, self.other = np.zeros((2, states, capacity + states))
        self.weights = np.zeros(capacity + states)
        self.used = 0
        self.constants = np.zeros((states, CONSTANTS))
        self.add(np.eye(states)[:, start > 0.0], start[start > 0.0])

    def add(self, columns: Array, weights: Array) -> None:
        """Add columns."""
        self.columns[:, self.used : self.used + columns.shape[1]] = columns
        self.weights[self.used : self.used + columns.shape[1]] = weights
        self.used += columns.shape[1]

    def bound(self, rows: Array, also: Array | None = None) -> Array:
        """Bounds on |rows e|. also: the constants' part, (rows, constants)."""
        made = np.abs(rows @ self.columns[:, : self.used]) @ self.weights[: self.used]
        constants = rows @ self.constants + (0.0 if also is None else also)
        rounded = lost(2 * len(self.constants)) * (np.abs(rows) @ (self.size + np.abs(self.constants).sum(axis=1)))
        result: Array = (made + np.abs(constants).sum(axis=1) + rounded) * UP
        return result

    @property
    def size(self) -> Array:
        """Bounds on |e|, without the constants."""
        result: Array = np.abs(self.columns[:, : self.used]) @ self.weights[: self.used] * UP
        return result

    def move(self, one: Block, on: Way, strides: Array) -> None:
        """Move to the end of a block. strides: the box that each stride adds at its end. Rounding is one more such box."""
        last = Known(on.far.middle[-1], on.far.off[-1])
        size = self.size + np.abs(self.constants).sum(axis=1) * UP
        rounded = (lost(len(size) + 2) * np.abs(last.middle) + last.off) @ size
        np.matmul(last.middle, self.columns[:, : self.used], out=self.other[:, : self.used])
        self.columns, self.other = self.other, self.columns
        pushes, constants = pushed(one, on)
        self.constants = last.middle @ self.constants + constants.middle.sum(axis=(0, 1))
        added = np.abs(constants.middle).sum(axis=(0, 1)).sum(axis=1)
        rounded += pushes.off.sum(axis=(0, 1, 3)) + constants.off.sum(axis=(0, 1, 3)) + lost(one.past - one.first + 4) * added
        rounded += lost(4) * np.abs(self.constants).sum(axis=1)
        self.add(pushes.middle.transpose(2, 0, 1, 3).reshape(len(size), -1), np.ones(PUSHES * (one.past - one.first)))
        boxes = on.far.middle[:-1]
        rounded += (on.far.off[:-1] @ strides).sum(axis=0)
        self.add(boxes.transpose(1, 0, 2).reshape(len(size), -1), np.tile(strides, len(boxes)))
        self.weights[self.used - boxes.shape[0] * len(size) : self.used - (boxes.shape[0] - 1) * len(size)] += rounded * UP


def pushed(one: Block, on: Way) -> tuple[Known, Known]:
    """The effects of every sample's pushes and constants at the block's end, (strides, samples, states, directions)."""
    near = Known(on.near.middle[:-1], on.near.off[:-1])
    made = []
    for sources in (one.pushes, one.constants):
        local = after_each(near, sources)  # (samples, states, directions)
        far = Known(on.far.middle[:-1, None], on.far.off[:-1, None])
        made.append(far.times(Known(local.middle[None], local.off[None])))
    return made[0], made[1]


class Grown(NamedTuple):
    """inside: bounds on z at all samples of a block. position: (samples, axes), after each one. strides: see `Past.move`."""

    inside: Array
    position: Array
    strides: Array


def grown(one: Block, on: Way, into: Coordinates, past: Past, axes: int, dense: bool) -> Grown:
    """Bounds on e in a block."""
    t, v = into
    near, far = on.near, on.far
    box_near = through(t, near)  # (STRIDE + 1, states, states)
    carry = through(t, after_each(near, v))
    push = through(t, after_each(near, one.pushes)).sum(axis=2)
    const_size = through(t, after_each(near, one.constants)).sum(axis=2)
    left = box_near @ one.rest
    local = np.concatenate([np.zeros((1, len(t))), np.cumsum((push + const_size + left)[:-1], axis=0)])  # by this many samples
    strides = through(np.eye(len(t)), Known(near.middle[:-1], near.off[:-1])).sum(axis=0) @ one.rest * UP

    start, size = past.bound(t), past.size + np.abs(past.constants).sum(axis=1)
    rows = len(t) if dense else axes
    position, inside = np.empty((one.past - one.first, axes)), start
    far_carry = through(t, after_each(far, v))
    pushes, constants = pushed(one, on)
    far_push = (np.abs(t @ pushes.middle) + np.abs(t) @ pushes.off).sum(axis=(1, 3)) * (1.0 + 1e-11)
    far_box = through(t, Known(far.middle[:-1], far.off[:-1])) @ strides
    summed = np.cumsum(constants.middle.sum(axis=1), axis=0)
    for stride in range(on.strides):
        if stride:
            more = far_push[:stride].sum(axis=0) + far_box[:stride].sum(axis=0)
            parts = t @ summed[stride - 1]
            now = (far_carry[stride] @ start + more + np.abs(parts).sum(axis=1)) * (1.0 + 1e-11)
            direct = past.bound((t @ far.middle[stride])[:rows], parts[:rows]) + more[:rows]
            direct = direct + (np.abs(t) @ far.off[stride] @ size)[:rows]
            now[:rows] = np.minimum(now[:rows], direct * (1.0 + 1e-11))
        else:
            now = start
        reached = carry @ now + local  # (STRIDE + 1, states)
        inside = np.maximum(inside, reached.max(axis=0))
        position[stride * STRIDE : (stride + 1) * STRIDE] = reached[1:, :axes]
    return Grown(inside * UP, position * UP, strides)


def tube(
    loop: Sampled,
    flown: Array,
    unknown: Unknown,
    coordinates: Coordinates,
    axes: int,
    dense: int = 0,
    progress: Callable[[int], None] = lambda _: None,
) -> Tube | Open:
    """The tube of a flight. flown: its states before every sample, (samples + 1, states). axes: of the position.

    dense: number of blocks in which every number is bounded at every stride, not only the position; it takes time.
    """
    count, samples = flown.shape[1], len(flown) - 1
    start = np.zeros(count)
    start[:axes] = unknown.start
    blocks = -(-samples // SAMPLES)
    past = Past(start, blocks * (SAMPLES * PUSHES + SAMPLES // STRIDE * count))
    boxes, position = np.zeros((blocks, count)), np.zeros((samples + 1, axes))
    position[0] = start[:axes]
    box = np.maximum(past.bound(coordinates.into) * 1.5, 1e-9)
    for place in range(blocks):
        first, last = place * SAMPLES, min((place + 1) * SAMPLES, samples)
        for _ in range(TRIES):
            try:
                one = block(loop, flown, unknown, coordinates, box, first, last)
            except UndefinedError as error:
                return Open(first, str(error), boxes[:place], position[: first + 1])
            on = way(one)
            found = grown(one, on, coordinates, past, axes, place < dense)
            if np.all(found.inside * SLACK <= box):
                break
            if not np.all(found.inside < MOST):
                return Open(
                    first,
                    f"{loop.names[int(np.argmax(found.inside))]} grew without bound",
                    boxes[:place],
                    position[: first + 1],
                )
            box = np.maximum(box, found.inside * LARGER)
        else:
            widest = int(np.argmax(found.inside / box))
            return Open(first, f"the bound of {loop.names[widest]} kept growing", boxes[:place], position[: first + 1])
        past.move(one, on, found.strides)
        boxes[place], position[first + 1 : last + 1] = box, found.position
        box = np.maximum(found.inside * LARGER, LEAST)
        progress(last - first)
    return Tube(boxes, position)

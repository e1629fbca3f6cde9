"""The check's own arithmetic: quantities as rows of numbers that go back from block to block, each adding what it may."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from quadstep.numbers.enclosure import Array
from quadstep.proofs.prove.check_loop import CONSTANTS, UP

STRIDE, MEMORY = 5, 4
"""Samples between those at which the position is bounded from the start; blocks that the recent past consists of, at least."""


def rounding(count: int) -> float:
    """The most that a sum of `count` products loses by rounding, relative to the sum of their magnitudes."""
    return (count + 2) * 2.0**-52


class Passage(NamedTuple):
    """A sample, a whole block, or other coordinates: e' = whole e + pushes u + steady c + d, |u|, |c| <= 1, |d| <= box."""

    whole: Array
    pushes: Array
    steady: Array
    box: Array


def passage(whole: Array, pushes: Array, steady: Array, box: Array, reach: Array) -> Passage:
    """What rounds in a product with it, at |e| <= reach, is in its box."""
    size = np.abs(whole) @ reach + np.abs(pushes).sum(axis=1) + np.abs(steady).sum(axis=1)
    return Passage(whole, pushes, steady, (box + 3.0 * rounding(len(box)) * size) * UP)


class BackwardRows(NamedTuple):
    """Quantities c e + s c' + u + d: rows c, constants' part s, and bounds on |u|, the sum of the pushes, and on |d|."""

    rows: Array
    steady: Array
    pushed: Array
    rest: Array

    def before(self, one: Passage) -> BackwardRows:
        """The same by the state a passage earlier."""
        steady = self.steady + self.rows @ one.steady
        rest = self.rest + np.abs(self.rows) @ one.box + 2.0**-52 * np.abs(steady).sum(axis=1)
        pushed = self.pushed + np.abs(self.rows @ one.pushes).sum(axis=1)
        return BackwardRows(self.rows @ one.whole, steady, pushed * UP, rest * UP)

    def within(self, sums: Array) -> Array:
        """Bounds of what is not constant, for |e| <= sums."""
        result: Array = (np.abs(self.rows) @ sums + self.pushed + self.rest) * UP
        return result

    def at(self, places: list[int]) -> BackwardRows:
        """Some of them."""
        return BackwardRows(*(part[places] for part in self))


def joined(parts: list[BackwardRows]) -> BackwardRows:
    """All of them."""
    return BackwardRows(*map(np.concatenate, zip(*parts, strict=True)))


class CheckedBlock(NamedTuple):
    """A block of samples. inside: z at all of them, sample by sample, by e at its start; whole: from there to its end;
    out: from z, within its box, to e.
    """

    inside: BackwardRows
    whole: Passage
    out: Passage


def block(once: Passage, samples: int, box: Array, into: Array, spread: Array) -> CheckedBlock:
    """The block that repeats a sample, with z = into e, |z| <= box at each."""
    n, none = len(box), np.zeros((len(box), CONSTANTS))
    reach, nothing = np.abs(spread) @ box, np.zeros(n)
    seen, now, pushes = [BackwardRows(into, none, nothing, nothing)], BackwardRows(np.eye(n), none, nothing, nothing), []
    for _ in range(samples):
        pushes.append(now.rows @ once.pushes)
        now = now.before(once)
        seen.append(seen[-1].before(once))
    whole = passage(now.rows, np.concatenate(pushes, axis=1), now.steady, now.rest, reach)
    return CheckedBlock(joined(seen), whole, passage(spread, np.zeros((n, 0)), none, nothing, box))


def spots(one: CheckedBlock, axes: int) -> list[int]:
    """Places of z at a block's start, and of the position at every stride, among its rows."""
    n = len(one.out.box)
    strides = range(STRIDE * n, len(one.inside.rest), STRIDE * n)
    return [*range(n), *(first + axis for first in strides for axis in range(axes))]


def from_the_start(blocks: list[CheckedBlock], start: Passage, axes: int) -> list[tuple[Array, Array]]:
    """Of every block's spots: parts s of the constants, and bounds of all else, from the sum over all samples before."""
    found = blocks[-1].inside.at(spots(blocks[-1], axes))
    for one in blocks[-2::-1]:
        found = joined([one.inside.at(spots(one, axes)), found.before(one.whole)])
    ends = np.cumsum([len(spots(one, axes)) for one in blocks])[:-1]
    bounds = found.before(start).within(np.zeros(len(start.box)))
    return list(zip(np.split(found.steady, ends), np.split(bounds, ends), strict=True))


def grown(blocks: list[CheckedBlock], start: Passage, place: int, known: list[tuple[Array, Array]], axes: int) -> Array:
    """Bounds of z at every sample of a block, (samples + 1, states): the least of those from a box some blocks earlier (the
    starts themselves at first), sharp for what is fast, those from the start, and those from the sample before, sharp for
    what is slow.
    """
    one, far = blocks[place], MEMORY * max(0, place // MEMORY - 1)
    n, here = len(one.out.box), spots(one, axes)
    recent = one.inside
    for earlier in reversed(blocks[far:place]):
        recent = recent.before(earlier.whole)
    recent = recent.before(blocks[far].out if far else start)
    once = one.inside.at(list(range(n, 2 * n))).before(one.out)
    (steady, sums), (steady_here, sums_here) = known[far], known[place]
    if not far:
        steady, sums = np.zeros_like(steady), np.zeros_like(sums)
    rounded = rounding(n) * (np.abs(recent.rows) @ np.abs(steady[:n]).sum(axis=1))
    found: Array = recent.within(sums[:n]) + np.abs(recent.rows @ steady[:n] + recent.steady).sum(axis=1) + rounded
    found[here] = np.minimum(found[here], np.abs(steady_here).sum(axis=1) + sums_here)
    found = found.reshape(-1, n) * UP
    for sample in range(len(found) - 1):
        found[sample + 1] = np.minimum(found[sample + 1], once.within(found[sample]) + np.abs(once.steady).sum(axis=1) * UP)
    return found

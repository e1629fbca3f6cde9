"""The check's own arithmetic: quantities as rows of numbers that go back from block to block, each adding what it may."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from quadstep.numbers.enclosure import Array

UP = 1.0 + 1e-11
"""More than what sums of some thousand positive numbers lose by rounding."""

STRIDE, MEMORY = 5, 4
"""Samples between those at which the position is bounded from the start; blocks that the recent past consists of, at least."""

PUSHES, CONSTANTS = 6, 4


def rounding(count: int) -> float:
    """The most that a sum of `count` products loses by rounding, relative to the sum of their magnitudes."""
    return (count + 2) * 2.0**-52


class Stretch(NamedTuple):
    """Samples of a block: e' = step e + inputs u + d, |u| <= 1 (pushes first, then constants), |d| <= rest of each sample.

    reach: bounds on |e| in the block.
    """

    step: Array
    inputs: Array
    rest: Array
    reach: Array


class Passage(NamedTuple):
    """A whole block, from its start to its end: e' = whole e + pushes u + steady c + d, |u|, |c| <= 1, |d| <= box."""

    whole: Array
    pushes: Array
    steady: Array
    box: Array


def passage(one: Stretch) -> Passage:
    """A block as one passage; rounding is in its box."""
    n = len(one.step)
    back, off = np.eye(n), np.zeros((n, n))
    pushes, steady, box = [], np.zeros((n, CONSTANTS)), np.zeros(n)
    for rest in one.rest[::-1]:
        made = back @ one.inputs
        pushes.append(made[:, :PUSHES])
        steady = steady + made[:, PUSHES:]
        box += np.abs(back) @ rest + off @ rest
        box += (off + 3.0 * rounding(n) * np.abs(back)) @ np.abs(one.inputs).sum(axis=1)
        box += 2.0**-52 * np.abs(steady).sum(axis=1)
        off = (off @ np.abs(one.step) + rounding(n) * (np.abs(back) @ np.abs(one.step))) * UP
        back = back @ one.step
    box += (off + 3.0 * rounding(n) * np.abs(back)) @ one.reach
    return Passage(back, np.concatenate(pushes, axis=1), steady, box * UP)


class Rows(NamedTuple):
    """Quantities c e + s c' + u: rows c, constants' part s, and bounds on the sum u."""

    rows: Array
    steady: Array
    sums: Array

    def before(self, one: Passage) -> Rows:
        """The same by the state a block earlier."""
        sums = np.abs(self.rows @ one.pushes).sum(axis=1) + np.abs(self.rows) @ one.box
        steady = self.steady + self.rows @ one.steady
        added = np.abs(one.pushes).sum(axis=1) + np.abs(one.steady).sum(axis=1)
        rounded = 2.0**-52 * np.abs(steady).sum(axis=1) + rounding(len(one.box)) * (np.abs(self.rows) @ added)
        return Rows(self.rows @ one.whole, steady, (self.sums + sums + rounded) * UP)


class Summed(NamedTuple):
    """Quantities at the start of a block as sums over all samples before it: s c + u, s steady, |u| <= sums."""

    steady: Array
    sums: Array


class Inner(NamedTuple):
    """Bounds of z at every sample of a block (samples + 1, ...): rows of the state at its start, steady, local, as in `Rows`;
    step: (states, states), by the sample before, with more.
    """

    rows: Array
    steady: Array
    local: Array
    step: Array
    more: Array


def inner(one: Stretch, into: Array, spread: Array) -> Inner:
    """A block from inside."""
    n, size, rest = len(into), np.abs(into), one.rest.max(axis=0)
    power, off, sums, steady = np.eye(n), np.zeros((n, n)), np.zeros(n), np.zeros((n, CONSTANTS))
    rows, parts, local = [], [], []
    inputs = np.abs(one.inputs).sum(axis=1)
    for _ in range(len(one.rest) + 1):
        astray = size @ (off + 3.0 * rounding(n) * np.abs(power))
        rows.append(into @ power)
        parts.append(into @ steady)
        local.append(sums + astray @ one.reach)
        made = power @ one.inputs
        sums = sums + np.abs(into @ made[:, :PUSHES]).sum(axis=1) + astray @ inputs
        sums = sums + (np.abs(into @ power) + astray) @ rest
        steady = steady + made[:, PUSHES:]
        sums = sums + 2.0**-52 * (size @ np.abs(steady).sum(axis=1))
        off = (off @ np.abs(one.step) + rounding(n) * (np.abs(power) @ np.abs(one.step))) * UP
        power = power @ one.step
    step = np.abs(into @ one.step @ spread) + 3.0 * rounding(n) * (size @ np.abs(one.step) @ np.abs(spread))
    more = np.abs(into @ one.inputs).sum(axis=1) + rounding(n) * (size @ inputs) + size @ rest
    return Inner(np.array(rows), np.array(parts), np.array(local), step, more * UP)


def from_the_start(blocks: list[Passage], inside: list[Inner], into: Array, start: Array, axes: int) -> list[Summed]:
    """At the start of every block: z, and after it what every stride of the block makes of it in the position."""
    n, fixed = len(into), [np.concatenate([into, *one.rows[STRIDE::STRIDE, :axes]]) for one in inside]
    parts = [np.concatenate([np.zeros((n, CONSTANTS)), *one.steady[STRIDE::STRIDE, :axes]]) for one in inside]
    counts = np.array([len(one) for one in fixed])
    last = int(counts.sum())
    rows, steady, sums = np.zeros((last, n)), np.zeros((last, CONSTANTS)), np.zeros(last)
    first = last
    for place in range(len(blocks), 0, -1):
        first -= int(counts[place - 1])
        now = slice(first, first + int(counts[place - 1]))
        rows[now], steady[now] = fixed[place - 1], parts[place - 1]
        if place > 1:
            earlier = Rows(rows[first:], steady[first:], sums[first:]).before(blocks[place - 2])
            rows[first:], steady[first:], sums[first:] = earlier
    sums = (sums + np.abs(rows) @ start) * UP
    ends = np.cumsum(counts)
    return [Summed(steady[e - c : e], sums[e - c : e]) for c, e in zip(counts, ends, strict=True)]


def grown(place: int, blocks: list[Passage], one: Inner, known: list[Summed], spread: Array, axes: int) -> Array:
    """Bounds of z at every sample of a block, (samples + 1, states)."""
    n, samples = len(spread), len(one.rows)
    far = MEMORY * max(0, place // MEMORY - 1)
    recent = Rows(one.rows.reshape(-1, n), one.steady.reshape(-1, CONSTANTS), one.local.ravel())
    for earlier in range(place - 1, far - 1, -1):
        recent = recent.before(blocks[earlier])
    back = recent.rows @ spread
    constants = back @ known[far].steady[:n] + recent.steady
    size = np.abs(recent.rows) @ np.abs(spread)
    loose = 3.0 * rounding(n) * (size @ (known[far].sums[:n] + np.abs(known[far].steady[:n]).sum(axis=1)))
    found = np.abs(back) @ known[far].sums[:n] + np.abs(constants).sum(axis=1) + recent.sums + loose
    found = (found * UP).reshape(samples, n)
    whole = (known[place].sums + np.abs(known[place].steady).sum(axis=1)) * UP
    found[0] = np.minimum(found[0], whole[:n])
    strides = whole[n:].reshape(-1, axes) + one.local[STRIDE::STRIDE, :axes]
    found[STRIDE::STRIDE, :axes] = np.minimum(found[STRIDE::STRIDE, :axes], strides)
    for sample in range(samples - 1):
        found[sample + 1] = np.minimum(found[sample + 1], (one.step @ found[sample] + one.more) * UP)
    result: Array = found * UP
    return result

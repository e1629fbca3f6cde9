"""An independent check of a certificate: it shares the laws and the enclosure arithmetic with the prover, nothing else.

The prover propagates the effect of every sample forwards; here each bound is computed backwards from its end: a row c of the
quantity goes back by c A from block to block, and the sum of |c| times each block's addition is the bound. Rounding of c A
counts as an addition too. The centre line need not be trusted: its defect from sample to sample is counted.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple, cast

import numpy as np

from quadstep.io.documents import parse_toml
from quadstep.io.errors import UserError
from quadstep.mission.read import check_mission, plan_mission
from quadstep.numbers import Number
from quadstep.numbers.affine import UP
from quadstep.numbers.enclosure import Array, Enclosure, Fresh, UndefinedError
from quadstep.proofs.prove.certificate_file import Certificate, off_path, read_certificate
from quadstep.proofs.prove.check_loop import CONSTANTS, PUSHES, STARTS, CheckedLoop, all_finite, number, pushed
from quadstep.proofs.prove.unknown import Unknown

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
        return (np.abs(self.rows) @ sums + self.pushed + self.rest) * UP

    def at(self, places: list[int]) -> BackwardRows:
        return BackwardRows(*(part[places] for part in self))


def joined(parts: list[BackwardRows]) -> BackwardRows:
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


class CheckResult(NamedTuple):
    """failed: what does not hold, empty if everything does. position: bound of each axis [m]; off_path: from the path [m]."""

    name: str
    axes: tuple[str, ...]
    unknown: Unknown
    failed: str
    position: Array
    off_path: Array
    seconds: float


def over_its_box(loop: CheckedLoop, proof: Certificate, place: int) -> CheckedBlock:
    """A block, over its box of z, e = spread z. Raises UndefinedError, UserError."""
    n, box, known = len(proof.states), proof.boxes[place], len(proof.states) + PUSHES + CONSTANTS
    begin, end = place * proof.block, min((place + 1) * proof.block, len(proof.flown) - 1)
    samples, total = end - begin, known + 6
    width, fresh = proof.spread * box, Fresh(known, total)
    x = [number(proof.flown[begin:end, i].copy(), width[i], total, fresh) for i in range(n)]
    p = pushed(loop.plan.parameters, proof.unknown, n, total, samples)
    after = loop.after(x, np.arange(begin, end, dtype=np.float64) * float(loop.span), p)
    linear, rest = np.zeros((samples, n, total)), np.zeros((samples, n))
    for i, one in enumerate(after):
        if not isinstance(one, Enclosure) or one.parts is None:
            raise UserError(f"the loop does not return {proof.states[i]} as a state")
        linear[:, i] = one.parts.T
        rest[:, i] = one.rest + np.abs(one.centre - proof.flown[begin + 1 : end + 1, i]) * UP
    into = 2.0 * np.eye(n) - proof.spread  # its inverse, as it is a shear
    middle, reach = linear[samples // 2, :, :known], np.abs(proof.spread) @ box
    step = (middle[:, :n] / np.where(box > 0.0, box, 1.0)) @ into
    kept = np.concatenate([(step @ proof.spread) * box, middle[:, n:]], axis=1)
    rest += np.abs(linear[:, :, :known] - kept).sum(axis=2) + np.abs(linear[:, :, known:]).sum(axis=2)
    rest += 3.0 * rounding(n) * (np.abs(step) @ (np.abs(into) @ reach + reach))  # `kept`
    all_finite(linear, rest, step, kept)
    once = passage(step, kept[:, n : n + PUSHES], kept[:, n + PUSHES :], rest.max(axis=0) * UP, reach)
    return block(once, samples, box, into, proof.spread)


def beginning(loop: CheckedLoop, flown: Array) -> Passage:
    """All starts, off the flown one."""
    n = len(flown)
    columns, rest = np.zeros((n, STARTS)), np.zeros(n)
    for i, place in enumerate(loop.places):
        one = loop.begun[place]
        if isinstance(one, Enclosure):
            rest[i] = one.rest[0] + abs(one.centre[0] - flown[i]) * UP
            columns[i] = 0.0 if one.parts is None else one.parts[:, 0]
        elif one != flown[i]:
            rest[i] = np.inf
    return passage(np.zeros((n, n)), columns, np.zeros((n, CONSTANTS)), rest, np.zeros(n))


def failing(loop: CheckedLoop, proof: Certificate) -> str:
    """What is not shown, in words; empty if everything is. Raises UserError."""
    axes, seconds = len(proof.position), loop.span * loop.plan.ticks.step
    blocks, most = [], np.zeros(axes)
    for place in range(len(proof.boxes)):
        try:
            blocks.append(over_its_box(loop, proof, place))
        except UndefinedError as error:
            return f"at {place * proof.block * seconds:g} s: {error}"
    start = beginning(loop, proof.flown[0])
    known = from_the_start(blocks, start, axes)
    for place, box in enumerate(proof.boxes):
        inside = grown(blocks, start, place, known, axes)
        kept = inside.max(axis=0) <= box  # false for NaN
        if not np.all(kept):
            name = proof.states[int(np.argmin(kept))]
            return f"at {place * proof.block * seconds:g} s: {name} is not shown to stay in its box"
        most = np.maximum(most, inside[:, :axes].max(axis=0))
    if not np.all(most <= proof.position):
        return f"the position is shown to stay within {1e3 * most.max():.6g} mm, not within the bound that the file claims"
    return ""


def refuse_unfit(loop: CheckedLoop, proof: Certificate) -> None:
    """Raises UserError for a certificate that is not one of its mission's flight."""
    n, axes = len(proof.states), len(loop.plan.loop.plant.axes)
    shear = proof.spread - np.eye(n)
    moved, used = np.any(shear != 0.0, axis=1), np.any(shear != 0.0, axis=0)
    if np.any(moved & used) or np.any(moved[:axes]) or proof.states[:axes] != tuple(f"position.{i}" for i in range(axes)):
        raise UserError("its coordinates are not a shear that keeps the position")
    if (len(proof.flown) - 1) * loop.span != loop.plan.ticks.last // loop.span * loop.span or len(proof.position) != axes:
        raise UserError("its samples do not match its mission")
    if not np.array_equal(proof.flown[0], [loop.start[place] for place in loop.places]):
        raise UserError("its flight does not start where its mission does")


def check_certificate(path: Path) -> CheckResult:
    """Whether the claim of the certificate in `path` holds. Raises UserError if it contains nothing that can be checked."""
    found = read_certificate(path)
    folder = path.parent / found.folder
    mission = check_mission(parse_toml(found.mission, str(path)), str(path), folder)
    plan = plan_mission(mission, path, folder)
    try:
        loop = CheckedLoop(plan, found.states, found.unknown)
        refuse_unfit(loop, found)
        with np.errstate(all="ignore"):  # what is not finite fails
            failed = failing(loop, found)
    except (UserError, UndefinedError) as error:
        raise UserError(f"{path}: {error}") from None
    time, axes = np.arange(len(found.flown)) * float(loop.span) * plan.ticks.step, tuple(plan.loop.plant.axes)
    wanted = plan.loop.path.reference(cast(Number, time), plan.parameters.path).position
    off = np.stack([np.abs(found.flown[:, i] - wanted["xyz".index(axis)]) for i, axis in enumerate(axes)], axis=1)
    away = off_path(off, found.block, found.boxes, found.position)
    return CheckResult(mission.name, axes, found.unknown, failed, found.position, away, float(time[-1]))

"""Search for the closed loops that come nearest to violating a statement: random ones, and a search from the best of them.

A bound is tight where some closed loop comes near it, so each term of a bound is tested where the others leave it the
least room. Every statement must hold there, and must fail if a term is made a tenth smaller.
"""

from typing import NamedTuple

import numpy as np

from quadstep.proofs.theory.inequalities import STATEMENTS, Sides, Statement
from quadstep.proofs.theory.samples import DIMENSIONS, Cube, draw_sample, sample_at

CHUNK = 50_000
ROUND_OFF = 1e-9
"""Relative margin that rounding may cost."""

LANES, STEPS, ENOUGH = 24, 400, 0.95
"""Of a search: closed loops per term, the largest number of steps, and the share of every term that ends it."""

FACTOR = 0.9
"""A statement must fail once a term of its bound is scaled by this."""


class StatementMargin(NamedTuple):
    """A statement: its number in docs/theory.md, its text, its worst relative margin (negative: violated), samples.

    reached: for each term of its bound, the share of it that some closed loop uses up; of an equation, 1 where it is not zero.
    """

    number: str
    statement: str
    worst: float
    samples: int
    reached: dict[str, float]

    @property
    def holds(self) -> bool:
        """Whether it held on every sample, up to round-off."""
        return self.worst >= -ROUND_OFF

    @property
    def bites(self) -> bool:
        """Whether it fails when any term of the bound is made a tenth smaller."""
        return all(share > FACTOR for share in self.reached.values())


class StatementRecord:
    """Results for a statement so far: the worst margin, and the share of each term that was used up."""

    def __init__(self) -> None:
        self.worst, self.reached = np.inf, dict[str, float]()

    def look(self, sides: list[Sides]) -> list[Cube]:
        """Add a batch. Returns, for each term of an inequality, how much of it is left, one number per closed loop."""
        left = []
        for part, side in enumerate(sides):
            size = np.maximum(side.size, 1e-300)
            self.worst = float(np.minimum(self.worst, np.min(side.slack / size)))  # no number where one is none
            for name, term in side.terms.items():
                counts = np.abs(term) > 1e-6 * size
                spare = np.where(counts, side.slack / np.maximum(np.abs(term), 1e-300), np.inf)
                key = name if part == 0 else f"{name} ({part + 1})"
                found = float(np.any(counts)) if side.equal else 1.0 - float(np.min(np.broadcast_to(spare, np.shape(size))))
                self.reached[key] = max(self.reached.get(key, -np.inf), found)
                if not side.equal:
                    left.append(np.broadcast_to(spare, np.shape(size)))
        return left


def search(statement: Statement, seen: StatementRecord, seed: int = 1) -> Cube:
    """Move closed loops towards those where a term of the bound is used up, LANES of them for each term. Returns the last."""
    draw = np.random.default_rng([seed, int(statement.number[1:])])
    cube: Cube = draw.random((DIMENSIONS, LANES))
    groups = len(seen.look(statement.sides(sample_at(cube))))
    cube = np.tile(cube, max(groups, 1))
    owner, lane = np.repeat(np.arange(groups), LANES), np.arange(groups * LANES)
    best, trial = np.full(groups * LANES, np.inf), cube
    for _ in range(STEPS if groups else 0):
        spare = np.array(seen.look(statement.sides(sample_at(trial))))[owner, lane]
        better = spare < best
        best, cube = np.where(better, spare, best), np.where(better, trial, cube)
        if best.reshape(groups, LANES).min(axis=1).max() < 1.0 - ENOUGH:
            break
        trial = moved(cube, best.reshape(groups, LANES), draw)
    return cube


def moved(cube: Cube, best: Cube, draw: np.random.Generator) -> Cube:
    """Closed loops near the best so far: some numbers of each shifted, taken from a better one, or set to zero error."""
    groups, lanes = best.shape
    count = groups * lanes
    changed = draw.random(cube.shape) < 10.0 ** draw.uniform(-2.3, -0.3, count)
    size = 10.0 ** draw.uniform(-2.5, -0.5, count)
    leader = np.argmin(best, axis=1).repeat(lanes) + np.arange(groups).repeat(lanes) * lanes
    kind = draw.integers(0, 4, count)
    stepped = np.clip(cube + size * draw.standard_normal(cube.shape), 0.0, 1.0)
    other = draw.integers(0, lanes, count) + np.arange(groups).repeat(lanes) * lanes
    along = np.clip(cube + draw.random(count) * (cube[:, leader] - cube[:, other]), 0.0, 1.0)
    towards = 0.5 + (cube - 0.5) * draw.random(count)
    ends = (cube > 0.5).astype(float)
    new = np.choose(kind, [stepped, along, towards, ends + (cube - ends) * draw.random(count)])
    return np.where(changed, new, cube)


def check_statements(samples: int = 1_000_000, seed: int = 1) -> list[StatementMargin]:
    """Every statement over random closed loops and over those that a search finds nearest to its bound."""
    seen = {statement.number: StatementRecord() for statement in STATEMENTS}
    done = 0
    while done < samples:
        count = min(CHUNK, samples - done)
        sample = draw_sample(seed * 1_000_003 + done, count)
        for statement in STATEMENTS:
            seen[statement.number].look(statement.sides(sample))
        done += count
    for statement in STATEMENTS:
        search(statement, seen[statement.number], seed)
    return [StatementMargin(s.number, s.says, seen[s.number].worst, samples, seen[s.number].reached) for s in STATEMENTS]

"""The search: CMA-ES (Hansen 2016, the library `cma`) in the unit box, restarted with twice the population (Auger 2005).

It asks for a generation, all of which is flown in one sweep, and is told the costs. Where it stops by itself it restarts
from anywhere in the box, with a population that still fits ten times into what is left of the budget. It never flies more than
the budget; what is left over is less than a generation.
"""

import math
import warnings
from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from quadstep.io.errors import UserError, cut
from quadstep.report.terminal.progress import Progress
from quadstep.studies.campaign.limits import MOST_FLIGHTS
from quadstep.studies.tuning.ground import Asked, Ground
from quadstep.studies.tuning.judge import Judge, Judged
from quadstep.studies.tuning.theorem import Conditions, distance

BLOCK = 16
"""Flights that a generation is a multiple of, so that the vector registers of any machine are full."""

SIGMA = 0.25
"""Standard deviation of the first generation in the unit box."""

ALIKE = {"tolx": 1e-3, "tolfun": 1e-5}
"""Differences of candidates, in the unit box and in cost, below which a search stops: finer gains are of no use."""

FEWEST_GENERATIONS = 10
"""That a restart must still have room for, or its population is not doubled."""

STRICTNESS = 10.0
"""How fast the cost grows with the squared distance from where the conditions hold."""


class Candidate(NamedTuple):
    """run: 0 the present gains, 1 the first search, then the restarts. moved: how far, until the conditions held (or inf, if
    they are broken). flights: over all flights so far, after its generation.
    """

    run: int
    generation: int
    values: dict[str, float]
    point: list[float]
    moved: float
    judged: Judged
    flights: int


class Found(NamedTuple):
    """history: every candidate in order, the present gains first. best: of those that keep the conditions."""

    history: list[Candidate]
    best: Candidate
    judge: Judge

    @property
    def present(self) -> Candidate:
        """The present gains."""
        return self.history[0]


def shown_flights(progress: Progress, flights: int, best: float) -> None:
    """Show flights flown so far and the best objective so far, NaN if none."""
    progress.to(flights, note=f"best {best:.4g}" if math.isfinite(best) else "")


def population(gains: int, seeds: int) -> int:
    """Candidates of a generation: cma's default, and more until their flights fill whole blocks."""
    count = 4 + math.floor(3 * math.log(max(2, gains)))
    block = BLOCK // math.gcd(BLOCK, seeds)
    return -(-count // block) * block


def least_budget(wanted: Asked) -> int:
    """The fewest flights with which to search: the present gains, a generation and the comparison."""
    return wanted.seeds * (1 + population(len(wanted.gains), wanted.seeds)) + 2 * wanted.unseen


def check_budget(wanted: Asked, budget: int) -> None:
    """Refuse a budget that is too small or too large. Raises UserError."""
    least, count = least_budget(wanted), population(len(wanted.gains), wanted.seeds)
    if budget > MOST_FLIGHTS:
        raise UserError(f"--budget: should be from {least} to {MOST_FLIGHTS} flights, not {cut(str(budget), 60)}")
    if budget < least:
        raise UserError(
            f"--budget: {budget} flights are too few; at least {least} are needed: the present gains and one generation of "
            f"{count} candidates, {wanted.seeds} flight{'s' * (wanted.seeds > 1)} each (tune.seeds), and for the comparison "
            f"2 x {wanted.unseen} (tune.unseen)"
        )


class Search:
    """One search. budget: flights it may use."""

    def __init__(self, ground: Ground, budget: int, seed: int, progress: Progress) -> None:
        self.ground, self.budget, self.seed, self.progress = ground, budget, seed, progress
        self.asked = ground.asked
        self.conditions: Conditions | None = ground.conditions()
        self.judge = Judge(self.asked.section, ground.duration)
        self.flights = 0
        self.history: list[Candidate] = []
        self.best: Candidate | None = None

    def run(self) -> Found:
        """Until the budget is used."""
        wanted, start = self.asked, self.asked.start
        anchor = self.conditions.anchor(start, self.seed) if self.conditions else start
        broken = bool(self.conditions and self.conditions.broken(wanted.present))
        self.flown(0, 0, [wanted.present], [start], [math.inf if broken else 0.0])
        base = population(len(wanted.gains), wanted.seeds)
        restart, random = 0, np.random.default_rng([self.seed, 1])
        while base * wanted.seeds <= self.left:
            count = base * 2 ** min(restart, 20)
            while count > base and count * wanted.seeds * FEWEST_GENERATIONS > self.left:
                count //= 2
            begin = anchor if restart == 0 else random.random(len(start)).tolist()
            restart += 1
            self.one_run(restart, begin, anchor, count)
        assert self.best is not None
        return Found(self.history, self.best, self.judge)

    @property
    def left(self) -> int:
        """Of the budget."""
        return self.budget - self.flights

    def one_run(self, run: int, begin: list[float], anchor: list[float], count: int) -> None:
        """One start of CMA-ES, until it stops or another generation would not fit."""
        strategy, generation = started(begin, count, [self.seed, 2, run]), 0
        size = len(begin)
        while not strategy.stop() and count * self.asked.seeds <= self.left:
            generation += 1
            asked = strategy.ask()
            wanted = [[min(max(float(place), 0.0), 1.0) for place in point[:size]] for point in asked]
            points = [self.conditions.moved(point, anchor) if self.conditions else point for point in wanted]
            moved = [distance(point, wish) for point, wish in zip(points, wanted, strict=True)]
            flown = self.flown(run, generation, [self.asked.numbers(point) for point in points], points, moved)
            strategy.tell(asked, [one.judged.cost * (1.0 + STRICTNESS * (one.moved * one.moved)) for one in flown])

    def flown(
        self, run: int, generation: int, values: list[dict[str, float]], points: list[list[float]], moved: list[float]
    ) -> list[Candidate]:
        """Candidates flown and judged."""
        judged = self.judged(values)
        found = [
            Candidate(run, generation, numbers, point, far, one, self.flights)
            for numbers, point, far, one in zip(values, points, moved, judged, strict=True)
        ]
        self.history += found
        for one in found:
            if math.isfinite(one.moved) and (self.best is None or one.judged.cost < self.best.judged.cost):
                self.best = one
        self.show()
        return found

    def show(self) -> None:
        """Show how far it is."""
        shown_flights(self.progress, self.flights, math.nan if self.best is None else self.best.judged.objective)

    def judged(self, values: list[dict[str, float]]) -> list[Judged]:
        """Candidates flown and judged; the first of all is what the others are measured in."""
        before = self.flights

        def progress(more: int) -> None:
            self.flights += more
            self.show()

        flown = self.ground.fly(values, 0, self.asked.seeds, progress)
        if not self.history:
            self.judge = self.judge.in_units_of(flown[0])
        self.flights = before + len(values) * self.asked.seeds
        return [self.judge.judge(flights) for flights in flown]


class Evolution(Protocol):
    """A CMA-ES of the package cma."""

    def stop(self) -> object:
        """Why it would end; empty if it would not."""
        ...

    def ask(self) -> list[NDArray[np.float64]]:
        """The candidates of the next generation."""
        ...

    def tell(self, candidates: Sequence[NDArray[np.float64]], costs: Sequence[float]) -> None:
        """What they cost."""
        ...


def started(begin: list[float], count: int, seed: list[int]) -> Evolution:
    """A CMA-ES that draws from a generator of its own. One dimension is not supported, so there are at least two."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # about packages that draw
        import cma  # noqa: PLC0415 (an extra, loaded where it is used)

    random = np.random.default_rng(seed)
    inside = [*begin, *[0.5] * (2 - len(begin))]
    options = {
        "bounds": [0.0, 1.0], "popsize": count, "seed": math.nan, "verbose": -9,
        "randn": lambda *shape: random.standard_normal(shape), **ALIKE,
    }  # fmt: skip
    made: Evolution = cma.CMAEvolutionStrategy(inside, SIGMA, options)
    return made

"""The search: CMA-ES (Hansen 2016, the library `cma`) in the unit box, begun at the present gains with small steps.

It asks for a generation, all of which is flown in one sweep (`trial`: few flights for most), and is told the costs. Where it
stops by itself, or finds nothing better, it starts again from the best gains so far, with twice the population where ten such
generations fit into what is left of the budget (Auger and Hansen 2005). It never flies more than the budget; what is left over
is less than a generation.
"""

import math
import warnings
from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from quadstep.io.errors import UserError, cut
from quadstep.report.progress import Progress
from quadstep.studies.campaign import MOST_FLIGHTS
from quadstep.studies.tuning.gains import Conditions, distance
from quadstep.studies.tuning.ground import CandidateFlyer, TuningRequest
from quadstep.studies.tuning.objective import CandidateFlights, Judge, Judged, joined
from quadstep.studies.tuning.trial import FINALISTS, MarginGuess, Tried, flights_of, looked_at, trial_flights

BLOCK = 16
"""Flights that a generation is a multiple of, so that the vector registers of any machine are full."""

SIGMA = 0.05
"""Standard deviation of the first generation in the unit box: a quarter of a gain where its range is two decades."""

STALLED = 20
"""Generations without better gains after which a search starts again from the best."""

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
    tried: Tried
    flights: int

    @property
    def judged(self) -> Judged:
        """On as many flights as it flew."""
        return self.tried.judged

    def leads(self, best: "Candidate | None") -> bool:
        """Whether it is better than the best so far: it flew all flights, keeps the conditions, and costs less."""
        if not (self.tried.whole and math.isfinite(self.moved)):
            return False
        return best is None or self.judged.cost < best.judged.cost


class SearchResult(NamedTuple):
    """history: every candidate in order, the present gains first. led: those that were the best so far when they were judged,
    the last of them at the end, so at least as good as the present ones.
    """

    history: list[Candidate]
    led: list[Candidate]
    judge: Judge

    @property
    def present(self) -> Candidate:
        return self.history[0]

    @property
    def best(self) -> Candidate:
        return self.led[-1]


def shown_flights(progress: Progress, flights: int, best: float) -> None:
    """Show flights flown so far and the best objective so far, NaN if none."""
    progress.to(flights, note=f"best {best:.4g}" if math.isfinite(best) else "")


def population(gains: int, flights: int) -> int:
    """Candidates of a generation: cma's default, and more until the flights that they are tried on fill whole blocks."""
    count = 4 + math.floor(3 * math.log(max(2, gains)))
    block = BLOCK // math.gcd(BLOCK, flights)
    return -(-count // block) * block


def check_budget(request: TuningRequest, budget: int) -> None:
    """Refuse a budget that is too small or too large. Raises UserError."""
    flights = flights_of([request.seeds])
    count = population(len(request.gains), flights.first)
    least = flights.every + flights.most(count) + 2 * request.unseen
    if budget > MOST_FLIGHTS:
        raise UserError(f"--budget: should be from {least} to {MOST_FLIGHTS} flights, not {cut(str(budget), 60)}")
    if budget < least:
        raise UserError(
            f"--budget: at least {least} flights are needed, not {budget}: {flights.every} with the current gains, "
            f"{flights.most(count)} for one generation of {count} candidates, and for the comparison "
            f"2 x {request.unseen}{' (tune.unseen)' * request.different}"
        )


class Search:
    """One search. grounds: one for each situation. budget: flights it may use."""

    def __init__(self, grounds: Sequence[CandidateFlyer], budget: int, seed: int, progress: Progress) -> None:
        ground = grounds[0]
        self.grounds, self.budget, self.seed, self.progress = grounds, budget, seed, progress
        self.asked, self.stability = ground.asked, ground.stability
        self.conditions: Conditions | None = ground.conditions()
        self.judge = Judge(self.asked.section, ground.duration)
        self.each = flights_of(one.asked.seeds for one in grounds)
        self.guess = MarginGuess(self.stability.limits)
        self.flights = 0
        self.history: list[Candidate] = []
        self.led: list[Candidate] = []

    @property
    def best(self) -> Candidate | None:
        """So far."""
        return self.led[-1] if self.led else None

    def run(self) -> SearchResult:
        """Until the budget is used."""
        wanted, start = self.asked, self.asked.start
        anchor = self.conditions.anchor(start, self.seed) if self.conditions else start
        broken = bool(self.conditions and self.conditions.broken(wanted.present))
        self.flown(0, 0, [wanted.present], [start], [math.inf if broken else 0.0])
        base, restart = population(len(wanted.gains), self.each.first), 0
        while self.each.most(base) <= self.left:
            count = base * 2 ** min(restart, 20)
            while count > base and self.each.most(count) * FEWEST_GENERATIONS > self.left:
                count //= 2
            restart += 1
            self.one_run(restart, self.best.point if self.best else anchor, anchor, count)
        best = self.led[-1]
        if best.judged.lost:  # so that its margins have not been looked at
            seen = best._replace(tried=self.stability.sought(best.tried, best.values))
            self.history, self.led = ([seen if one is best else one for one in many] for many in (self.history, self.led))
        return SearchResult(self.history, self.led, self.judge)

    @property
    def left(self) -> int:
        return self.budget - self.flights

    def one_run(self, run: int, begin: list[float], anchor: list[float], count: int) -> None:
        """One start of CMA-ES, until it stops or finds nothing better, or another generation would not fit."""
        strategy, generation, better = started(begin, count, [self.seed, 2, run]), 0, 0
        size = len(begin)
        while not strategy.stop() and generation - better < STALLED and self.each.most(count) <= self.left:
            generation += 1
            asked, before = strategy.ask(), self.best
            wanted = [[min(max(float(place), 0.0), 1.0) for place in point[:size]] for point in asked]
            points = [self.conditions.moved(point, anchor) if self.conditions else point for point in wanted]
            moved = [distance(point, wish) for point, wish in zip(points, wanted, strict=True)]
            flown = self.flown(run, generation, [self.asked.numbers(point) for point in points], points, moved)
            better = better if self.best is before else generation
            strategy.tell(asked, [one.tried.cost * (1.0 + STRICTNESS * (one.moved * one.moved)) for one in flown])

    def flown(
        self, run: int, generation: int, values: list[dict[str, float]], points: list[list[float]], moved: list[float]
    ) -> list[Candidate]:
        tried = self.tried(values, self.guessed(points))
        for point, seen in zip(points, tried, strict=True):
            self.guess.learn(point, seen)
        found = [
            Candidate(run, generation, numbers, point, far, one, self.flights)
            for numbers, point, far, one in zip(values, points, moved, tried, strict=True)
        ]
        self.history += found
        for one in found:
            if one.leads(self.best):
                self.led.append(one)
        self.show()
        return found

    def show(self) -> None:
        shown_flights(self.progress, self.flights, math.nan if self.best is None else self.best.judged.objective)

    def guessed(self, points: Sequence[Sequence[float]]) -> list[float]:
        """By what share candidates are thought to miss their margins."""
        return self.guess.missed(points, self.best.point if self.best else points[0])

    def tried(self, values: list[dict[str, float]], guessed: Sequence[float]) -> list[Tried]:
        """Candidates flown and judged. The first of all flies everything, and is what the others are measured in."""
        first = self.fly(values)
        if not self.history:
            every = self.fly_on(first, values)
            self.judge = self.judge.in_units_of(every[0][0])
            return [self.stability.with_margins(Tried(self.judged(first[0]), self.judged(every[0])), values[0])]
        found = [Tried(self.judged(one), missed=guess) for one, guess in zip(first, guessed, strict=True)]
        least = self.best.tried.cost if self.best else math.inf
        would = sorted((i for i, one in enumerate(found) if one.cost < least), key=lambda i: found[i].cost)[:FINALISTS]
        every = self.fly_on([first[i] for i in would], [values[i] for i in would])
        for i, one in zip(would, every, strict=True):
            found[i] = found[i]._replace(whole=self.judged(one))
        return looked_at(found, values, self.stability, self.best.judged.cost if self.best else math.inf)

    def fly(self, values: Sequence[dict[str, float]]) -> list[list[CandidateFlights]]:
        """The first flights of candidates, in each situation."""
        return self.counted(values, [(0, trial_flights(one.asked.seeds)) for one in self.grounds])

    def fly_on(
        self, first: Sequence[list[CandidateFlights]], values: Sequence[dict[str, float]]
    ) -> list[list[CandidateFlights]]:
        """All flights of candidates whose first ones have been flown."""
        more = self.counted(values, [(trial_flights(one.asked.seeds), one.asked.seeds) for one in self.grounds])
        return [[joined(*parts) for parts in zip(*both, strict=True)] for both in zip(first, more, strict=True)]

    def counted(self, values: Sequence[dict[str, float]], spans: Sequence[tuple[int, int]]) -> list[list[CandidateFlights]]:
        """Candidates on flights from the first number of a span up to its second, in each situation."""
        found: list[list[CandidateFlights]] = [[] for _ in values]
        for ground, (first, past) in zip(self.grounds, spans, strict=True):
            before = self.flights

            def progress(more: int) -> None:
                self.flights += more
                self.show()

            for one, flown in zip(found, ground.fly(values, first, past - first, progress), strict=True):
                one.append(flown)
            self.flights = before + len(values) * (past - first)
        return found

    def judged(self, flown: Sequence[CandidateFlights]) -> Judged:
        return self.judge.judge(flown[0])


class Evolution(Protocol):
    """A CMA-ES of the package cma."""

    def stop(self) -> object:
        """Why it would end; empty if it would not."""
        ...

    def ask(self) -> list[NDArray[np.float64]]:
        """The candidates of the next generation."""
        ...

    def tell(self, candidates: Sequence[NDArray[np.float64]], costs: Sequence[float]) -> None: ...


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
    return cma.CMAEvolutionStrategy(inside, SIGMA, options)

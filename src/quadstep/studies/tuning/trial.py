"""How a candidate is evaluated, cheapest first: a few flights, all of them if it would be the best, then its margins.

So most candidates cost few flights, and a linearisation, which costs more than all flights of a candidate, is for those
that would win (a race: Maron and Moore, 1994, "Hoeffding races"). The margins of all others are guessed from those that were
looked at, so that the search keeps away from gains that would miss them.
"""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from quadstep.io.errors import UserError
from quadstep.mission.tune import Constraint
from quadstep.studies.tuning.objective import Judged, squashed

FEWEST = 4
"""Flights that a candidate is tried on at least."""

SHARE = 4
"""One part in so many of its flights is what a candidate is tried on."""

FINALISTS = 3
"""Candidates of a generation that may fly all flights."""

NEAR = 0.1
"""Distance in the unit box at which what was looked at counts half as much for a guess."""

DOUBT = 0.02
"""Share of a limit by which a guess may miss it and is not believed to."""

RIDGE = 1e-3
"""Squared distance in the unit box: a guess is as flat as if as much had been seen there that does not change."""


def trial_flights(seeds: int) -> int:
    """Flights that a candidate is tried on, of all that one may fly."""
    return min(seeds, max(FEWEST, seeds // SHARE))


class TrialFlights(NamedTuple):
    """Of a candidate: those that it is tried on, and all that it may fly."""

    first: int
    every: int

    def most(self, count: int) -> int:
        """What so many candidates of a generation take at most."""
        return count * self.first + min(count, FINALISTS) * (self.every - self.first)


def flights_of(seeds: Iterable[int]) -> TrialFlights:
    """Of a candidate that flies so many in each of several situations."""
    many = list(seeds)
    return TrialFlights(sum(map(trial_flights, many)), sum(many))


class Tried(NamedTuple):
    """A candidate. trial: on the first flights; whole: on all of them, of one that would have been the best. missed: by what
    share it misses the limits of margins, summed: a guess where nobody looked, infinite for a loop that has none.
    """

    trial: Judged
    whole: Judged | None = None
    missed: float = 0.0

    @property
    def judged(self) -> Judged:
        """On as many flights as it flew."""
        return missing(self.whole or self.trial, self.missed)

    @property
    def cost(self) -> float:
        """On the first flights, so that all candidates can be compared."""
        return missing(self.trial, self.missed).cost


def tried_of(trial: Sequence[object], whole: Sequence[object] | None, missed: float) -> Tried:
    return Tried(Judged._make(trial), None if whole is None else Judged._make(whole), missed)


def missing(judged: Judged, missed: float) -> Judged:
    """A judgement that counts missed margins as `Judge` counts other missed constraints."""
    if missed == 0.0:
        return judged
    cost = judged.cost + squashed(missed) + (0.0 if judged.violation > 0.0 else 1.0)
    return judged._replace(violation=judged.violation + missed, cost=cost)


class Stability(NamedTuple):
    """Margins that gains must leave. limits: by name. margins: of gains by their names; raises UserError for a loop that
    cannot be linearised.
    """

    limits: Mapping[str, Constraint]
    margins: Callable[[Mapping[str, float]], Mapping[str, float]]

    def missed(self, margins: Mapping[str, float]) -> float:
        """By what share they miss the limits, summed."""
        return sum(limit.excess(np.array([margins[name]])) for name, limit in self.limits.items())

    def with_margins(self, one: Tried, values: Mapping[str, float]) -> Tried:
        """A candidate with its margins. Raises UserError for a loop that cannot be linearised."""
        if not self.limits:
            return one
        margins, whole = self.margins(values), one.whole or one.trial
        return one._replace(whole=whole._replace(parts={**whole.parts, **margins}), missed=self.missed(margins))

    def sought(self, one: Tried, values: Mapping[str, float]) -> Tried:
        """A candidate with its margins, or as one that misses all of them."""
        try:
            return self.with_margins(one, values)
        except UserError:
            return one._replace(missed=math.inf)


class MarginGuess:
    """Margins guessed from those looked at: a weighted ridge regression about the best point so far, linear in the point."""

    def __init__(self, limits: Mapping[str, Constraint]) -> None:
        self.limits = limits
        self.points: list[Sequence[float]] = []
        self.slacks: list[list[float]] = []
        """How far within each limit, as a share of it."""

    def learn(self, point: Sequence[float], one: Tried) -> None:
        """What was looked at, if it was."""
        known = one.whole.parts if one.whole else {}
        slacks = [one.slack(known.get(name, math.nan)) for name, one in self.limits.items()]
        if slacks and all(map(math.isfinite, slacks)):
            self.points.append(point)
            self.slacks.append([min(slack, 1.0) for slack in slacks])

    def missed(self, points: Sequence[Sequence[float]], centre: Sequence[float]) -> list[float]:
        """By what share the limits would be missed, summed."""
        if not self.points:
            return [0.0] * len(points)
        known, asked = (np.array(one) - np.array(centre) for one in (self.points, points))
        weights = 1.0 / (1.0 + (known**2).sum(axis=1) / NEAR**2)
        rows, asked = (np.hstack([np.ones((len(one), 1)), one]) for one in (known, asked))
        flat = RIDGE * np.diag([0.0, *[1.0] * (rows.shape[1] - 1)])
        slopes = np.linalg.solve((rows.T * weights) @ rows + flat, (rows.T * weights) @ np.array(self.slacks))
        return np.maximum(0.0, -DOUBT - asked @ slopes).sum(axis=1).tolist()


def looked_at(
    trials: Sequence[Tried], values: Sequence[Mapping[str, float]], stability: Stability, least: float
) -> list[Tried]:
    """A generation with the margins of those that would be the best on all flights, the cheapest first, until one keeps them.

    least: what the best so far costs.
    """
    seen = list(trials)
    flown = {i: one.whole.cost for i, one in enumerate(trials) if one.whole}
    for place in sorted(flown, key=lambda i: flown[i]):
        if flown[place] < least:
            if not trials[place].judged.lost:  # where flights are lost, margins decide nothing
                seen[place] = stability.sought(trials[place], values[place])
            least = min(least, seen[place].judged.cost)
    return seen

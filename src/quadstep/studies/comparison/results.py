"""What a comparison has found, in numbers."""

from collections.abc import Mapping
from typing import NamedTuple

from quadstep.metrics.statistics import Estimate
from quadstep.studies.comparison import ranking
from quadstep.studies.comparison.cost import Cost
from quadstep.studies.comparison.entrants import Entrant, Problem
from quadstep.studies.comparison.margins import Linear, Margin
from quadstep.studies.comparison.ranking import CellFlights, Effort, Ranked, Spread, effort, losses, spread
from quadstep.studies.comparison.schema import MarginEntry
from quadstep.studies.comparison.study import Situation


class SituationResult(NamedTuple):
    """A controller in a situation. spreads: by metric."""

    situation: Situation
    controller: str
    flights: int
    lost: Estimate
    spreads: dict[str, Spread]
    effort: Effort


class Comparison(NamedTuple):
    """All of a study. metrics: names with units by names without, the first of which ranks. ranked: by situation. margins: by
    their name, vehicle and controller. costs, linear (the loop at rest): by vehicle and controller. problems: what could not
    take part, or went wrong. notes: of whoever wrote the study, on its limits. left_out: who could not take part and
    need not, a sentence each. tuned_in: situations that gains were tuned in, which do not count in mean ranks.
    """

    name: str
    source: str
    seeds: int
    seed: int
    metrics: dict[str, str]
    situations: tuple[Situation, ...] = ()
    results: tuple[SituationResult, ...] = ()
    ranked: Mapping[Situation, Ranked] = {}
    entrants: tuple[Entrant, ...] = ()
    margins: Mapping[tuple[str, str, str], Margin] = {}
    raised: Mapping[str, MarginEntry] = {}
    costs: Mapping[tuple[str, str], Cost] = {}
    problems: tuple[Problem, ...] = ()
    tuned_in: frozenset[Situation] = frozenset()
    linear: Mapping[tuple[str, str], Linear] = {}
    notes: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()

    @property
    def metric(self) -> str:
        return next(iter(self.metrics))

    @property
    def controllers(self) -> list[str]:
        return list(dict.fromkeys(one.controller for one in self.results))

    @property
    def limitations(self) -> tuple[str, ...]:
        """Of the study, and of this run of it."""
        return (*self.notes, *self.left_out)

    @property
    def pairs(self) -> int:
        """How many were compared: the size of each family of tests."""
        return sum(len(one.pairs) for one in self.ranked.values() if not one.copies)

    def of(self, situation: Situation) -> list[SituationResult]:
        return [one for one in self.results if one.situation == situation]

    def overall(self) -> dict[str, float]:
        """The mean rank of each controller over all situations that no gain was tuned in, 0 the best and 1 the worst; over
        all where there is no other.
        """
        counted = [one for situation, one in self.ranked.items() if situation not in self.tuned_in]
        return ranking.overall(counted or list(self.ranked.values()))

    @property
    def leaders(self) -> list[str]:
        """Who has the best mean rank: several where they share it."""
        ranks = self.overall()
        return [name for name, rank in ranks.items() if rank == min(ranks.values())]

    @property
    def searches(self) -> int:
        """The fewest searches for the gains of any controller that was tuned; 0 where none was."""
        return min((1 + len(one.others) for one in self.entrants if one.trained), default=0)


def result(situation: Situation, controller: str, flown: CellFlights, metrics: Mapping[str, str]) -> SituationResult:
    spreads = {name: spread(flown, name) for name in metrics}
    return SituationResult(situation, controller, len(flown.lost), losses(flown), spreads, effort(flown))


def ranks(flown: Mapping[Situation, Mapping[str, CellFlights]], metric: str) -> dict[Situation, Ranked]:
    """Every situation, p-values corrected over all of them."""
    found = [ranking.compare(one, metric) for one in flown.values()]
    return dict(zip(flown, ranking.corrected(found), strict=True))

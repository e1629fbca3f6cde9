"""The cost of a candidate's flights.

The objective is the aggregate over the completed flights of a weighted sum of metrics. The cost that is minimised is

    s(objective) + [0 or 1 + s(violation)] + [0 or 2 + the sum over flights lost of 2 - time of its end / duration],

s(x) = x / (x + 1), the objective measured in that of the present gains. So a candidate that meets the constraints is better
than one that does not, one that completes all flights better than one that loses any; losing fewer, or later, is better.

Present and tuned gains are compared on flights that no gain was tuned on, the same for both: every number with its interval.
"""

import math
from collections.abc import Collection, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadstep.interfaces.closed_loop import Outcome
from quadstep.metrics.registry import MARGINS
from quadstep.metrics.statistics import (
    Estimate,
    mean,
    mean_growth,
    means,
    quantile,
    quantile_increase,
    share,
    share_difference,
)
from quadstep.mission.tune import Constraint, TuneSection
from quadstep.report import units

Floats = NDArray[np.float64]


class CandidateFlights(NamedTuple):
    """Flights of one candidate. outcome, ended [s]: one element per flight. metrics: shape (flights, len(names))."""

    outcome: NDArray[np.int8]
    ended: Floats
    metrics: Floats
    names: Mapping[str, str]
    """Of the metrics: without unit, and with it."""

    @property
    def completed(self) -> NDArray[np.bool_]:
        return np.equal(self.outcome, Outcome.COMPLETED)

    def metric(self, name: str) -> Floats:
        """By its name without unit."""
        return self.metrics[:, list(self.names).index(name)]

    def with_values(self, values: Mapping[str, float]) -> "CandidateFlights":
        """With what is the same for all flights, by its name without unit."""
        metrics = self.metrics.copy()
        for name, value in values.items():
            metrics[:, list(self.names).index(name)] = value
        return self._replace(metrics=metrics)


def joined(first: CandidateFlights, more: CandidateFlights) -> CandidateFlights:
    outcome, ended = np.concatenate([first.outcome, more.outcome]), np.concatenate([first.ended, more.ended])
    return CandidateFlights(outcome, ended, np.concatenate([first.metrics, more.metrics]), first.names)


class Judged(NamedTuple):
    """objective: NaN where no flight completed. parts: aggregates of metrics. lost: flights. violation: see `Judge`."""

    objective: float
    parts: dict[str, float]
    lost: int
    violation: float
    cost: float

    @property
    def feasible(self) -> bool:
        """Whether all flights completed and the constraints are kept."""
        return self.lost == 0 and self.violation == 0.0


class Judge(NamedTuple):
    """duration: of a completed flight [s]. unit: the objective of the present gains."""

    section: TuneSection
    duration: float
    unit: float = 1.0

    def in_units_of(self, flown: CandidateFlights) -> "Judge":
        """A judge that measures objectives in units of these flights' objective, if they have one."""
        objective = self.aggregate(self.costs(flown)[flown.completed])
        return self._replace(unit=objective) if math.isfinite(objective) and objective > 0.0 else self

    def costs(self, flown: CandidateFlights) -> Floats:
        """The weighted sum of metrics of each flight."""
        total = np.zeros(len(flown.ended))
        for name, weight in self.section.objective.items():
            total += weight * flown.metric(name)
        return total

    def aggregate(self, values: Floats) -> float:
        """Of many flights; NaN without any."""
        if len(values) == 0:
            return math.nan
        if self.section.aggregate == "mean":
            return float(values.mean())
        return float(values.max() if self.section.aggregate == "worst" else np.quantile(values, 0.95))

    @property
    def reported(self) -> list[str]:
        """The metrics to report, by name."""
        return list(dict.fromkeys(["position_rmse", "largest_error", *self.section.objective, *self.section.constraints]))

    def violation(self, flown: CandidateFlights) -> float:
        """By what share the constraints are missed, summed; those of margins are no flight's (`trial.Stability`)."""
        total = 0.0
        for name, limit in self.section.of_flights.items():
            values = flown.metric(name)[flown.completed]
            if len(values):
                total += limit.excess(values)
        return total

    def within(self, flown: CandidateFlights) -> NDArray[np.bool_]:
        """Which flights completed and kept every constraint of flights; a margin is that of the loop, the same for all."""
        good: NDArray[np.bool_] = flown.completed.copy()
        for name, limit in self.section.of_flights.items():
            good &= limit.keeps(flown.metric(name))
        return good

    def judge(self, flown: CandidateFlights) -> Judged:
        through = flown.completed
        objective = self.aggregate(self.costs(flown)[through])
        lost, violation = int((~through).sum()), self.violation(flown)
        cost = squashed(objective / self.unit) + (1.0 + squashed(violation) if violation > 0.0 else 0.0)
        if lost:
            cost += 2.0 + float((2.0 - flown.ended[~through] / self.duration).sum())
        parts = {name: self.aggregate(flown.metric(name)[through]) for name in self.reported}
        return Judged(objective, parts, lost, violation, cost)


def squashed(x: float) -> float:
    """From 0 to infinity onto 0 to 1; 1 for NaN."""
    return x / (1.0 + x) if math.isfinite(x) else 1.0


OBJECTIVE = "objective"
AGGREGATES = {"mean": "mean", "p95": "95 % quantile", "worst": "largest"}


class Row(NamedTuple):
    """A metric with both gains, over the flights completed with them; difference: tuned less present, flight by flight,
    over those completed with both. None without such a flight.
    """

    name: str
    present: Estimate | None
    tuned: Estimate | None
    difference: Estimate | None

    @property
    def texts(self) -> list[str]:
        """Words for the metric, and its numbers in one unit."""
        words, unit = units.metric(self.name)
        return [words, *units.in_one_unit(self[1:], unit)]


class Compared(NamedTuple):
    """success: share of flights that completed and kept the constraints of flights. objective, rows: of it, and of metrics.
    limits: of margins, by their names with units. missed: constraints that the tuned gains miss, in words. kept: the share of
    all flights that keep each constraint of flights, by its words: with both gains, their difference, and what is asked; where
    any is lost, also that are completed.
    change: of the objective, as a share of what the present gains have on the same flights, those completed with both.
    weighed: metrics of the objective, by their names with units. from_the_start: that largest errors say nothing of the gains.
    lacking: of being as commanded, what the flight that is shown with the tuned gains does.
    """

    flights: int
    success: tuple[Estimate, Estimate]
    success_difference: Estimate
    objective: Row
    rows: list[Row]
    verdict: str
    better: bool
    limits: Mapping[str, Constraint]
    missed: list[str]
    kept: Mapping[str, tuple[Estimate, Estimate, Estimate, float]]
    change: Estimate | None = None
    weighed: Collection[str] = ()
    from_the_start: str = ""
    lacking: tuple[str, ...] = ()


BETTER = "The tuned gains are better{where}."
FLY_BETTER = "Though they {do} keep every constraint, the tuned gains fly better{where}."
WORSE = "The tuned gains are WORSE{where}: do not use them."
SAME = "No firm evidence that the tuned gains are better{where}; more flights (tune.seeds, --budget) or wider ranges may help."
UNCHANGED = "No better gains were found: tuned.toml has the current ones."
NEGLIGIBLE = 1e-3
"""Share of the present objective below which a change is negligible."""


def compare(judge: Judge, present: CandidateFlights, tuned: CandidateFlights, changed: bool = True) -> Compared:
    """The comparison. changed: whether the gains differ at all."""
    count = len(present.ended)
    *shares, success = shares_of(*(judge.within(flown) for flown in (present, tuned)))
    both = present.completed & tuned.completed
    costs = [judge.costs(flown) for flown in (present, tuned)]
    kind = judge.section.aggregate
    first, second = (aggregated(kind, one[flown.completed]) for one, flown in zip(costs, (present, tuned), strict=True))
    difference, change = increase(kind, costs[0][both], costs[1][both])
    objective = Row(OBJECTIVE, first, second, difference)
    reported = rows(judge.reported, present, tuned)
    where = " on flights they were not tuned on" if count > 1 else " on the one flight that they were tuned on"
    verdict = verdict_of(success, objective, count == 1) if changed else UNCHANGED
    better, wanted = verdict == BETTER, judge.section.constraints
    limits = {present.names[name]: one for name, one in wanted.items() if name in MARGINS}
    values = {row.name: row.tuned.value for row in reported if row.tuned and row.name in limits}
    missed = [said for name, value in values.items() if (said := shortfall(name, value, limits[name]))]
    kept = {"completed": (*shares_of(present.completed, tuned.completed), math.nan)}
    kept, open_ones = kept if judge.section.of_flights and not both.all() else {}, 0
    for name, limit in judge.section.of_flights.items():
        found = shares_of(*(flown.completed & limit.keeps(flown.metric(name)) for flown in (present, tuned)))
        words, unit = units.metric(present.names[name])
        (asked,) = units.in_one_unit([(limit.value, math.nan, math.nan)], unit)
        what = f"{words} at {'least' if limit.most is None else 'most'} {asked}".replace("\N{NO-BREAK SPACE}", " ")
        kept[what] = (*found, limit.share)
        state, of = as_asked(found[1], limit.share, count == 1), f"{units.percent(*found[1])} of {count:,} unseen flights"
        missed += [f"{what} in {of}, {units.percent(limit.share)} asked"] * (state == "not met" and count > 1)  # else known
        open_ones += state == "undecided"
    do = "do not" if missed else "are not shown to"
    said = (FLY_BETTER if better and (missed or open_ones) else verdict).format(where=where, do=do)
    weighed = [present.names[name] for name in judge.section.objective]
    shown = (shares[0], shares[1]), success, objective, reported, said, better, limits, missed, kept, change, weighed
    return Compared(count, *shown)


def as_asked(found: Estimate, asked: float, alone: bool) -> str:
    """Whether a share is as large as asked, at 95 % confidence; where all are asked, of those flown."""
    low, high = (found.value, found.value) if alone or asked == 1.0 else found[1:]
    return "met" if low >= asked else "not met" if high < asked else "undecided"


def shares_of(before: NDArray[np.bool_], after: NDArray[np.bool_]) -> tuple[Estimate, Estimate, Estimate]:
    """The shares of the same flights that are good before and after, and what the second is above the first."""
    gained, lost = int((after & ~before).sum()), int((before & ~after).sum())
    first, second = (share(int(one.sum()), len(one)) for one in (before, after))
    return first, second, share_difference(gained, lost, len(before))


def shortfall(name: str, value: float, limit: Constraint) -> str:
    """That a value misses its limit, in words; nothing where it keeps it."""
    if limit.keeps(np.array([value])).all():
        return ""
    words, unit = units.metric(name)
    found, asked = units.in_one_unit([(one, math.nan, math.nan) for one in (value, limit.value)], unit)
    return f"{words} {found}, {asked} asked".replace("\N{NO-BREAK SPACE}", " ")


def rows(names: Sequence[str], present: CandidateFlights, tuned: CandidateFlights) -> list[Row]:
    """Metrics of these names, without units: of all flights completed with either, and paired of those with both."""
    through = present.completed, tuned.completed, present.completed & tuned.completed
    columns: list[Floats] = []
    for name in names:
        first, second = present.metric(name), tuned.metric(name)
        columns += [one[some] for one, some in zip((first, second, second - first), through, strict=True)]
    found = iter(means([one for one in columns if len(one)]))
    parts = [next(found) if len(one) else None for one in columns]
    return [Row(present.names[name], *parts[3 * i : 3 * i + 3]) for i, name in enumerate(names)]


def verdict_of(success: Estimate, objective: Row, alone: bool) -> str:
    """The verdict at 95 % confidence; more successful flights come before a smaller objective, which decides nothing against
    the flights that succeed. alone: whether there is one flight with each set of gains, as all are alike.
    """
    sign, change = certain_sign(success, alone), objective.difference
    if sign == 0 and change is not None and objective.present is not None:
        sign = -certain_sign(change, alone) if abs(change.value) > NEGLIGIBLE * abs(objective.present.value) else 0
    return {1: BETTER, 0: SAME, -1: WORSE}[sign if sign * success.value >= 0.0 else 0]


def certain_sign(difference: Estimate, alone: bool) -> int:
    """Its sign, 0 if the interval holds zero or there is none. Of a flight alone it is certain, as all are alike."""
    low, high = (difference.value,) * 2 if alone else difference[1:]
    return int(low > 0.0) - int(high < 0.0)


def aggregated(kind: str, values: Floats) -> Estimate | None:
    """An aggregate of the values of flights; of the largest nothing is known beyond it. None without flights."""
    if len(values) == 0:
        return None
    if kind == "mean":
        return mean(values)
    return quantile(values, 0.95) if kind == "p95" else Estimate(float(values.max()), math.nan, math.nan)


def increase(kind: str, before: Floats, after: Floats) -> tuple[Estimate | None, Estimate | None]:
    """What an aggregate of the same flights is above that before, and by which share of that. None without flights; no share
    of what may be 0.
    """
    if len(after) == 0:
        return None, None
    positive = before.min() > 0.0
    if kind == "mean":
        return mean(after - before), mean_growth(before, after) if positive else None
    if kind == "p95":
        by, part = quantile_increase(before, after, 0.95)
    else:
        by, part = (
            Estimate(one, math.nan, math.nan) for one in (after.max() - before.max(), after.max() / before.max() - 1.0)
        )
    return by, part if positive else None

"""Present and tuned gains on flights that no gain was tuned on, the same for both: every number with its interval."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadstep.metrics.statistics import Estimate, mean, quantile, quantile_difference, share, share_difference
from quadstep.studies.tuning.judge import CandidateFlights, Judge

Floats = NDArray[np.float64]

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


class Compared(NamedTuple):
    """success: share of flights that completed and kept the constraints. objective, rows: of it, and of metrics."""

    flights: int
    success: tuple[Estimate, Estimate]
    success_difference: Estimate
    objective: Row
    rows: list[Row]
    verdict: str


BETTER = "The tuned gains are better{where}."
WORSE = "The tuned gains are WORSE{where}: do not use them."
SAME = "The tuned gains are NOT shown to be better{where}; more flights (tune.seeds, --budget) or wider ranges may help."
UNCHANGED = "No better gains were found: tuned.toml has the present ones."
NEGLIGIBLE = 1e-3
"""Share of the present objective below which a change is negligible."""


def compare(judge: Judge, present: CandidateFlights, tuned: CandidateFlights, changed: bool = True) -> Compared:
    """The comparison. changed: whether the gains differ at all."""
    count = len(present.ended)
    good = [judge.within(flown) for flown in (present, tuned)]
    shares = tuple(share(int(one.sum()), count) for one in good)
    gained, lost = int((good[1] & ~good[0]).sum()), int((good[0] & ~good[1]).sum())
    success = share_difference(gained, lost, count)
    both = present.completed & tuned.completed
    costs = [judge.costs(flown) for flown in (present, tuned)]
    kind = judge.section.aggregate
    first, second = (aggregated(kind, one[flown.completed]) for one, flown in zip(costs, (present, tuned), strict=True))
    objective = Row(OBJECTIVE, first, second, risen(kind, costs[0][both], costs[1][both]))
    rows = [row(name, present, tuned, both) for name in judge.reported]
    where = " on flights they were not tuned on" if count > 1 else ""
    verdict = judged(success, objective, count == 1).format(where=where) if changed else UNCHANGED
    return Compared(count, (shares[0], shares[1]), success, objective, rows, verdict)


def row(name: str, present: CandidateFlights, tuned: CandidateFlights, both: NDArray[np.bool_]) -> Row:
    values = [flown.metric(name) for flown in (present, tuned)]
    through = [one[flown.completed] for one, flown in zip(values, (present, tuned), strict=True)]
    first, second = (mean(one) if len(one) else None for one in through)
    return Row(present.names[name], first, second, mean((values[1] - values[0])[both]) if both.any() else None)


def judged(success: Estimate, objective: Row, alone: bool) -> str:
    """The verdict at 95 % confidence; more successful flights come before a smaller objective, which decides nothing against
    the flights that succeed. alone: whether there is one flight with each set of gains, as all are alike.
    """
    sign, change = certain(success, alone), objective.difference
    if sign == 0 and change is not None and objective.present is not None:
        sign = -certain(change, alone) if abs(change.value) > NEGLIGIBLE * abs(objective.present.value) else 0
    return {1: BETTER, 0: SAME, -1: WORSE}[sign if sign * success.value >= 0.0 else 0]


def certain(difference: Estimate, alone: bool) -> int:
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


def risen(kind: str, before: Floats, after: Floats) -> Estimate | None:
    """What an aggregate of the same flights is above that before. None without flights."""
    if len(after) == 0:
        return None
    if kind == "mean":
        return mean(after - before)
    if kind == "p95":
        return quantile_difference(before, after, 0.95)
    return Estimate(float(after.max() - before.max()), math.nan, math.nan)

"""Which of several controllers is better in a situation, from the same flights of each: pairs, and what is decided.

Every pair is tested by Wilcoxon's signed ranks (1945) of the flights' differences, a lost flight worse than any other, and by
the exact test of McNemar (1947) of who loses which flights. All tests of one kind in a study are one family, whose p-values
are corrected by Holm (1979): with 95 % confidence not one of the pairs called decided is wrong. Pairs, not mean ranks, decide
who is better, as mean ranks depend on who else takes part (Benavoli, Corani and Mangili 2016).

Where controllers were tuned several times, a pair is decided only if the gains of each search for the one are better than
those of each search for the other: its p-value is the largest of all these (an intersection-union test, Berger 1982).

Medians, 95 % quantiles and losses are over all flights, and infinite where too many are lost: a controller cannot gain by
losing its worst flights.
"""

import math
from collections.abc import Mapping, Sequence
from itertools import combinations, product
from typing import NamedTuple

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray
from scipy.stats import binomtest, rankdata, wilcoxon

from quadstep.metrics.statistics import LEVEL, Estimate, ordered_quantile, quantile, share
from quadstep.studies.campaign.flyer import OUTCOME, OUTCOMES
from quadstep.studies.campaign.schema import Campaign

Floats = NDArray[np.float64]


class CellFlights(NamedTuple):
    """The flights of a cell. lost: which did not complete. metrics: by name without unit, NaN where lost. others: the same
    flights with the gains of other searches. same: nothing in them is random, so one stands for all.
    """

    lost: NDArray[np.bool_]
    metrics: dict[str, Floats]
    others: tuple["CellFlights", ...] = ()
    same: bool = False

    def times(self, count: int) -> "CellFlights":
        """So many flights, where one stands for all."""
        if not self.same:
            return self
        metrics = {name: np.repeat(one, count) for name, one in self.metrics.items()}
        return CellFlights(np.repeat(self.lost, count), metrics, tuple(one.times(count) for one in self.others))

    @property
    def every(self) -> tuple["CellFlights", ...]:
        """The flights with the gains of each search."""
        return (self, *self.others)

    def ranked(self, name: str) -> Floats:
        """A metric in which a lost flight is worse than any other."""
        return np.where(self.lost, math.inf, self.metrics[name])

    def mean(self, name: str) -> float:
        """Of a metric over completed flights; NaN without any that has it."""
        values = self.metrics[name][~self.lost] if name in self.metrics else np.zeros(0)
        return float(values.mean()) if len(values) else math.nan

    def middle(self, name: str) -> int | None:
        """The place of the median flight; None where it is lost."""
        ranked = self.ranked(name)
        place = int(np.argsort(ranked, kind="stable")[(len(ranked) - 1) // 2])
        return None if self.lost[place] else place


class Spread(NamedTuple):
    """A metric of a cell. mean: over completed flights, NaN without any; median, high: quantiles of 50 % and 95 % of all."""

    mean: float
    median: Estimate
    high: Estimate


class Effort(NamedTuple):
    """Means over completed flights, NaN without any: energy [J], rotor activity [N/s], share of time at the rotors' limits."""

    energy: float
    activity: float
    saturation: float


def flown_of(table: pa.Table, campaign: Campaign) -> CellFlights:
    columns = {name: table[full].to_numpy(zero_copy_only=False) for name, full in campaign.thresholds.items()}
    metrics = {name: np.array(one, dtype=np.float64) for name, one in columns.items()}
    lost = np.any([table[OUTCOME].to_numpy() != OUTCOMES[0], *(~np.isfinite(one) for one in metrics.values())], axis=0)
    return CellFlights(lost, {name: np.where(lost, math.nan, values) for name, values in metrics.items()})


def spread(flown: CellFlights, name: str) -> Spread:
    ranked = [one.ranked(name) for one in flown.every]
    median, high = (hull([certain(one[0]) if flown.same else ordered_quantile(one, q) for one in ranked]) for q in (0.5, 0.95))
    return Spread(flown.mean(name), median, high)


def losses(flown: CellFlights) -> Estimate:
    """The share lost, with its exact interval."""
    return hull([certain(one.lost[0]) if flown.same else share(int(one.lost.sum()), len(one.lost)) for one in flown.every])


def certain(value: float) -> Estimate:
    """Of what is the same in every flight."""
    return Estimate(float(value), float(value), float(value))


def hull(estimates: Sequence[Estimate]) -> Estimate:
    """The first value, with an interval about those of all; unknown where one of them is."""
    low, high = np.array([one[1:] for one in estimates]).T
    return Estimate(estimates[0].value, float(low.min()), float(high.max()))


ALPHA = 1.0 - LEVEL

FEW = 50
"""Flights up to which Wilcoxon's test is exact."""


class Pair(NamedTuple):
    """Two controllers in a situation.

    difference: median of the first's metric less the second's, flight by flight, over those that both complete; NaN without
    any. better: share of flights in which the first is better, ties counting half. effect: rank-biserial correlation, from -1
    where the first is always better to 1. p: of Wilcoxon's test; p_lost: of McNemar's, each corrected by Holm. lost: share
    that the first loses less that of the second.
    """

    first: str
    second: str
    difference: Estimate
    better: float
    effect: float
    p: float
    lost: float
    p_lost: float

    @property
    def winner(self) -> str | None:
        """Who certainly tracks better; None where that is undecided."""
        return self.smaller(self.effect, self.p)

    @property
    def keeper(self) -> str | None:
        """Who certainly loses fewer flights; None where that is undecided."""
        return self.smaller(self.lost, self.p_lost)

    def other(self, name: str) -> str:
        return self.second if name == self.first else self.first

    def smaller(self, difference: float, p: float) -> str | None:
        decided = p < ALPHA and difference != 0.0
        return None if not decided else self.first if difference < 0.0 else self.second


class Ranked(NamedTuple):
    """The pairs of a situation. copies: whether its flights do not differ, so that nothing of them is statistical."""

    pairs: tuple[Pair, ...]
    copies: bool = False


def compare(flown: Mapping[str, CellFlights], metric: str) -> Ranked:
    """One situation, p-values not yet corrected. flown: by controller, the same flights of each.

    Several copies of one flight are one observation, which decides nothing.
    """
    same, most = all(map(alike, flown.values())), max(len(one.lost) for one in flown.values())
    flown = {name: one.times(most) for name, one in flown.items()}
    pairs = tuple(of_searches(one, other, flown[one], flown[other], metric) for one, other in combinations(flown, 2))
    if not same or all(one.lost.all() for one in flown.values()):
        return Ranked(pairs)
    return Ranked(tuple(pair._replace(p=1.0, p_lost=1.0) for pair in pairs), copies=True)


def alike(flown: CellFlights) -> bool:
    """Whether several flights of a controller do not differ, or would not."""
    columns = (flown.lost, *flown.metrics.values())
    equal = all(np.array_equal(one, np.full_like(one, one[0]), equal_nan=True) for one in columns)
    return flown.same or (len(flown.lost) > 1 and equal)


def of_searches(first: str, second: str, one: CellFlights, other: CellFlights, metric: str) -> Pair:
    """One pair over all searches for its gains: numbers of the best gains, decided by all of them."""
    found, *others = (pair(first, second, *both, metric) for both in product(one.every, other.every))
    if not others:
        return found
    every = (found, *others)
    return found._replace(
        difference=hull([each.difference for each in every]),
        p=max(each.p if each.effect * found.effect > 0.0 else 1.0 for each in every),
        p_lost=max(each.p_lost if each.lost * found.lost > 0.0 else 1.0 for each in every),
    )


def pair(first: str, second: str, one: CellFlights, other: CellFlights, metric: str) -> Pair:
    """One pair, its p-values not yet corrected."""
    gap = differences(one.ranked(metric), other.ranked(metric))
    apart, ranks = (one.metrics[metric] - other.metrics[metric])[~one.lost & ~other.lost], rankdata(np.abs(gap))
    wins, ties = int((gap < 0.0).sum()), int((gap == 0.0).sum())
    only_first, only_second = int((one.lost & ~other.lost).sum()), int((other.lost & ~one.lost).sum())
    discordant = only_first + only_second
    return Pair(
        first,
        second,
        quantile(apart, 0.5) if len(apart) else Estimate(math.nan, math.nan, math.nan),
        (wins + 0.5 * ties) / len(gap),
        float((np.sign(gap) * ranks).sum() / ranks.sum()),
        signed_ranks(gap),
        (only_first - only_second) / len(gap),
        float(binomtest(only_first, discordant, 0.5).pvalue) if discordant else 1.0,
    )


def differences(one: Floats, other: Floats) -> Floats:
    """Flight by flight: 0 where both are lost, infinite where one is."""
    with np.errstate(invalid="ignore"):
        return np.where(np.isinf(one) & np.isinf(other), 0.0, one - other)


def signed_ranks(gap: Floats) -> float:
    """The p-value of Wilcoxon's test, zeros as Pratt (1959) has them: of few flights exact, as ties make a normal
    approximation decide what they cannot. What is infinite ranks above all else; nothing but its rank counts.
    """
    if not gap.any():
        return 1.0
    sizes = rankdata(np.abs(gap))
    if len(gap) <= FEW:
        return exact_signed_ranks(sizes[gap != 0.0], sizes[gap > 0.0])
    return float(wilcoxon(np.sign(gap) * sizes, zero_method="pratt", method="asymptotic").pvalue)


def exact_signed_ranks(sizes: Floats, positive: Floats) -> float:
    """The chance that the sum of positive ranks is as far from its mean as here, if every sign is as likely as the other.

    sizes: all ranks, of which `positive` are those of positive differences; multiples of one half.
    """
    doubled = (2.0 * sizes).astype(int)
    chances = np.ones(1)
    for size in doubled:  # the distribution of twice the sum, rank by rank
        chances = 0.5 * (np.pad(chances, (0, size)) + np.pad(chances, (size, 0)))
    far = abs(2 * int(2.0 * positive.sum()) - int(doubled.sum()))
    return min(1.0, float(chances[np.abs(2 * np.arange(len(chances)) - doubled.sum()) >= far].sum()))


def corrected(situations: Sequence[Ranked]) -> list[Ranked]:
    """All situations of a study with the p-values of every pair corrected, tracking and losses each as a family."""
    tested = [one for one in situations if not one.copies]
    tracking = iter(holm([pair.p for one in tested for pair in one.pairs]))
    losing = iter(holm([pair.p_lost for one in tested for pair in one.pairs]))
    return [
        one
        if one.copies
        else one._replace(pairs=tuple(pair._replace(p=next(tracking), p_lost=next(losing)) for pair in one.pairs))
        for one in situations
    ]


def by_chance(searches: int) -> float:
    """The chance that so many searches for each of two equal controllers all rank the same way, whichever way that is."""
    return 2.0 / math.comb(2 * searches, searches)


def fewest(pairs: int) -> int:
    """Fewest flights with which any of so many pairs can differ significantly.

    Wilcoxon's and McNemar's tests of n flights give no p-value below 2^(1 - n), and Holm's correction multiplies the smallest
    by the number of pairs.
    """
    return math.floor(2.0 + math.log2(pairs / ALPHA))


def holm(ps: Sequence[float]) -> list[float]:
    """Holm's step-down correction."""
    found, order = np.array(ps), np.argsort(ps, kind="stable")
    found[order] = np.maximum.accumulate(np.minimum(1.0, np.arange(len(ps), 0, -1) * found[order]))
    return list(map(float, found))

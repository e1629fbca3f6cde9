"""How much each key explains: first-order variance-based indices, estimated from the flights as they are.

A key's index is Var(E[y | key]) / Var(y): the share of a result's variance that would vanish if the key were known. It is
estimated from given data by partition (Plischke, Borgonovo, Smith 2013): the flights are divided into parts by value of the
key, and the variance of the parts' means is compared with the total. Means of few flights differ by chance; that share is
subtracted (as in the adjusted R^2). Intervals: bootstrap over flights, in a thousand random blocks if there are more.
"""

import functools
import itertools
from collections.abc import Mapping
from statistics import NormalDist
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadstep.metrics.statistics import LEVEL, TAIL, Estimate

Numbers = NDArray[np.float64]
Places = NDArray[np.int64]

PARTS = 100
"""Most parts of equal count that the range of a number is divided into."""

A_PART, MANY, FINE = 10, 50, 20
"""Fewest flights per part, on average: of so many parts; of more, whose means differ more by chance."""

A_SIDE = 20
"""Most parts per key where two keys are examined together."""

BLOCKS, RESAMPLES = 1000, 500

ROUND_OFF = 1e-12
"""Relative to the numbers: less variation than this counts as none."""

EDGES_FROM = 100_000
"""Most flights that the edges of the parts are taken from: nearly equal counts do as well as equal ones."""


class FlightParts(NamedTuple):
    """Flights by similar values of a key. places: the part of each; size: number of parts; ordered: neighbours may join."""

    places: Places
    size: int
    ordered: bool

    def at_most(self, count: int) -> "FlightParts":
        """Neighbours joined, where that is allowed, until no more than `count` parts are left."""
        if not self.ordered or self.size <= count:
            return self
        return self._replace(places=self.places * count // self.size, size=count)


def parts_of(values: Numbers) -> FlightParts:
    """The parts of a key whose values are numbers, all finite."""
    sample = values
    if len(values) > EDGES_FROM:
        sample = values[np.random.default_rng(0).integers(0, len(values), EDGES_FROM)]
    edges = np.unique(np.quantile(sample, np.linspace(0.0, 1.0, PARTS + 1)[1:-1]))
    return FlightParts(np.searchsorted(edges, values, side="right"), len(edges) + 1, ordered=True)


class ExplainedResult:
    """A result of many flights, to be explained by the keys that varied. y: one finite number per flight, at least one."""

    def __init__(self, y: Numbers) -> None:
        self.y = y - y.mean() if np.ptp(y) > ROUND_OFF * np.abs(y).max() else np.zeros(len(y))
        self.flights = len(y)
        blocks = min(self.flights, BLOCKS)
        self.block = np.arange(self.flights)
        if self.flights > blocks:
            self.block = np.random.default_rng(0).permutation(self.flights) % blocks
        self.weights = resampled(blocks)
        self.squares = self.weights @ np.bincount(self.block, self.y**2, blocks)

    def explained(self, parts: FlightParts) -> Numbers:
        """Share of the variance that the parts explain: first the estimate, then those of resamples about it; NaN for none."""
        at, shape = self.block * parts.size + parts.places, (self.weights.shape[1], parts.size)
        counts = np.bincount(at, minlength=shape[0] * shape[1]).reshape(shape)
        sums = np.bincount(at, self.y, shape[0] * shape[1]).reshape(shape)
        raw, adjusted = ratios(self.weights @ counts, self.weights @ sums, self.squares)
        adjusted[1:] += adjusted[0] - raw[0]  # the truth of a resample is the sample, whose parts differ by chance too
        return adjusted

    def roughly(self, parts: FlightParts) -> float:
        """The first entry of `explained`, computed fast."""
        counts, sums = np.bincount(parts.places, minlength=parts.size), np.bincount(parts.places, self.y, parts.size)
        return float(ratios(counts[None], sums[None], self.squares[:1])[1][0])


@functools.lru_cache(maxsize=4)
def resampled(blocks: int) -> Numbers:
    """How often each block occurs in each sample: once in the first, in the others as often as it is drawn."""
    drawn = np.random.default_rng(1).multinomial(blocks, np.full(blocks, 1.0 / blocks), RESAMPLES)
    return np.concatenate([np.ones((1, blocks)), drawn])


def ratios(counts: Numbers | NDArray[np.intp], sums: Numbers | NDArray[np.intp], squares: Numbers) -> tuple[Numbers, Numbers]:
    """R^2 and adjusted R^2 of means of parts, one row per sample; NaN without variance, or with one part per flight."""
    flights, used = counts.sum(axis=1), (counts > 0.0).sum(axis=1)
    off = sums.sum(axis=1) ** 2 / flights
    whole, between = squares - off, (sums**2 / np.maximum(counts, 1.0)).sum(axis=1) - off
    known = (whole > ROUND_OFF * squares) & (flights > used)
    raw = np.where(known, between / np.where(known, whole, 1.0), np.nan)
    return raw, 1.0 - (1.0 - raw) * (flights - 1.0) / np.where(known, flights - used, 1.0)


def estimate(shares: Numbers) -> Estimate | None:
    """The first entry, with the interval from the others; within 0 and 1. None where the first is NaN."""
    if not np.isfinite(shares[0]):
        return None
    resampled = shares[1:][np.isfinite(shares[1:])]
    ends = np.quantile(resampled, [0.5 * (1.0 - LEVEL), 0.5 * (1.0 + LEVEL)]) if len(resampled) else np.array([0.0, 1.0])
    value, low, high = np.clip([shares[0], *ends], 0.0, 1.0).tolist()
    return Estimate(value, min(low, value), max(high, value))


def certain(one: Estimate, tests: int) -> bool:
    """Whether a share is above zero: the chance that any of so many that are not is said to be stays below `TAIL`."""
    wider = NormalDist().inv_cdf(TAIL / tests) / NormalDist().inv_cdf(TAIL)
    return one.low > 0.0 and one.value > wider * (one.value - one.low)


def first_order(result: ExplainedResult, keys: Mapping[str, FlightParts]) -> dict[str, Estimate]:
    """The index of each key, the largest first; keys with as many parts as flights are left out."""
    most = max(2, min(PARTS, max(min(FINE, result.flights // A_PART), result.flights // MANY)))
    found = {name: estimate(result.explained(parts.at_most(most))) for name, parts in keys.items()}
    known = {name: one for name, one in found.items() if one is not None}
    return dict(sorted(known.items(), key=lambda item: -item[1].value))


class Interaction(NamedTuple):
    """The strongest pair of keys: what they explain together beyond their own indices, and the number of pairs examined."""

    keys: tuple[str, str]
    share: Estimate
    pairs: int


def strongest_interaction(result: ExplainedResult, keys: Mapping[str, FlightParts]) -> Interaction | None:
    """The pair of keys that explains most beyond its two indices; None where there are too few flights or keys.

    For keys that are drawn independently of each other; correlated keys partly explain the same.
    """
    side = min(A_SIDE, int((result.flights / A_PART) ** 0.5))
    coarse = {name: parts.at_most(side) for name, parts in keys.items()}
    coarse = {name: parts for name, parts in coarse.items() if 1 < parts.size <= A_SIDE}
    if side < 3 or len(coarse) < 2:
        return None
    alone = {name: result.roughly(parts) for name, parts in coarse.items()}
    beyond = {
        (a, b): result.roughly(together(coarse[a], coarse[b])) - alone[a] - alone[b]
        for a, b in itertools.combinations(coarse, 2)
    }
    a, b = max(beyond, key=lambda pair: beyond[pair])
    shares = result.explained(together(coarse[a], coarse[b])) - result.explained(coarse[a]) - result.explained(coarse[b])
    share = estimate(shares)
    return Interaction((a, b), share, len(beyond)) if share else None


def together(a: FlightParts, b: FlightParts) -> FlightParts:
    """The parts of two keys at once."""
    return FlightParts(a.places * b.size + b.places, a.size * b.size, ordered=False)

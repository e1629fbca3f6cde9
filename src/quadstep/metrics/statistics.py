"""How certain a number is: intervals at 95 % for shares, means and quantiles of many flights.

The incomplete beta function is written out here because the core needs these intervals too, and runs without the extra that
brings SciPy; tests hold it against SciPy's.
"""

import math
from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

LEVEL = 0.95
TAIL = 0.5 * (1.0 - LEVEL)
"""The chance that an interval misses the truth on either side."""

NORMAL = 1.96
"""Half of a 95 % interval of a normal distribution, in standard deviations."""

RESAMPLES = 2000
AT_A_TIME = 2**16
"""Numbers drawn at a time: few enough for a processor's cache, however many flights there are."""

FEWEST = 6
"""Fewest values with an interval of their mean or median."""


class Estimate(NamedTuple):
    """A value and the interval that holds it with 95 % confidence; an end for which there are too few values is NaN."""

    value: float
    low: float
    high: float

    @property
    def bounded(self) -> bool:
        """Whether there are enough values for both ends of the interval."""
        return not (math.isnan(self.low) or math.isnan(self.high))

    def as_json(self) -> dict[str, float | None]:
        """For a file; an end that there is not is null."""
        return {name: finite(value) for name, value in self._asdict().items()}


def finite(value: float | None) -> float | None:
    """A number as JSON can hold it: None for NaN and infinity."""
    return None if value is None or not math.isfinite(value) else float(value)


def share(count: int, total: int) -> Estimate:
    """A share of flights with the exact interval of Clopper and Pearson (1934). Needs 0 <= count <= total, total >= 1."""
    return exact_share(count, total, TAIL)


def exact_share(count: int, total: int, tail: float) -> Estimate:
    """`share` with an interval that misses the truth on either side with at most this chance."""
    low = 0.0 if count == 0 else beta_quantile(tail, count, total - count + 1)
    high = 1.0 if count == total else beta_quantile(1.0 - tail, count + 1, total - count)
    return Estimate(count / total, low, high)


def mean(values: NDArray[np.float64]) -> Estimate:
    """The mean of independent values, with an interval that holds both its studentised bootstrap interval (Efron 1982) and
    Student's; the same on every call.

    Of skewed values a plain interval is too narrow: of 16 exponential ones 90 % hold the mean. The studentised bootstrap's is
    where a few values lie far off on both sides: of 150 changes of a position error by a gain that hardly acts, 76 % hold the
    mean, with Student's 94 %. Fewer than `FEWEST` values have no interval.
    """
    return means([values])[0]


def means(columns: Sequence[NDArray[np.float64]]) -> list[Estimate]:
    """`mean` of each of several columns. For those of one length, flights are drawn once, which takes half of the time."""
    found: dict[int, Estimate] = {}
    for count in set(map(len, columns)):
        places = [place for place, values in enumerate(columns) if len(values) == count]
        found |= zip(places, equally_many([columns[place] for place in places]), strict=True)
    return [found[place] for place in range(len(columns))]


def equally_many(columns: Sequence[NDArray[np.float64]]) -> list[Estimate]:
    """`means` of columns of the same length."""
    values, count = [float(one.mean()) for one in columns], len(columns[0])
    if count < FEWEST:
        return [Estimate(value, math.nan, math.nan) for value in values]
    spreads = [float(one.std(ddof=1)) for one in columns]
    random, apart, spread = np.random.default_rng(0), *np.zeros((2, len(columns), RESAMPLES))
    for some in np.array_split(np.arange(RESAMPLES), min(RESAMPLES, 1 + RESAMPLES * count // AT_A_TIME)):
        chosen = random.integers(0, count, (len(some), count))
        for place, one in enumerate(columns):
            if spreads[place] != 0.0:
                drawn = one.take(chosen)
                apart[place, some], spread[place, some] = drawn.mean(axis=1) - values[place], drawn.std(axis=1, ddof=1)
    wide = student_quantile(1.0 - TAIL, count - 1) / math.sqrt(count)
    return [studentised(*one, wide) for one in zip(values, spreads, apart, spread, strict=True)]


def mean_growth(before: NDArray[np.float64], after: NDArray[np.float64]) -> Estimate:
    """By what share the mean of the second is above that of the first, of the same flights. Its interval is Fieller's (1954):
    every share g for which `mean` of after - (1 + g) before may be 0. It has none where the first mean may be 0.
    """
    base = mean(before)
    low = high = value = float(after.mean()) / base.value - 1.0
    if not base.low > 0.0:
        return Estimate(value, math.nan, math.nan)
    for _ in range(50):
        below, above = means([after - (1.0 + end) * before for end in (low, high)])
        low, high = low + below.low / base.value, high + above.high / base.value
        if max(abs(below.low), abs(above.high)) <= 1e-6 * base.value:
            break
    return Estimate(value, low, high)


def studentised(
    value: float, spread: float, apart: NDArray[np.float64], spreads: NDArray[np.float64], wide: float
) -> Estimate:
    """A mean with its interval. spread: of the values. apart: means of resamples from it; spreads: of their values. wide: half
    of Student's interval, in spreads.
    """
    away = np.where(apart == 0.0, 0.0, np.copysign(math.inf, apart))  # where all drawn values are equal, but for rounding
    away = np.divide(apart, spreads, out=away, where=spreads > 1e-9 * spread)
    below, above = np.sort(away)[[math.floor(0.5 * (1.0 - LEVEL) * RESAMPLES), math.ceil(0.5 * (1.0 + LEVEL) * RESAMPLES) - 1]]
    if spread == 0.0:
        return Estimate(value, value, value)
    return Estimate(value, value - max(float(above), wide) * spread, value - min(float(below), -wide) * spread)


def share_difference(gained: int, lost: int, total: int) -> Estimate:
    """The change of a share between two treatments of the same flights, of which some succeed only with the second, others
    only with the first. Its interval is that of both exact shares jointly. Needs total >= 1.
    """
    tail = 0.25 * (1.0 - LEVEL)
    up, down = exact_share(gained, total, tail), exact_share(lost, total, tail)
    return Estimate(up.value - down.value, up.low - down.high, up.high - down.low)


def quantile(values: NDArray[np.float64], q: float, tail: float = TAIL) -> Estimate:
    """A quantile, linear between order statistics, with the interval of `ordered_quantile`. Needs a finite value."""
    return ordered_quantile(values, q, tail)._replace(value=float(np.quantile(values, q)))


def quantile_increase(before: NDArray[np.float64], after: NDArray[np.float64], q: float) -> tuple[Estimate, Estimate]:
    """What a quantile of the second is above that of the first, whether they are paired or not, and that as a share of the
    first, which is above 0. Intervals are those of both quantiles jointly.
    """
    one, other = (quantile(values, q, 0.25 * (1.0 - LEVEL)) for values in (before, after))
    by = Estimate(other.value - one.value, other.low - one.high, other.high - one.low)
    return by, Estimate(other.value / one.value - 1.0, other.low / one.high - 1.0, other.high / one.low - 1.0)


def ordered_quantile(values: NDArray[np.float64], q: float, tail: float = TAIL) -> Estimate:
    """A quantile as one of the values, or a median as the mean of the middle two where both are finite. Its interval, between
    two of the values, is free of distribution and exact (Conover 1999).

    Values may be infinite; an end of the interval for which there are too few values is NaN. tail: the chance that it misses
    the truth on either side. Needs at least one value.
    """
    ordered, count = np.sort(values), len(values)
    low, high = ranks_about(count, q, tail)
    value = ordered[max(0, math.ceil(count * q) - 1)]
    return Estimate(
        float(0.5 * (value + above) if q == 0.5 and math.isfinite(above := ordered[count // 2]) else value),
        float(ordered[low - 1]) if low >= 1 else math.nan,
        float(ordered[high - 1]) if high <= count else math.nan,
    )


@cache
def ranks_about(count: int, q: float, tail: float) -> tuple[int, int]:
    """Ranks, from 1, of the values between which a quantile of so many lies; 0 or count + 1 where there is no such value."""
    return binomial_quantile(tail, count, q), binomial_quantile(1.0 - tail, count, q) + 1


def binomial_quantile(p: float, count: int, q: float) -> int:
    """The fewest successes k of so many trials, each of chance q, with P(X <= k) >= p."""
    low, high = -1, count
    while high - low > 1:
        k = (low + high) // 2
        low, high = (low, k) if incomplete_beta(1.0 - q, count - k, k + 1) >= p else (k, high)
    return high


def beta_quantile(p: float, a: float, b: float) -> float:
    """x with I_x(a, b) = p, by bisection."""
    low, high = 0.0, 1.0
    while high - low > 1e-15 * max(high, 1e-300):
        middle = 0.5 * (low + high)
        if middle in (low, high):
            break
        low, high = (middle, high) if incomplete_beta(middle, a, b) < p else (low, middle)
    return 0.5 * (low + high)


def incomplete_beta(x: float, a: float, b: float) -> float:
    """The regularised incomplete beta function I_x(a, b), by its continued fraction (Abramowitz and Stegun 26.5.8)."""
    if x <= 0.0 or x >= 1.0:
        return float(x >= 1.0)
    if x > (a + 1.0) / (a + b + 2.0):
        return 1.0 - incomplete_beta(1.0 - x, b, a)
    front = math.exp(math.lgamma(a + b) - math.lgamma(a) - math.lgamma(b) + a * math.log(x) + b * math.log1p(-x))
    tiny, c, d = 1e-300, 1.0, 1.0 - (a + b) * x / (a + 1.0)
    d = 1.0 / (d if abs(d) > tiny else tiny)
    fraction = d
    for m in range(1, 100_000):
        for term in (
            m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m)),
            -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1)),
        ):
            d, c = 1.0 + term * d, 1.0 + term / c
            d, c = 1.0 / (d if abs(d) > tiny else tiny), c if abs(c) > tiny else tiny
            fraction *= d * c
        if abs(d * c - 1.0) < 1e-15:
            break
    return front * fraction / a


@cache
def student_quantile(p: float, freedom: float) -> float:
    """x below which Student's t with so many degrees of freedom lies with probability p, 0.5 <= p < 1."""
    share = beta_quantile(2.0 * p - 1.0, 0.5, 0.5 * freedom)
    return math.sqrt(freedom * share / max(1.0 - share, 1e-300))

"""Intervals of shares and quantiles hold the truth as often as they say, on draws with known answers."""

from collections.abc import Iterator

import numpy as np

from quadstep.metrics import statistics
from quadstep.studies.tuning.objective import increase
from tests.challenge.search import Search, covers

SIZES = (6, 10, 30, 100, 1000)


def shares(random: np.random.Generator) -> Iterator[bool]:
    while True:
        total, p = int(random.choice(SIZES)), float(random.beta(0.3, 0.3))
        found = statistics.share(int(random.binomial(total, p)), total)
        yield found.low <= p <= found.high


def quantiles(random: np.random.Generator) -> Iterator[bool]:
    """Of heavy-tailed, skewed and two-humped draws."""

    many = np.exp(3.0 * random.normal(size=4_000_000)) + 5.0 * (random.random(4_000_000) < 0.3)
    truths = {q: float(np.quantile(many, q)) for q in (0.5, 0.9, 0.95)}
    while True:
        count, q = int(random.choice(SIZES)), float(random.choice([0.5, 0.9, 0.95]))
        values = np.exp(3.0 * random.normal(size=count)) + 5.0 * (random.random(count) < 0.3)
        truth = truths[q]
        found = statistics.quantile(values, q)
        yield not (found.low > truth or found.high < truth)


def means(random: np.random.Generator) -> Iterator[bool]:
    """Of symmetric, skewed and two-humped draws, and some with a few far off; heavier tails are beyond any interval."""
    while True:
        count = int(random.choice(SIZES[1:4]))
        humps = random.normal(size=count) + 3.0 * (random.random(count) < 0.5)
        far = np.where(random.random(count) < 0.05, 1.0, 1e-3) * random.normal(size=count)
        draws = ((random.normal(size=count), 0.0), (random.exponential(size=count), 1.0), (humps, 1.5), (far, 0.0))
        values, truth = draws[int(random.integers(4))]
        found = statistics.mean(values)
        yield found.low <= truth <= found.high


def share_differences(random: np.random.Generator) -> Iterator[bool]:
    while True:
        total, (gain, loss) = int(random.choice(SIZES)), 0.5 * random.random(2) ** 3
        gained, lost, _ = random.multinomial(total, [gain, loss, 1.0 - gain - loss])
        found = statistics.share_difference(int(gained), int(lost), total)
        yield found.low <= gain - loss <= found.high


def changes(random: np.random.Generator) -> Iterator[bool]:
    """Of the objective of tuned gains: paired flights, skewed, some of which change far more than others."""
    shift = {"mean": 0.5, "p95": 0.5}

    def pairs(count: int) -> tuple[np.ndarray, np.ndarray]:
        before = random.exponential(size=count)
        return before, np.where(random.random(count) < 0.5, before, random.exponential(size=count)) + 0.5

    many = pairs(4_000_000)
    grown = {"mean": 0.5, "p95": float(np.divide(*(np.quantile(one, 0.95) for one in many[::-1]))) - 1.0}
    while True:
        kind = str(random.choice(list(shift)))
        found = increase(kind, *pairs(int(random.choice(SIZES[1:]))))
        truth = shift[kind], grown[kind]
        place = int(random.integers(2))
        yield not (found[place].low > truth[place] or found[place].high < truth[place])


SEARCHES = [
    Search("interval of what tuning gains", "the interval of a change of the objective holds it", covers(changes, 0.93)),
    Search(
        "interval of a mean", "of 95 % intervals of a mean at least 93 % hold it, also of skewed values", covers(means, 0.93)
    ),
    Search(
        "interval of a gain in successes",
        "the 95 % interval of a paired difference of shares holds it",
        covers(share_differences),
    ),
    Search("interval of a share", "the 95 % interval of a share of flights holds the true share", covers(shares)),
    Search("interval of a quantile", "the 95 % interval of a quantile holds the true quantile", covers(quantiles)),
]

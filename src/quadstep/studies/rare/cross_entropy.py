"""Importance sampling from mixtures of normal distributions, fitted by cross-entropy (Rubinstein and Kroese 2004; mixtures:
Geyer, Papaioannou and Straub 2019).

All flights that a replicate has flown are one sample, weighted by the ratio of the campaign's density to the mean of all
densities from which they were drawn (deterministic mixture, Owen and Zhou 2000). A level is the highest threshold that
enough of them reach, by effective size; a mixture fitted to these draws the next flights. The estimate is made from flights
that no fit has seen. Noise is drawn as in any flight, so the weight of a flight is the ratio of the densities of its latent
numbers. The first flights are drawn as the campaign draws, and as many wider (scaled-sigma sampling, Sun, Li, Liu, Luo and Gu
2015): no score steers these, so they find failures that the score says nothing of. A share of all others is drawn as the
campaign draws, so every failure can be drawn: given that an earlier flight failed, the estimate is unbiased whatever the fits
and the noise do. Without one it is zero.
"""

import math
from typing import NamedTuple

import numpy as np

from quadstep.studies.rare.mixture import Evaluate, Floats, Mixture, Points, Random, fitted, log_standard, pooled, standard

LEAST = 1e-12
"""Probability below which a replicate gives up."""

NEGLIGIBLE = 0.01
"""Share of the other events' probability below which an event need not be followed further."""

MOST_KEPT = 0.5
"""Share of flights beyond a threshold above which a score with few distinct values makes no progress."""


class Level(NamedTuple):
    """A nested event: the score is at least the threshold, or the flight fails; None: it fails. With its probability."""

    threshold: float | None
    probability: float


class Replicate(NamedTuple):
    """A replicate. probability: 0 if no failure was reached. crude: flights drawn as the campaign draws, and which of them
    failed. failures: some flights that failed. weights: their parts of the probability.
    """

    probability: float
    crude: int
    crude_failures: Points
    levels: tuple[Level, ...]
    failures: Points
    weights: Floats


def beyond(scores: Floats, share: float) -> float:
    """A threshold that about this share of the scores reaches; equal scores all count or none, whichever is closer."""
    values, counts = np.unique(scores, return_counts=True)
    reached = np.cumsum(counts[::-1])[::-1] / len(scores)
    return float(values[np.argmin(np.abs(np.log(reached / share)))])


SHARE = 0.2
"""Effective size of what a mixture is fitted to, as a multiple of the flights of a fit."""

FITS_TO_FAILURES = 2
"""Fits to failures, the last of which the estimate draws from."""

LAST = 6
"""Flights that the estimate is made from, as a multiple of those of a fit."""

STEP = 0.2
"""Variance of the step from a fit to what is drawn from. With a fit equal to the failures' own distribution, the weight of a
failure is the sought probability divided by the probability that such a step from it ends in failure: steady even where the
fit's own weights grow without bound, far out.
"""

DEFENSIVE = 0.1
"""Share of the flights that are drawn as the campaign draws: no weight exceeds its inverse (Hesterberg 1995)."""

EARLIER = 0.2
"""Share of the estimate's flights drawn from all earlier fits. These are wider: failures that the last fit misses are rare
among flights drawn as the campaign draws, and a single one would outweigh all others.
"""

REACH = 4.5
"""Distance from the origin that wide flights have on average: failures of 1e-5 begin there."""

LEAST_WIDE, MOST_WIDE = 1.2, 3.0
"""Their standard deviation is between these, whatever the number of keys."""

MOST_FITS = 30
SLOW, GAINS = 3, 0.25
"""Levels over which the probability must fall to this share: if it does not, the keys hardly decide, and steering ends."""


class Proposal:
    """What flights are drawn from: a fitted mixture after a step, and a share as the campaign draws."""

    def __init__(self, fit: Mixture) -> None:
        self.fit, self.wide = fit, fit.stepped(STEP)

    def points(self, random: Random, count: int) -> Points:
        fresh = random.points(count)
        uniform = random.uniform(fresh)
        steered = self.wide.moved(fresh.latent, (uniform - DEFENSIVE) / (1.0 - DEFENSIVE))
        return fresh._replace(latent=np.where((uniform < DEFENSIVE)[:, None], fresh.latent, steered))

    def log_density(self, latent: Floats) -> Floats:
        """Logarithm of the density, up to the constant that standard normal numbers share."""
        steered = math.log(1.0 - DEFENSIVE) + self.wide.log_density(latent)
        return np.logaddexp(math.log(DEFENSIVE) + log_standard(latent), steered)


class SampledFlights:
    """All flights of a replicate so far. scores: shape (events, flights)."""

    def __init__(self, evaluate: Evaluate, random: Random, size: int) -> None:
        self.evaluate, self.random, self.size = evaluate, random, size
        first = random.points(size)
        self.latent, self.scores = first.latent, evaluate(first)
        self.drawings, self.log_total = list[Proposal](), log_standard(self.latent)
        self.crude = [first.at(failed) for failed in np.isinf(self.scores)]
        self.add(Proposal(wide(random.dimensions)))

    def add(self, drawing: Proposal) -> None:
        points = drawing.points(self.random, self.size)
        self.drawings.append(drawing)
        mine = [log_standard(points.latent), *(one.log_density(points.latent) for one in self.drawings)]
        theirs = np.logaddexp(self.log_total, drawing.log_density(self.latent))
        self.log_total = np.concatenate([theirs, np.logaddexp.reduce(mine, axis=0)])
        self.latent = np.concatenate([self.latent, points.latent])
        self.scores = np.concatenate([self.scores, self.evaluate(points)], axis=1)

    @property
    def weights(self) -> Floats:
        """Campaign's density over that of the sample, divided by their number: their sum over an event is its probability."""
        return np.exp(log_standard(self.latent) - self.log_total) / self.size

    def probability(self, event: int) -> float:
        """Of failure of this kind. Slightly low: the fits have seen these flights."""
        return float(self.weights @ np.isinf(self.scores[event]))


def cross_entropy(evaluate: Evaluate, events: int, random: Random, size: int) -> list[Replicate]:
    """One replicate of each kind of failure, with `size` flights for each fit. If none was found, no estimate is made."""
    sample = SampledFlights(evaluate, random, size)
    crude, fits, levels, shares = sample.crude, list[Mixture](), list[list[Level]](), list[float]()
    for event in range(events):
        fit, steps = steered(sample, event, max(LEAST, NEGLIGIBLE * sum(shares)))
        fits.append(fit)
        levels.append(steps)
        shares.append(sample.probability(event))
    failed, points, weights = np.zeros((events, 0), dtype=np.bool_), random.points(0), np.zeros(0)
    if any(shares):
        earlier = [one.fit for one in sample.drawings]
        drawing = Proposal(
            pooled([pooled(fits, shares), *earlier], [1.0 - EARLIER, *(EARLIER / len(earlier) for _ in earlier)])
        )
        points = drawing.points(random, LAST * size)
        failed = np.isinf(evaluate(points))
        weights = np.exp(log_standard(points.latent) - drawing.log_density(points.latent)) / len(points.noise)
    return [
        Replicate(probability, size, few, (*steps, Level(None, probability)), points.at(own), weights[own])
        for probability, few, steps, own in zip((failed @ weights).tolist(), crude, levels, failed, strict=True)
    ]


def wide(dimensions: int) -> Mixture:
    """Normal numbers that scatter so far that they reach failures, where there are few dimensions."""
    deviation = min(MOST_WIDE, max(LEAST_WIDE, REACH / math.sqrt(dimensions)))
    one = standard(dimensions)
    return one._replace(factors=deviation * one.factors)


def steered(sample: SampledFlights, event: int, least: float) -> tuple[Mixture, list[Level]]:
    """A fit to failures of one kind, or to what comes closest, and the levels on the way. least: where it gives up."""
    fit, levels, reached = standard(sample.latent.shape[1]), list[Level](), 0
    for _ in range(MOST_FITS):
        scores, weights = sample.scores[event], sample.weights
        threshold = highest(scores, weights, SHARE * sample.size)
        hit = scores >= threshold
        probability = float(weights @ hit)
        failing = math.isinf(threshold)
        if probability > MOST_KEPT * weights.sum() or not (failing or probability >= least):
            break
        levels.append(Level(None if failing else threshold, probability))
        fit = fitted(sample.latent[hit], weights[hit])
        reached += failing
        slow = len(levels) > SLOW and probability > GAINS * levels[-1 - SLOW].probability
        if reached == FITS_TO_FAILURES or (slow and not failing):
            break
        sample.add(Proposal(fit))
    return fit, levels


def highest(scores: Floats, weights: Floats, least: float) -> float:
    """The highest threshold that flights of at least this effective size reach; the lowest score if there is none."""
    order = np.argsort(-scores, kind="stable")
    ranked, first, second = scores[order], np.cumsum(weights[order]), np.cumsum(weights[order] ** 2)
    ends = np.append(ranked[1:] != ranked[:-1], True)
    enough = np.flatnonzero(ends & (first * first >= least * second))
    return float(ranked[enough[0]] if len(enough) else ranked[-1])

"""Importance sampling from a normal distribution fitted to the failures by cross-entropy (Rubinstein and Kroese 2004).

The latent numbers are drawn from the fitted distribution, noise as in any flight, so each flight's weight is the ratio of
the densities of its latent numbers, and the estimate is unbiased whatever the noise does.
"""

import math
from typing import NamedTuple

import numpy as np

from quadstep.rare.points import Evaluate, Floats, Points, Random
from quadstep.rare.replicate import LEAST, MOST_KEPT, Level, Replicate, beyond

SHARE = 0.1
"""Share of the flights that a distribution is fitted to."""

MOST_FITS = 20
LAST = 3
"""Flights that the estimate is made from, as a multiple of those of a fit."""

FLOOR, WIDER = 0.05, 1.3
"""Variance added to a fit in every direction, and factor on the covariance that the estimate draws from."""

DEFENSIVE = 0.1
"""Share of the last flights that are drawn as the campaign draws: no weight exceeds its inverse (Hesterberg 1995)."""


class Fit(NamedTuple):
    """A normal distribution. factor: lower triangular factor of its covariance."""

    mean: Floats
    factor: Floats

    def moved(self, latent: Floats) -> Floats:
        """Standard normal numbers as draws of this distribution."""
        return self.mean + latent @ self.factor.T

    def log_density(self, latent: Floats) -> Floats:
        """Logarithm of its density, up to the constant that standard normal numbers share."""
        scaled = np.linalg.solve(self.factor, (latent - self.mean).T).T
        return standard(np.asarray(scaled, dtype=np.float64)) - float(np.log(np.diag(self.factor)).sum())


def standard(latent: Floats) -> Floats:
    """Logarithm of the density of standard normal numbers, up to that constant."""
    density: Floats = -0.5 * (latent * latent).sum(axis=1)
    return density


def cross_entropy(evaluate: Evaluate, random: Random, size: int, least: float = LEAST) -> Replicate:
    """One replicate with `size` flights in each fit. least: the probability below which it gives up."""
    one = np.eye(random.dimensions)
    fit, levels, flights, crude = Fit(np.zeros(random.dimensions), one), list[Level](), 0, 0
    reached = False
    for turn in range(MOST_FITS):
        fresh = random.points(size)
        points = Points(fit.moved(fresh.latent), fresh.noise)
        scores = evaluate(points)
        flights += size
        failed = np.isinf(scores)
        crude = int(failed.sum()) if turn == 0 else crude
        weights = np.exp(standard(points.latent) - fit.log_density(points.latent))
        enough = float(failed.mean()) >= SHARE
        hit = failed if enough else scores >= beyond(scores, SHARE)
        threshold = None if enough else float(scores[hit].min())
        levels.append(Level(threshold, float((weights * hit).mean())))
        if not enough and (hit.mean() > MOST_KEPT or levels[-1].probability < least):
            return Replicate(0.0, flights, size, crude, tuple(levels), points.at(failed))
        fit = fitted(points.latent[hit], weights[hit])
        if enough and reached:
            break
        reached = enough
    wide = Fit(fit.mean, math.sqrt(WIDER) * fit.factor)
    fresh = random.points(LAST * size)
    latent = np.where((random.uniform(fresh) < DEFENSIVE)[:, None], fresh.latent, wide.moved(fresh.latent))
    points = Points(latent, fresh.noise)
    failed = np.isinf(evaluate(points))
    natural = standard(latent)
    mixed = np.logaddexp(math.log(DEFENSIVE) + natural, math.log(1.0 - DEFENSIVE) + wide.log_density(latent))
    probability = float((np.exp(natural - mixed) * failed).mean())
    return Replicate(probability, flights + len(latent), size, crude, (*levels, Level(None, probability)), points.at(failed))


def fitted(latent: Floats, weights: Floats) -> Fit:
    """The normal distribution with the least cross-entropy to the weighted points, its covariance shrunk if they are few."""
    shares = weights / weights.sum()
    mean = shares @ latent
    apart = latent - mean
    effective, dimensions = 1.0 / float((shares * shares).sum()), latent.shape[1]
    trust = effective / (effective + 2.0 * dimensions)
    covariance = trust * ((shares[:, None] * apart).T @ apart) + (1.0 - trust + FLOOR) * np.eye(dimensions)
    return Fit(mean, np.linalg.cholesky(covariance))

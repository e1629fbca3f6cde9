"""Mixtures of normal distributions, fitted to weighted points by expectation maximisation (Dempster, Laird and Rubin 1977).

The number of parts is the one with the best Bayesian information criterion (Schwarz 1978), in which points count by the
effective size of their weighted sample (Kong 1992).
"""

import math
from collections.abc import Callable
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from quadstep.numbers.noise import normals, uniforms
from quadstep.studies.campaign.draws import A_TICK, STREAM, noise_keys

FIRST = 2**31
"""The first flight's number, beyond those of campaigns."""

A_REPLICATE = 2**24
"""Flight numbers reserved for each replicate, more than it can use."""

LATENT, CHOSEN = STREAM + 1, STREAM + 2
"""Streams of random numbers: for the points, and for the choices made with them."""

Numbers: TypeAlias = NDArray[np.int64]
Floats: TypeAlias = NDArray[np.float64]


class Points(NamedTuple):
    """latent: shape (flights, dimensions); noise: the number of the flight whose noise each of them gets."""

    latent: Floats
    noise: Numbers

    def at(self, places: NDArray[np.bool_] | Numbers) -> "Points":
        return Points(self.latent[places], self.noise[places])


def joined(some: list[Points]) -> Points:
    return Points(np.concatenate([one.latent for one in some]), np.concatenate([one.noise for one in some]))


Evaluate: TypeAlias = Callable[[Points], Floats]
"""How close to each kind of failure each flight came, infinite where it failed so. Shape (events, flights)."""


class Random:
    """The random numbers of one replicate: each flight that it requests has a number, which determines all of them."""

    def __init__(self, seed: int, replicate: int, dimensions: int) -> None:
        self.seed, self.replicate, self.dimensions = seed, replicate, dimensions
        self.next = FIRST + replicate * A_REPLICATE

    def after(self, places: int) -> "Random":
        return Random(self.seed, self.replicate + places, self.dimensions)

    def points(self, count: int) -> Points:
        numbers = np.arange(self.next, self.next + count)
        self.next += count
        keys, ticks = noise_keys(self.seed, numbers), range(-(-self.dimensions // A_TICK))
        columns = [
            column
            for tick in ticks
            for column in normals(keys, LATENT, float(tick), min(A_TICK, self.dimensions - tick * A_TICK))
        ]
        return Points(np.stack(columns, axis=1), numbers)

    def uniform(self, points: Points) -> Floats:
        """A number in (0, 1) for each new point."""
        (chosen,) = uniforms(noise_keys(self.seed, points.noise), CHOSEN, 0.0, 1)
        return np.asarray(chosen, dtype=np.float64)


MOST_PARTS = 12
TRIES = 2
"""Numbers of parts that are tried beyond the best so far."""

MOST_TURNS, GAIN = 40, 1e-3
"""Turns of a fit, which ends when the mean log density rises by less than the gain."""

PRIOR = 2.0
"""Weight of the identity in every covariance, in points per dimension: with few points nothing is concluded from them."""

GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)
"""Its multiples modulo 1 are evenly spread: they choose the first centres."""


class Mixture(NamedTuple):
    """shares: of each part; means: shape (parts, dimensions); factors: lower triangular factors of their covariances."""

    shares: Floats
    means: Floats
    factors: Floats

    def moved(self, latent: Floats, uniform: Floats) -> Floats:
        """Standard normal and uniform numbers as draws of this distribution."""
        part = np.searchsorted(np.cumsum(self.shares)[:-1], uniform * self.shares.sum())
        moved: Floats = self.means[part]
        for place, factor in enumerate(self.factors):
            own = part == place
            moved[own] += latent[own] @ factor.T
        return moved

    def log_parts(self, latent: Floats) -> Floats:
        """Logarithm of the density of each part, times its share, up to the constant that standard normal numbers share."""
        parts = []
        for share, mean, factor in zip(self.shares, self.means, self.factors, strict=True):
            scaled = np.linalg.solve(factor, (latent - mean).T).T
            parts.append(math.log(share) + log_standard(scaled) - float(np.log(np.diag(factor)).sum()))
        return np.array(parts)

    def log_density(self, latent: Floats) -> Floats:
        """Logarithm of its density, up to that constant."""
        return np.logaddexp.reduce(self.log_parts(latent), axis=0)

    def stepped(self, step: float) -> "Mixture":
        """Its distribution after a step of a Markov chain that keeps standard normal numbers standard normal:
        sqrt(1 - step) of each number, plus a standard normal one of variance step.
        """
        covariances = (1.0 - step) * self.factors @ self.factors.transpose(0, 2, 1) + step * np.eye(self.means.shape[1])
        factors = np.linalg.cholesky(covariances).astype(np.float64)
        return Mixture(self.shares, math.sqrt(1.0 - step) * self.means, factors)


def log_standard(latent: Floats) -> Floats:
    """Logarithm of the density of standard normal numbers, up to that constant."""
    return -0.5 * (latent * latent).sum(axis=1)


def standard(dimensions: int) -> Mixture:
    return Mixture(np.ones(1), np.zeros((1, dimensions)), np.eye(dimensions)[None])


def pooled(mixtures: list[Mixture], shares: list[float]) -> Mixture:
    total, some = sum(shares), [(one, share) for one, share in zip(mixtures, shares, strict=True) if share > 0.0]
    return Mixture(
        np.concatenate([one.shares * (share / total) for one, share in some]),
        np.concatenate([one.means for one, _ in some]),
        np.concatenate([one.factors for one, _ in some]),
    )


def effective(weights: Floats) -> float:
    """Effective size of a weighted sample (Kong 1992)."""
    return float(weights.sum()) ** 2 / float((weights * weights).sum())


def fitted(latent: Floats, weights: Floats) -> Mixture:
    """The mixture with the best information criterion for the weighted points."""
    best, highest, wanted = standard(latent.shape[1]), -math.inf, 1
    for parts in range(1, min(MOST_PARTS, len(latent)) + 1):
        if parts > wanted + TRIES:
            break
        one, criterion = fitted_with(parts, latent, weights)
        if criterion > highest:
            best, highest, wanted = one, criterion, parts
    return best


def fitted_with(parts: int, latent: Floats, weights: Floats) -> tuple[Mixture, float]:
    """The fit with at most some number of parts, and its information criterion: log-likelihood less the penalty."""
    dimensions, shares = latent.shape[1], weights / weights.sum()
    count, before = effective(weights), -math.inf
    centres = latent[first_centres(parts, latent, shares)]
    belongs = np.eye(len(centres))[nearest(latent, centres)].T
    for _ in range(MOST_TURNS):
        owned = belongs * shares
        mass = owned.sum(axis=1)
        owned = owned[mass * count > min(2.0, 0.5 * mass.max() * count)]
        mixture = maximised(latent, owned, count)
        densities = mixture.log_parts(latent)
        whole = np.logaddexp.reduce(densities, axis=0)
        now = float(shares @ whole)
        belongs = np.exp(densities - whole)
        if now - before < GAIN:
            break
        before = now
    parameters = len(mixture.shares) * (1.0 + dimensions + 0.5 * dimensions * (dimensions + 1)) - 1.0
    return mixture, count * now - 0.5 * parameters * math.log(max(count, 2.0))


def maximised(latent: Floats, owned: Floats, count: float) -> Mixture:
    """The mixture whose parts are the normal distributions of the points that each owns. owned: shape (parts, points)."""
    dimensions = latent.shape[1]
    mass, prior = owned.sum(axis=1), PRIOR * dimensions
    means = owned @ latent / mass[:, None]
    factors = list[Floats]()
    for mean, own, part in zip(means, owned, mass, strict=True):
        apart = latent - mean
        scatter = (own[:, None] * apart).T @ apart * count + prior * np.eye(dimensions)
        factors.append(np.linalg.cholesky(scatter / (part * count + prior)))
    return Mixture(mass / mass.sum(), means, np.array(factors))


def first_centres(parts: int, latent: Floats, shares: Floats) -> list[int]:
    """Points spread as by k-means++ (Arthur and Vassilvitskii 2007), each chosen by its weight and squared distance."""
    chosen, weights = list[int](), shares
    for place in range(parts):
        upto = np.cumsum(weights)
        chosen.append(int(np.searchsorted(upto, (place + 1) * GOLDEN % 1.0 * upto[-1])))
        away = ((latent - latent[chosen[-1]]) ** 2).sum(axis=1) * shares
        weights = away if place == 0 else np.minimum(weights, away)
        if not weights.any():
            break
    return chosen


def nearest(latent: Floats, centres: Floats) -> Numbers:
    """Index of the nearest centre to each point."""
    away = np.array([((latent - centre) ** 2).sum(axis=1) for centre in centres])
    return np.asarray(away.argmin(axis=0), dtype=np.int64)

"""Mixtures that steer flights, and the weights that correct for it."""

import math
from itertools import pairwise

import numpy as np
import pytest

from quadstep.numbers.noise import probability
from quadstep.studies.rare.cross_entropy import (
    DEFENSIVE,
    LAST,
    LEAST,
    SLOW,
    Proposal,
    SampledFlights,
    cross_entropy,
    highest,
    steered,
)
from quadstep.studies.rare.mixture import Mixture, Random, effective, fitted, fitted_with, log_standard, pooled, standard

LEANING = Mixture(
    np.array([0.3, 0.7]), np.array([[2.0, 1.0], [-1.0, 0.5]]), np.array([[[0.6, 0.0], [0.5, 1.2]], [[1.1, 0.0], [-0.4, 0.5]]])
)
"""Two parts, both correlated."""


def drawn(mixture, count=20_000):
    """Draws of it."""
    random = np.random.default_rng(3)
    return mixture.moved(random.standard_normal((count, 2)), random.random(count))


def test_draws_have_the_density_that_is_said_of_them():
    """The mean weight is 1, and weighted draws are standard normal: in mean, variance and correlation."""
    wide = pooled([LEANING, standard(2)], [0.5, 0.5])
    points = drawn(wide)
    weights = np.exp(log_standard(points) - wide.log_density(points))
    assert weights.mean() == pytest.approx(1.0, abs=0.03)
    assert (weights[:, None] * points).mean(axis=0) == pytest.approx(np.zeros(2), abs=0.03)
    assert (points.T * weights) @ points / len(points) == pytest.approx(np.eye(2), abs=0.05)


def test_draws_have_the_moments_of_the_parts():
    points = drawn(LEANING)
    assert points.mean(axis=0) == pytest.approx(LEANING.shares @ LEANING.means, abs=0.03)
    second = sum(
        share * (factor @ factor.T + np.outer(mean, mean))
        for share, mean, factor in zip(LEANING.shares, LEANING.means, LEANING.factors, strict=True)
    )
    assert points.T @ points / len(points) == pytest.approx(second, abs=0.06)


def test_a_step_leaves_what_is_standard_normal_and_moves_the_rest_towards_it():
    same = standard(3).stepped(0.2)
    assert (same.means, same.factors) == (pytest.approx(np.zeros((1, 3))), pytest.approx(np.eye(3)[None]))
    near = LEANING.stepped(0.19)
    assert near.means == pytest.approx(0.9 * LEANING.means)
    covariance = LEANING.factors[0] @ LEANING.factors[0].T
    assert near.factors[0] @ near.factors[0].T == pytest.approx(0.81 * covariance + 0.19 * np.eye(2))


def test_a_fit_finds_as_many_parts_as_the_points_show():
    random = np.random.default_rng(1)
    centres = np.array([[4.0, 0.0], [-4.0, 0.0], [0.0, 5.0]])
    points = np.concatenate([centre + 0.5 * random.standard_normal((300, 2)) for centre in centres])
    found = fitted(points, np.repeat([1.0, 1.0, 2.0], 300))
    order = np.argsort(found.means[:, 0])
    assert found.means[order] == pytest.approx(centres[[1, 2, 0]], abs=0.15)
    assert found.shares[order] == pytest.approx([0.25, 0.5, 0.25], abs=0.01)
    one = fitted(points[:300], np.ones(300))
    assert one.means == pytest.approx(centres[:1], abs=0.1)
    assert one.factors[0] @ one.factors[0].T == pytest.approx(0.25 * np.eye(2), abs=0.06)


@pytest.mark.parametrize(("parts", "parameters"), [(1, 3 + 6), (2, 1 + 2 * (3 + 6))])
def test_the_criterion_is_the_likelihood_less_what_its_parameters_cost(parts, parameters):
    """Mean and covariance of each part, and all shares but one; weights count by their effective size."""
    points = np.random.default_rng(2).random((400, 3)) * [12.0, 1.0, 1.0]
    weights = np.repeat([3.0, 0.0], 200)
    found, criterion = fitted_with(parts, points, weights)
    assert len(found.shares) == parts
    likelihood = found.log_density(points[:200]).sum()
    assert criterion == pytest.approx(likelihood - 0.5 * parameters * math.log(200), abs=0.3)
    assert len(fitted(points, weights).shares) == 1


def test_from_few_points_a_fit_concludes_little():
    """Two points on a line: the covariance stays near the identity, whatever their distance is not."""
    found = fitted(np.array([[3.0, 0.0], [3.0, 0.2]]), np.ones(2))
    assert found.means == pytest.approx(np.array([[3.0, 0.1]]))
    assert found.factors[0] @ found.factors[0].T == pytest.approx(4.0 / 6.0 * np.eye(2), abs=0.01)


def test_the_effective_size_of_a_sample():
    assert effective(np.array([2.0, 2.0, 2.0])) == 3.0
    assert effective(np.array([1.0, 0.0, 0.0])) == 1.0


def test_the_highest_threshold_that_enough_reach():
    scores, ones = np.array([1.0, 5.0, 3.0, 3.0, np.inf]), np.ones(5)
    assert [highest(scores, ones, least) for least in (1.0, 2.0, 3.0, 5.0, 9.0)] == [math.inf, 5.0, 3.0, 1.0, 1.0]
    assert highest(scores, np.array([1.0, 1.0, 1.0, 1.0, 1e6]), 1.5) == 1.0  # one heavy flight counts as one


def beyond(limit):
    """Failure beyond a number of deviations of the first key."""

    def evaluate(points):
        first = points.latent[:, 0]
        return np.where(first > limit, np.inf, first)[None]

    return evaluate


def test_a_share_is_drawn_as_the_campaign_draws_and_bounds_every_weight():
    drawing = Proposal(Mixture(np.ones(1), np.array([[40.0, 0.0]]), 0.1 * np.eye(2)[None]))
    points = drawing.points(Random(1, 0, 2), 5000)
    near = points.latent[:, 0] < 10.0
    assert near.mean() == pytest.approx(DEFENSIVE, abs=0.015)
    assert points.latent[near].std(axis=0) == pytest.approx(np.ones(2), abs=0.1)
    weights = np.exp(log_standard(points.latent) - drawing.log_density(points.latent))
    assert weights.max() == pytest.approx(1.0 / DEFENSIVE)
    assert weights.mean() == pytest.approx(1.0, abs=0.15)


def test_the_parts_of_a_fit_are_drawn_by_their_shares():
    apart = np.array([[30.0, 0.0], [-30.0, 0.0]])
    drawing = Proposal(Mixture(np.array([0.25, 0.75]), apart, 0.1 * np.array([np.eye(2), np.eye(2)])))
    first = drawing.points(Random(1, 0, 2), 5000).latent[:, 0]
    assert [np.mean(first > 10.0), np.mean(first < -10.0)] == pytest.approx([0.225, 0.675], abs=0.02)


def test_all_flights_of_a_replicate_are_one_weighted_sample():
    """Drawn from three distributions in turn, their weights add to 1, and over an event to its probability."""
    sample = SampledFlights(beyond(1.0), Random(2, 0, 2), 4000)
    for mean in (1.5, -1.0):
        sample.add(Proposal(Mixture(np.ones(1), np.array([[mean, 0.5]]), 0.8 * np.eye(2)[None])))
    assert len(sample.weights) == 16_000  # with the wide ones
    assert sample.weights.sum() == pytest.approx(1.0, abs=0.02)
    assert sample.probability(0) == pytest.approx(probability(-1.0), rel=0.03)


def test_an_estimate_is_unbiased_even_from_a_bad_fit(monkeypatch):
    """Fits that keep only the first centre of two: the mean still is the truth, because every flight has its weight."""

    def evaluate(points):
        first = np.abs(points.latent[:, 0])
        return np.where(first > 2.0, np.inf, first)[None]

    one_sided = Mixture(np.ones(1), np.array([[2.4, 0.0]]), np.diag([0.4, 1.0])[None])
    monkeypatch.setattr("quadstep.studies.rare.cross_entropy.fitted", lambda *_: one_sided)
    found = [cross_entropy(evaluate, 1, Random(1, k, 2), 500)[0].probability for k in range(100)]
    assert np.mean(found) == pytest.approx(2.0 * probability(-2.0), abs=3.0 * np.std(found) / 10.0)
    assert np.std(found) / 10.0 < 0.05 * np.mean(found)


def test_a_failure_that_the_last_fit_misses_does_not_outweigh_all_others(monkeypatch):
    """Failures on two sides, and a last fit to one: earlier ones still draw the other, with weights far below the bound."""

    def evaluate(points):
        first = np.abs(points.latent[:, 0])
        return np.where(first > 3.5, np.inf, first)[None]

    def one_sided(latent, weights):
        found = fitted(latent, weights)
        return (
            found if np.abs(latent[:, 0]).min() < 3.5 else Mixture(np.ones(1), np.array([[3.7, 0.0]]), 0.3 * np.eye(2)[None])
        )

    monkeypatch.setattr("quadstep.studies.rare.cross_entropy.fitted", one_sided)
    found = [cross_entropy(evaluate, 1, Random(1, k, 2), 500)[0].probability for k in range(10)]
    assert np.mean(found) == pytest.approx(2.0 * probability(-3.5), rel=0.15)
    assert np.max(found) < 1.5 * np.mean(found)


def test_steering_ends_where_the_score_does_not_lead():
    """The score is noise of each flight's own."""
    sample = SampledFlights(lambda points: (points.noise * 0.6180339887 % 1.0)[None], Random(1, 0, 2), 500)
    _, levels = steered(sample, 0, LEAST)
    assert len(levels) == SLOW + 1
    assert sample.scores.shape == (1, (SLOW + 2) * 500)  # one of them wide


def test_the_estimate_is_made_from_flights_that_no_fit_has_seen():
    flown = []

    def evaluate(points):
        flown.append(points.noise)
        return beyond(4.0)(points)

    (found,) = cross_entropy(evaluate, 1, Random(1, 0, 2), 400)
    assert len(flown[-1]) == LAST * 400
    assert len(np.unique(np.concatenate(flown))) == sum(map(len, flown))
    assert set(found.failures.noise) <= set(flown[-1])
    assert (found.crude, len(found.crude_failures.noise)) == (400, 0)
    assert found.levels[-1] == (None, found.probability)


def test_frequent_failures_need_no_steering():
    (found,) = cross_entropy(beyond(-1.0), 1, Random(1, 0, 2), 2000)
    assert found.probability == pytest.approx(probability(1.0), abs=0.02)
    assert len(found.crude_failures.noise) == pytest.approx(2000 * probability(1.0), abs=60)
    assert found.levels == ((None, found.probability),)


def test_steering_does_not_end_where_the_levels_are_close_but_lead_on(monkeypatch):
    monkeypatch.setattr("quadstep.studies.rare.cross_entropy.SHARE", 0.5)
    _, levels = steered(SampledFlights(beyond(3.719), Random(1, 0, 2), 500), 0, LEAST)
    assert max(b.probability / a.probability for a, b in pairwise(levels[:-1])) > 0.26
    assert [level.threshold for level in levels[-2:]] == [None, None]
    assert levels[-1].probability == pytest.approx(1e-4, rel=0.15)

"""The covariance as a triangle, against NumPy on whole matrices."""

import numpy as np
import pytest

from quadstep.numbers import Vector, matrix
from quadstep.sensing.estimator import diagonal, entry, observed, sheared, widened

RNG = np.random.default_rng(11)
COUNT = 15


def random_covariance():
    root = RNG.normal(size=(COUNT, COUNT))
    whole = root @ root.T + 0.1 * np.eye(COUNT)
    return tuple(Vector(whole[i, i:].tolist()) for i in range(COUNT)), whole


def whole(triangle):
    return np.array([[entry(triangle, i, j) for j in range(len(triangle))] for i in range(len(triangle))])


def test_a_diagonal_covariance_and_added_noise():
    sizes, more = RNG.uniform(1, 2, (2, COUNT))
    got = widened(diagonal(Vector(sizes.tolist())), Vector(more.tolist()))
    np.testing.assert_array_equal(whole(got), np.diag(sizes + more))


@pytest.mark.parametrize(("target", "source"), [(0, 3), (3, 6), (6, 12), (12, 0), (9, 3)])
def test_a_shear_is_the_congruence_with_its_matrix(target, source):
    triangle, p = random_covariance()
    g = RNG.normal(size=(3, 3))
    f = np.eye(COUNT)
    f[target : target + 3, source : source + 3] = g
    np.testing.assert_allclose(whole(sheared(triangle, target, source, matrix(*g.tolist()))), f @ p @ f.T, rtol=0, atol=1e-12)


@pytest.mark.parametrize("place", range(COUNT))
def test_an_observation_is_the_joseph_form_with_the_optimal_gain(place):
    triangle, p = random_covariance()
    h, r = np.eye(COUNT)[place], 0.3
    k = p @ h / (h @ p @ h + r)
    keep = np.eye(COUNT) - np.outer(k, h)
    gain, after = observed(triangle, place, r)
    np.testing.assert_allclose(list(gain), k, rtol=1e-13)
    np.testing.assert_allclose(whole(after), keep @ p @ keep.T + r * np.outer(k, k), rtol=0, atol=1e-12)


def test_in_f32_a_sensor_ten_thousand_times_better_than_what_is_known_leaves_a_positive_variance():
    triangle = diagonal(Vector([np.full(1, 100.0, np.float32)] * COUNT))
    for place in range(9):
        _, triangle = observed(triangle, place, np.float32(1e-6))
    assert all(entry(triangle, i, i).dtype == np.float32 for i in range(9))
    np.testing.assert_allclose([entry(triangle, i, i)[0] for i in range(9)], 1e-6, rtol=1e-5)

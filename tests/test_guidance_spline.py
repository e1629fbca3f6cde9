"""Least jerk through waypoints and near recordings, against quadrature, perturbation and the known transfer."""

import numpy as np
import pytest

from quadstep.guidance.minimum_jerk import blend
from quadstep.guidance.piecewise import Piecewise, hermite_to_taylor, piecewise_parameters
from quadstep.guidance.spline import MOST_KNOTS, jerk_cost, near_recording, through_waypoints
from tests.flights import array

RNG = np.random.default_rng(31)
TIMES = np.array([0.0, 0.8, 2.0, 2.7, 4.0])
POINTS = RNG.normal(size=(5, 4))


def nodes_of(parameters, times):
    """Value, rate and second rate of (x, y, z, psi) at the given times, shape (n, 3, 4)."""
    tables = np.array([[table.array for table in axis] for axis in parameters.coefficients])
    index = np.searchsorted(parameters.knots.array, times)
    return (tables[:, :3, index] * np.array([1.0, 1.0, 2.0])[None, :, None]).transpose(2, 1, 0)


def jerk_integral(nodes):
    """Integral of jerk squared of each axis, by Gauss quadrature on the pieces."""
    parameters = piecewise_parameters(TIMES, nodes)
    result = np.zeros(4)
    abscissae, weights = np.polynomial.legendre.leggauss(5)
    for piece, length in enumerate(np.diff(TIMES)):
        s = 0.5 * length * (abscissae + 1)
        for axis in range(4):
            c3, c4, c5 = (parameters.coefficients[axis][power].values[piece] for power in (3, 4, 5))
            jerk = 6 * c3 + 24 * c4 * s + 60 * c5 * s**2
            result[axis] += 0.5 * length * weights @ jerk**2
    return result


def test_quintic_pieces_have_the_ends_they_were_given():
    ends = RNG.normal(size=6)
    for length in (0.3, 1.0, 2.5):
        p = np.polynomial.Polynomial(hermite_to_taylor(np.array([length]))[0] @ ends)
        got = [p.deriv(order)(s) if order else p(s) for s in (0.0, length) for order in range(3)]
        np.testing.assert_allclose(got, ends, atol=1e-9)


def test_jerk_cost_is_the_integral_of_jerk_squared():
    nodes = RNG.normal(size=(5, 3, 4))
    flat = nodes.reshape(-1, 4)
    got = np.einsum("ia,ij,ja->a", flat, jerk_cost(np.diff(TIMES)), flat)
    np.testing.assert_allclose(got, jerk_integral(nodes), rtol=1e-10)


def test_any_admissible_change_of_the_path_through_waypoints_raises_its_jerk():
    best = nodes_of(through_waypoints(TIMES, POINTS), TIMES)
    least = jerk_integral(best)
    for _ in range(30):
        change = RNG.normal(size=best.shape) * 10 ** RNG.uniform(-3, 0)
        change[:, 0] = 0
        change[[0, -1]] = 0
        assert np.all(jerk_integral(best + change) > least)


def smooth(t):
    """A motion at rest at 0 and 10 s: two blends."""
    first, second = (np.array([blend(one, length)[0] for one in t]) for length in (10.0, 5.0))
    return np.column_stack([first, 3 * second, first - second, 0.2 * second])


def test_a_smooth_recording_without_noise_is_reproduced():
    t = np.sort(np.concatenate([[0.0, 10.0], RNG.uniform(0, 10, 600)]))
    path = near_recording(t, smooth(t), 0.15)
    for one in np.linspace(0, 10, 41):
        got = Piecewise().reference(one, path)
        np.testing.assert_allclose([*got.position, got.yaw], smooth([one])[0], atol=3e-3)


def test_a_noisy_uneven_recording_is_smoothed():
    t = np.sort(np.concatenate([[0.0, 10.0], RNG.uniform(0, 10, 1500)]))
    noise = 0.05 * RNG.normal(size=(len(t), 4))
    path = near_recording(t, smooth(t) + noise, 0.4)
    times = np.linspace(0, 10, 201)
    got = np.array([[*(reference := Piecewise().reference(one, path)).position, reference.yaw] for one in times])
    off = np.sqrt(np.mean((got - smooth(times)) ** 2, axis=0))
    assert np.all(off < 0.015)
    assert np.all(off > 1e-5)


@pytest.mark.parametrize(("product", "tolerance"), [(0.5, 0.01), (0.8, 0.03), (1.0, 0.04), (1.3, 0.04), (2.0, 0.04)])
def test_a_recorded_sine_comes_through_with_the_gain_1_over_1_plus_w_tau_to_the_sixth(product, tolerance):
    tau = 0.5
    w = product / tau
    t = np.linspace(0, 60, 3001)
    path = near_recording(t, np.sin(np.outer(w * t, [1, 1, 1, 1])), tau)
    middle = np.linspace(20, 40, 401)
    got = np.array([Piecewise().reference(one, path).position[0] for one in middle])
    basis = np.column_stack([np.sin(w * middle), np.cos(w * middle)])
    gain, shift = np.linalg.lstsq(basis, got, rcond=None)[0]
    assert gain == pytest.approx(1 / (1 + product**6), abs=tolerance)
    assert shift == pytest.approx(0, abs=tolerance)


def test_a_smoothed_recording_starts_and_ends_at_rest():
    t = np.linspace(0, 6, 200)
    path = near_recording(t, np.sin(np.outer(t, [1, 2, 0.5, 1])), 0.3)
    for one in (0.0, 6.0, 7.0):
        got = Piecewise().reference(one, path)
        np.testing.assert_allclose([*got.velocity, *got.acceleration, got.yaw_rate], 0, atol=1e-9)


def test_a_straight_recording_and_a_standing_one_are_kept():
    t = np.linspace(0, 4, 50)
    path = near_recording(t, np.tile([1.0, -2.0, 3.0, 0.5], (50, 1)), 0.3)
    for one in (0.0, 1.234, 4.0, 9.0):
        got = Piecewise().reference(one, path)
        np.testing.assert_allclose([*got.position, got.yaw], [1, -2, 3, 0.5], atol=1e-9)
        assert np.abs(array(got.velocity)).max() < 1e-9


def test_knots_of_a_recording_are_a_smoothing_time_apart_but_never_too_many():
    t = np.linspace(0, 10, 30)
    points = np.zeros((30, 4))
    knots = near_recording(t, points, 0.5).knots.array
    np.testing.assert_allclose(np.diff(knots[np.isfinite(knots)]), 0.5)
    assert np.isfinite(near_recording(t, points, 1e-3).knots.array).sum() == MOST_KNOTS


def test_two_recorded_points_make_a_path():
    path = near_recording(np.array([0.0, 1.0]), np.array([[0, 0, 0, 0], [1, 2, 3, 0]], dtype=float), 5.0)
    assert np.isfinite(array(Piecewise().reference(0.5, path).position)).all()

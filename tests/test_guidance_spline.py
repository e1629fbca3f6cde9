"""Least jerk through waypoints and near recordings, against quadrature, perturbation and the known transfer."""

import mpmath
import numpy as np
import pytest

from quadstep.world.paths import blend
from quadstep.world.pieces import (
    LEAST_SPAN,
    MOST_KNOTS,
    Piecewise,
    jerk_cost,
    near_recording,
    piecewise_parameters,
    quintic,
    through_waypoints,
    values_at,
)
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
        p = np.polynomial.Polynomial(quintic(length, *ends))
        got = [p.deriv(order)(s) if order else p(s) for s in (0.0, length) for order in range(3)]
        np.testing.assert_allclose(got, ends, atol=1e-9)


def test_the_weights_in_a_piece_are_those_of_its_quintic():
    ends, u = RNG.normal(size=6), np.linspace(0.0, 1.0, 21)
    wanted = np.polynomial.Polynomial(quintic(1.0, *ends))(u)
    np.testing.assert_allclose(sum(end * weight for end, weight in zip(ends, values_at(u), strict=True)), wanted, atol=1e-14)


def whole(rows):
    """A symmetric matrix from the rows of its lower triangle."""
    matrix = np.zeros((len(rows), len(rows)))
    for i, row in enumerate(rows):
        matrix[i, i - len(row) + 1 : i + 1] = row
    return matrix + np.tril(matrix, -1).T


def test_jerk_cost_is_the_integral_of_jerk_squared():
    nodes = RNG.normal(size=(5, 3, 4))
    flat = nodes.reshape(-1, 4)
    got = np.einsum("ia,ij,ja->a", flat, whole(jerk_cost(np.diff(TIMES).tolist())), flat)
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
    t = np.linspace(0, 10, 4000)
    assert np.isfinite(near_recording(t, np.zeros((4000, 4)), 1e-3).knots.array).sum() == MOST_KNOTS


def on_every_knot(t, points, smoothing):
    """Values at knots that are all a smoothing time apart, (n, 4): the same least squares, dense and by NumPy."""
    count = round((t[-1] - t[0]) / smoothing) + 1
    knots = np.linspace(t[0], t[-1], count)
    piece = np.clip(np.searchsorted(knots, t, side="right") - 1, 0, count - 2)
    rows = np.zeros((len(t), 3 * count))
    for row, k, s in zip(rows, piece, t - knots[piece], strict=True):
        for place, unit in enumerate(np.eye(6)):
            row[3 * k + place] = np.polynomial.Polynomial(quintic(smoothing, *unit))(s)
    weight = (t[-1] - t[0]) / len(t) / smoothing**6
    system = whole(jerk_cost([smoothing] * (count - 1))) + weight * rows.T @ rows
    free = np.setdiff1d(np.arange(3 * count), [1, 2, 3 * count - 2, 3 * count - 1])
    flat = np.zeros((3 * count, 4))
    flat[free] = np.linalg.solve(system[np.ix_(free, free)], weight * rows[:, free].T @ points)
    return knots, flat[::3]


def test_where_nothing_was_recorded_there_are_no_knots_and_the_path_is_the_same():
    t = np.concatenate([np.linspace(0.0, 1.51, 151), np.linspace(4.49, 6.0, 151)])
    points = np.sin(np.outer(t, [1, 2, 0.5, 1]))
    path = near_recording(t, points, 0.15)
    found = path.knots.array[np.isfinite(path.knots.array)]
    knots, wanted = on_every_knot(t, points, 0.15)
    assert len(found) < len(knots) - 15
    for knot, values in zip(knots, wanted, strict=True):
        got = Piecewise().reference(knot, path)
        np.testing.assert_allclose([*got.position, got.yaw], values, atol=1e-8)


def exact_waypoints(times, points):
    """Rates and second rates at the waypoints, (n, 2, 4): continuous jerk and snap between the pieces, in many digits."""
    count = len(times)
    with mpmath.workdps(80):
        times, points = [mpmath.mpf(t) for t in times], [[mpmath.mpf(p) for p in row] for row in points.tolist()]
        system, right = mpmath.zeros(2 * count), mpmath.zeros(2 * count, 4)

        def bends(k, at, *ends):
            """Jerk and snap at the start (0) or end (1) of piece k."""
            h = times[k + 1] - times[k]
            *_, c3, c4, c5 = quintic(h, *ends)
            s = at * h
            return 6 * c3 + 24 * c4 * s + 60 * c5 * s * s, 24 * c4 + 120 * c5 * s

        for k in range(count):
            if k in (0, count - 1):
                system[2 * k, 2 * k] = system[2 * k + 1, 2 * k + 1] = 1
                continue
            for piece, at, sign in ((k - 1, 1, 1), (k, 0, -1)):
                for end in range(2):
                    for order in range(2):
                        unit = [mpmath.mpf(0)] * 6
                        unit[3 * end + 1 + order] = mpmath.mpf(1)
                        for row, value in enumerate(bends(piece, at, *unit)):
                            system[2 * k + row, 2 * (piece + end) + order] += sign * value
                    for axis in range(4):
                        unit = [mpmath.mpf(0)] * 6
                        unit[3 * end] = points[piece + end][axis]
                        for row, value in enumerate(bends(piece, at, *unit)):
                            right[2 * k + row, axis] -= sign * value
        solved = np.array([[float(v) for v in mpmath.lu_solve(system, right[:, axis])] for axis in range(4)])
    return solved.reshape(4, count, 2).transpose(1, 2, 0)


UNEVEN = {
    "even": ([0.0, 1.0, 2.0, 3.0, 4.0, 5.0], 1e-13),
    "uneven": ([0.0, 0.1, 3.0, 3.2, 9.0, 9.7], 1e-12),
    "milliseconds and hours": ([0.0, 1e-3, 1e4, 1e4 + 1e-3, 2e4, 2e4 + 1.0], 1e-8),
}


@pytest.mark.parametrize("name", UNEVEN)
def test_the_path_through_waypoints_is_right_to_many_digits_however_uneven_their_times(name):
    times, tolerance = np.array(UNEVEN[name][0]), UNEVEN[name][1]
    points = RNG.normal(size=(len(times), 4)) + 100.0
    nodes, wanted = nodes_of(through_waypoints(times, points), times), exact_waypoints(times, points)
    assert (nodes[:, 0] == points).all()
    for order in range(2):
        np.testing.assert_allclose(
            nodes[:, 1 + order], wanted[:, order], rtol=tolerance, atol=tolerance * np.abs(wanted[:, order]).max()
        )


def test_a_recording_as_short_as_can_be_is_smoothed_to_its_middle():
    t = np.linspace(0.0, LEAST_SPAN, 50)
    points = RNG.normal(size=(50, 4)) + np.array([1e3, 0.0, -5.0, 1.0])
    path = near_recording(t, points, 1.0)
    for one in (0.0, 0.05, 0.1):
        got = Piecewise().reference(one, path)
        np.testing.assert_allclose([*got.position, got.yaw], points.mean(axis=0), atol=1e-5)
        assert np.abs(array(got.velocity)).max() < 1e-3


def test_two_recorded_points_make_a_path():
    path = near_recording(np.array([0.0, 1.0]), np.array([[0, 0, 0, 0], [1, 2, 3, 0]], dtype=float), 5.0)
    assert np.isfinite(array(Piecewise().reference(0.5, path).position)).all()

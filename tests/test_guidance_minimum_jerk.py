"""The paper's reference path, Eqs 68-75."""

import numpy as np
import pytest

from quadstep.numbers import vector
from quadstep.world.paths import MinimumJerk, MinimumJerkParameters, blend
from tests.flights import array

PATH = MinimumJerk()
CASE = MinimumJerkParameters(vector(1.0, -2.0, 3.0), vector(21.0, 5.0, 10.0), 0.2, -1.3, 8.0)


def coefficients(duration):
    """a_3, a_4, a_5 of a unit step from the 3x3 system of Eq. 70."""
    t = duration
    system = [[1, t, t**2], [3, 4 * t, 5 * t**2], [6, 12 * t, 20 * t**2]]
    return np.linalg.solve(system, [1 / t**3, 0, 0])


@pytest.mark.parametrize("duration", [0.5, 3.0, 40.0])
def test_blend_is_the_polynomial_that_solves_eq_70(duration):
    a3, a4, a5 = coefficients(duration)
    for t in np.linspace(0, duration, 23):
        share, rate, change = blend(t, duration)
        assert share == pytest.approx(a3 * t**3 + a4 * t**4 + a5 * t**5, abs=1e-11)
        assert rate == pytest.approx(3 * a3 * t**2 + 4 * a4 * t**3 + 5 * a5 * t**4, abs=1e-10)
        assert change == pytest.approx(6 * a3 * t + 12 * a4 * t**2 + 20 * a5 * t**3, abs=1e-9)


def test_eq_75_ten_metres_in_ten_seconds():
    assert coefficients(10.0) * 10 == pytest.approx([0.1, -0.015, 0.0006])
    path = MinimumJerkParameters(vector(0.0, 0.0, 0.0), vector(10.0, 0.0, 0.0), 0.0, 0.0, 10.0)
    for t in np.linspace(0, 10, 21):
        assert PATH.reference(t, path).position[0] == pytest.approx(0.1 * t**3 - 0.015 * t**4 + 0.0006 * t**5, abs=1e-12)


def test_each_axis_and_yaw_follow_the_same_blend():
    for t in (0.0, 1.0, 3.3, 7.9, 8.0):
        share, rate, change = blend(t, 8.0)
        got = PATH.reference(t, CASE)
        np.testing.assert_allclose(array(got.position), [1 + 20 * share, -2 + 7 * share, 3 + 7 * share])
        np.testing.assert_allclose(array(got.velocity), [20 * rate, 7 * rate, 7 * rate])
        np.testing.assert_allclose(array(got.acceleration), [20 * change, 7 * change, 7 * change])
        assert (got.yaw, got.yaw_rate) == pytest.approx((0.2 - 1.5 * share, -1.5 * rate))


@pytest.mark.parametrize("t", [8.0, 8.0000001, 9.0, 1e6])
def test_end_point_is_held_exactly_at_rest(t):
    got = PATH.reference(t, CASE)
    assert array(got.position).tolist() == [21.0, 5.0, 10.0]
    assert not array(got.velocity).any()
    assert not array(got.acceleration).any()
    assert got.yaw == pytest.approx(-1.3, abs=1e-15)
    assert got.yaw_rate == 0.0


@pytest.mark.parametrize("t", [0.0, -1.0])
def test_start_is_at_rest(t):
    got = PATH.reference(t, CASE)
    assert array(got.position).tolist() == [1.0, -2.0, 3.0]
    assert not array(got.velocity).any()
    assert not array(got.acceleration).any()


def test_any_other_path_between_the_same_ends_has_more_jerk():
    rng = np.random.default_rng(5)
    t = np.linspace(0, 1, 4001)
    a3, a4, a5 = coefficients(1.0)
    least = np.polynomial.Polynomial([0, 0, 0, a3, a4, a5])
    for _ in range(10):
        rest = np.polynomial.Polynomial([0, 0, 0, 1, -3, 3, -1])  # t^3 (1-t)^3: at rest at both ends
        other = least + rest * np.polynomial.Polynomial(rng.normal(size=4))
        costs = [np.trapezoid(path.deriv(3)(t) ** 2, t) for path in (least, other)]
        assert costs[1] > costs[0]

"""Every path: each rate, up to snap, is the slope of the one before. Orbits, and pieces through waypoints."""

import numpy as np
import pytest

from quadstep.numbers import vector
from quadstep.world.paths import (
    MinimumJerk,
    MinimumJerkParameters,
    Orbit,
    OrbitParameters,
    Step,
    StepParameters,
    blend_bend,
    ramped_time,
)
from quadstep.world.pieces import Piecewise, near_recording, through_waypoints
from tests.flights import array, through_lanes

RNG = np.random.default_rng(21)
TIMES = np.array([0.0, 1.0, 1.7, 4.0, 5.5, 9.0])
POINTS = RNG.normal(size=(6, 4))
WAYPOINTS = through_waypoints(TIMES, POINTS)
ORBIT = OrbitParameters(
    centre=vector(1.0, 2.0, 3.0),
    amplitude=vector(4.0, 2.0, 0.5),
    frequency=vector(0.5, 1.0, 0.25),
    phase=vector(0.3, -0.2, 1.0),
    yaw=0.1,
    yaw_rate=0.4,
    ramp=0.0,
)
SAMPLES = np.sort(RNG.uniform(0, 8, 300))
RECORDED = near_recording(SAMPLES, np.sin(np.outer(SAMPLES, [0.5, 0.7, 1.0, 0.2])), 0.3)

PATHS = {  # law, parameters, times at which jerk or snap jumps
    "minimum jerk": (MinimumJerk(), MinimumJerkParameters(vector(0, 1, 2), vector(5, 3, -1), 0.0, 1.0, 7.0), [0.0, 7.0]),
    "orbit": (Orbit(), ORBIT, []),
    "ramped orbit": (Orbit(), ORBIT._replace(ramp=4.0), [0.0, 4.0]),
    "waypoints": (Piecewise(), WAYPOINTS, list(TIMES)),
    "recording": (Piecewise(), RECORDED, list(np.linspace(SAMPLES[0], SAMPLES[-1], 28))),
    "step": (Step(), StepParameters(vector(0, 1, 2), vector(5, 3, -1), 2.0, 0.3), [2.0]),
}
EVERY_PATH = pytest.mark.parametrize("name", PATHS)
H = 1e-4


def numbers(reference):
    return np.array([*reference.position, reference.yaw, *reference.velocity, reference.yaw_rate, *reference.acceleration])


def third_orders(name, t):
    """(acceleration, jerk, snap), shape (3, 3)."""
    law, parameters, _ = PATHS[name]
    reference = law.reference(t, parameters)
    return np.array([array(reference.acceleration), array(reference.jerk), array(reference.snap)])


def away(name, begin, count):
    """Times off those at which something jumps."""
    jumps = PATHS[name][2]
    return [t for t in RNG.uniform(begin, 10.0, count) if not any(abs(t - jump) < 2 * H for jump in jumps)]


@EVERY_PATH
def test_velocity_acceleration_and_yaw_rate_are_slopes(name):
    law, parameters, _ = PATHS[name]
    for t in away(name, 0.05, 60):
        h = 1e-5
        ahead, behind = (numbers(law.reference(t + step, parameters)) for step in (h, -h))
        got = numbers(law.reference(t, parameters))
        np.testing.assert_allclose(got[4:8], (ahead - behind)[:4] / (2 * h), atol=2e-8)
        np.testing.assert_allclose(got[8:], (ahead - behind)[4:7] / (2 * h), atol=2e-6)


@EVERY_PATH
def test_jerk_and_snap_are_slopes(name):
    times = away(name, -1.0, 120)
    assert len(times) > 90
    for t in times:
        slope = (third_orders(name, t + H) - third_orders(name, t - H)) / (2 * H)
        got = third_orders(name, t)
        np.testing.assert_allclose(got[1:], slope[:2], atol=1e-5 * (1.0 + np.abs(got).max()))


@pytest.mark.parametrize("name", [name for name in PATHS if "orbit" not in name])
def test_a_path_at_rest_has_neither(name):
    for t in (-0.5, 20.0):
        assert not third_orders(name, t)[1:].any()


@EVERY_PATH
def test_arrays_and_lanes_of_times_give_what_floats_give(name):
    law, parameters, _ = PATHS[name]
    t = np.concatenate([np.linspace(-0.7, 11, 57), TIMES])

    def law_at(time):
        r = law.reference(time, parameters)
        return [*r.position, r.yaw, *r.velocity, r.yaw_rate, *r.acceleration, *r.jerk, *r.snap]

    wanted = np.array([law_at(float(one)) for one in t]).T
    np.testing.assert_allclose([np.broadcast_to(one, t.shape) for one in law_at(t)], wanted, rtol=1e-12, atol=1e-12)
    if not isinstance(law, Piecewise):  # whose tables in lanes are flown in test_engines
        np.testing.assert_allclose(through_lanes(law_at, t), wanted, rtol=1e-11, atol=1e-11)


def test_minimum_jerk_has_the_jerk_of_its_polynomial():
    """x = 10 s^3 - 15 s^4 + 6 s^5: jerk 60 at both ends and -30 in the middle, snap -360 at first, over t_f^3 and t_f^4."""
    assert blend_bend(0.0, 2.0) == pytest.approx((60.0 / 8.0, -360.0 / 16.0))
    assert blend_bend(1.0, 2.0) == pytest.approx((-30.0 / 8.0, 0.0))
    assert blend_bend(2.0 - 1e-12, 2.0) == pytest.approx((60.0 / 8.0, 360.0 / 16.0))
    assert blend_bend(2.0, 2.0) == blend_bend(-1e-9, 2.0) == (0.0, 0.0)


def test_a_step_jumps_once_and_rests():
    law, parameters, _ = PATHS["step"]
    for t, wanted in ((0.0, (0, 1, 2)), (1.9999, (0, 1, 2)), (2.0, (5, 3, -1)), (1e6, (5, 3, -1))):
        got = law.reference(t, parameters)
        assert tuple(got.position) == wanted
        assert (got.yaw, got.yaw_rate) == (0.3, 0.0)
        assert [*got.velocity, *got.acceleration] == [0.0] * 6


def test_orbit_is_one_harmonic_an_axis():
    for t in (0.0, 1.3, 20.0):
        got = Orbit().reference(t, ORBIT)
        wanted = [1 + 4 * np.sin(0.5 * t + 0.3), 2 + 2 * np.sin(t - 0.2), 3 + 0.5 * np.sin(0.25 * t + 1)]
        np.testing.assert_allclose(array(got.position), wanted)
        assert (got.yaw, got.yaw_rate) == pytest.approx((0.1 + 0.4 * t, 0.4))


def test_ramped_orbit_starts_at_rest_and_then_flies_the_same_curve_half_a_ramp_late():
    ramped = ORBIT._replace(ramp=4.0)
    start = Orbit().reference(0.0, ramped)
    assert not array(start.velocity).any()
    assert not array(start.acceleration).any()
    np.testing.assert_allclose(array(start.position), array(Orbit().reference(0.0, ORBIT).position))
    for t in (4.0, 5.0, 17.0):
        np.testing.assert_allclose(
            numbers(Orbit().reference(t, ramped)), numbers(Orbit().reference(t - 2.0, ORBIT)), atol=1e-13
        )


def test_time_along_the_curve_is_continuous_with_its_rates_over_the_ramp():
    for join in (0.0, 4.0):
        before, after = (np.array(ramped_time(join + step, 4.0)) for step in (-1e-9, 1e-9))
        if join:
            np.testing.assert_allclose(before, after, atol=1e-8)
    assert ramped_time(0.0, 4.0) == (0.0, 0.0, 0.0)
    assert ramped_time(4.0, 4.0) == pytest.approx((2.0, 1.0, 0.0))
    assert ramped_time(2.0, 4.0) == pytest.approx((4 * (2.5 / 16 - 3 / 32 + 1 / 64), 0.5, 1.875 / 4))
    assert ramped_time(3.0, 0.0) == (3.0, 1.0, 0.0)


def derivatives(t, side):
    """Value to fifth derivative of each axis just before (-1) or after (+1) a knot, from the tables."""
    knots = WAYPOINTS.knots.array
    index = np.searchsorted(knots, t, side="right" if side > 0 else "left") - 1
    polynomials = [np.polynomial.Polynomial([table.values[index] for table in axis]) for axis in WAYPOINTS.coefficients]
    return np.array([[p.deriv(order)(t - knots[index]) for p in polynomials] for order in range(6)])


def test_waypoints_are_met_exactly():
    for t, point in zip(TIMES, POINTS, strict=True):
        got = Piecewise().reference(float(t), WAYPOINTS)
        np.testing.assert_allclose([*got.position, got.yaw], point, atol=1e-12)


def test_path_through_waypoints_is_smooth_to_the_fourth_derivative_at_every_interior_knot():
    for t in TIMES[1:-1]:
        before, after = derivatives(t, -1), derivatives(t, 1)
        np.testing.assert_allclose(before[:5], after[:5], rtol=1e-8, atol=1e-8)
        assert np.abs(before[5] - after[5]).min() > 1e-3


def test_path_through_waypoints_starts_and_ends_at_rest_and_stays():
    for t in (0.0, 9.0, 9.5, 1e5):
        got = Piecewise().reference(t, WAYPOINTS)
        np.testing.assert_allclose([*got.velocity, *got.acceleration, got.yaw_rate], 0, atol=1e-9)
        np.testing.assert_allclose([*got.position, got.yaw], POINTS[0 if t == 0 else -1], atol=1e-9)
    for t in (9.0, 1e5):  # exactly, from the last knot on
        held = Piecewise().reference(t, WAYPOINTS)
        assert [*held.position, held.yaw] == POINTS[-1].tolist()
        assert [*held.velocity, *held.acceleration, held.yaw_rate] == [0.0] * 7


def test_before_its_first_knot_a_path_rests_at_its_start():
    got = numbers(Piecewise().reference(-3.0, WAYPOINTS))
    np.testing.assert_array_equal(got, numbers(Piecewise().reference(0.0, WAYPOINTS)))


def test_two_waypoints_reduce_to_the_papers_minimum_jerk():
    points = np.array([[1.0, 2.0, 3.0, 0.5], [4.0, -1.0, 3.0, 0.0]])
    spline = through_waypoints(np.array([0.0, 6.0]), points)
    paper = MinimumJerkParameters(vector(1.0, 2.0, 3.0), vector(4.0, -1.0, 3.0), 0.5, 0.0, 6.0)
    for t in np.linspace(0, 8, 33):
        got, wanted = Piecewise().reference(t, spline), MinimumJerk().reference(t, paper)
        np.testing.assert_allclose(numbers(got), numbers(wanted), atol=1e-12)


@pytest.mark.parametrize("count", [2, 3, 4, 5, 8, 9, 17])
def test_any_number_of_knots_is_searched_rightly(count):
    times = np.arange(count) * 0.7
    points = np.outer(np.arange(count), [1.0, 10.0, 100.0, 0.1])
    spline = through_waypoints(times, points)
    for t, point in zip(times, points, strict=True):
        got = Piecewise().reference(float(t), spline)
        np.testing.assert_allclose([*got.position, got.yaw], point, atol=1e-9)

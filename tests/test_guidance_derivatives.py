"""Jerk and snap of every path are the slopes of its acceleration and jerk, and zero where the path rests."""

import numpy as np
import pytest

from quadstep.numbers import vector
from quadstep.world.guidance.minimum_jerk import MinimumJerk, MinimumJerkParameters, blend_bend
from quadstep.world.guidance.orbit import Orbit, OrbitParameters, ramp_bend
from quadstep.world.guidance.piecewise import Piecewise
from quadstep.world.guidance.setpoints import Step, StepParameters
from quadstep.world.guidance.spline import near_recording, through_waypoints
from tests.flights import array, through_lanes

RNG = np.random.default_rng(77)
KNOTS = np.array([0.0, 1.0, 1.7, 4.0, 5.5, 9.0])
SAMPLES = np.sort(RNG.uniform(0, 8, 200))
ORBIT = OrbitParameters(
    centre=vector(1.0, 2.0, 3.0),
    amplitude=vector(4.0, 2.0, 0.5),
    frequency=vector(0.5, 1.0, 1.5),
    phase=vector(0.3, -0.2, 1.0),
    yaw=0.1,
    yaw_rate=0.4,
    ramp=0.0,
)
PATHS = {  # law, parameters, times at which jerk or snap jumps
    "minimum jerk": (MinimumJerk(), MinimumJerkParameters(vector(0, 1, 2), vector(5, 3, -1), 0.0, 1.0, 7.0), [0.0, 7.0]),
    "orbit": (Orbit(), ORBIT, []),
    "ramped orbit": (Orbit(), ORBIT._replace(ramp=4.0), [0.0, 4.0]),
    "waypoints": (Piecewise(), through_waypoints(KNOTS, RNG.normal(size=(6, 4))), list(KNOTS)),
    "recording": (
        Piecewise(),
        near_recording(SAMPLES, np.sin(np.outer(SAMPLES, [0.5, 0.7, 1.0, 0.2])), 0.3),
        list(np.linspace(SAMPLES[0], SAMPLES[-1], 28)),
    ),
    "step": (Step(), StepParameters(vector(0, 1, 2), vector(5, 3, -1), 2.0, 0.3), [2.0]),
}
EVERY_PATH = pytest.mark.parametrize("name", PATHS)
H = 1e-4


def third_orders(name, t):
    """(acceleration, jerk, snap), shape (3, 3)."""
    law, parameters, _ = PATHS[name]
    reference = law.reference(t, parameters)
    return np.array([array(reference.acceleration), array(reference.jerk), array(reference.snap)])


@EVERY_PATH
def test_jerk_and_snap_are_slopes(name):
    tested = 0
    for t in RNG.uniform(-1.0, 10.0, 120):
        if any(abs(t - jump) < 2 * H for jump in PATHS[name][2]):
            continue
        slope = (third_orders(name, t + H) - third_orders(name, t - H)) / (2 * H)
        got = third_orders(name, t)
        scale = 1.0 + np.abs(got).max()
        np.testing.assert_allclose(got[1:], slope[:2], atol=1e-5 * scale)
        tested += 1
    assert tested > 90


@pytest.mark.parametrize("name", [name for name in PATHS if "orbit" not in name])
def test_a_path_at_rest_has_neither(name):
    for t in (-0.5, 20.0):
        assert not third_orders(name, t)[1:].any()


def test_minimum_jerk_has_the_jerk_of_its_polynomial():
    """x = 10 s^3 - 15 s^4 + 6 s^5: jerk 60 at both ends and -30 in the middle, snap -360 at first, over t_f^3 and t_f^4."""
    assert blend_bend(0.0, 2.0) == pytest.approx((60.0 / 8.0, -360.0 / 16.0))
    assert blend_bend(1.0, 2.0) == pytest.approx((-30.0 / 8.0, 0.0))
    assert blend_bend(2.0 - 1e-12, 2.0) == pytest.approx((60.0 / 8.0, 360.0 / 16.0))
    assert blend_bend(2.0, 2.0) == blend_bend(-1e-9, 2.0) == (0.0, 0.0)


def test_an_orbit_at_full_speed_has_the_rates_of_its_harmonics():
    got = Orbit().reference(1.3, ORBIT)
    for axis in range(3):
        a, w = ORBIT.amplitude[axis], ORBIT.frequency[axis]
        angle = w * 1.3 + ORBIT.phase[axis]
        assert got.jerk[axis] == pytest.approx(-a * w**3 * np.cos(angle))
        assert got.snap[axis] == pytest.approx(a * w**4 * np.sin(angle))
    assert ramp_bend(1.3, 0.0) == (0.0, 0.0)


@pytest.mark.parametrize("name", [name for name in PATHS if not isinstance(PATHS[name][0], Piecewise)])
def test_lanes_and_arrays_give_what_floats_give(name):
    law, parameters, _ = PATHS[name]
    t = np.linspace(-0.7, 9.3, 41)
    wanted = np.array([third_orders(name, float(one))[1:].ravel() for one in t]).T

    def both(time):
        reference = law.reference(time, parameters)
        return [*reference.jerk, *reference.snap]

    np.testing.assert_allclose(through_lanes(both, t), wanted, rtol=1e-11, atol=1e-11)
    np.testing.assert_allclose([np.broadcast_to(one, t.shape) for one in both(t)], wanted, rtol=1e-11, atol=1e-11)


def test_a_step_jumps_once_and_rests():
    law, parameters, _ = PATHS["step"]
    for t, wanted in ((0.0, (0, 1, 2)), (1.9999, (0, 1, 2)), (2.0, (5, 3, -1)), (1e6, (5, 3, -1))):
        got = law.reference(t, parameters)
        assert tuple(got.position) == wanted
        assert (got.yaw, got.yaw_rate) == (0.3, 0.0)
        assert [*got.velocity, *got.acceleration] == [0.0] * 6

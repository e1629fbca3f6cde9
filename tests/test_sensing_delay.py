"""Latency to the sample, of what is on board and of fixes, with and without an estimator."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quadstep.numbers import flatten, vector
from quadstep.numbers.rotations import IDENTITY
from quadstep.sensing.estimator import ErrorState
from quadstep.sensing.sensors import Sensors, filled, passed, pushed
from quadstep.sensing.suite import Suite
from quadstep.vehicle.rigid_body import Motion
from tests.sensing import GRAVITY, SENSORS, Swinging, stack, turn_between

FORCE = vector(0.0, 0.0, 9.81)


@given(st.integers(0, 5), st.lists(st.integers(), min_size=1, max_size=20))
def test_a_line_gives_back_what_was_pushed_its_length_ago(length, samples):
    line = filled("start", length)
    for tick, sample in enumerate(samples):
        assert len(pushed(line, sample)) == length
        line, out = passed(line, sample)
        assert out == (samples[tick - length] if tick >= length else "start")


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 3), st.integers(0, 4), st.integers(0, 3), st.integers(1, 5))
def test_fixes_and_rates_are_late_by_whole_samples_and_fixes_are_held(delay, lag, imu_delay, every):
    def motion(tick):
        return Motion(vector(tick, 0.0, 0.0), vector(0.0, 2.0 * tick, 0.0), IDENTITY, vector(0.0, 0.0, 3.0 * tick))

    suite = Suite(delay=delay, lag=lag, imu_delay=imu_delay)
    memory = suite.start(motion(0.0), None, None)
    for tick in range(30):
        memory = suite.sense(memory, motion(float(tick)), FORCE, None, None, float(tick), 0.01)
        if tick % every == 0:
            memory = suite.fix(memory, motion(float(tick)), None, None, float(tick), 0.01 * every)
        known = suite.measured(memory)
        spoken_of = max(tick // every * every - delay * every - lag, 0)
        assert flatten(known) == flatten(
            motion(float(spoken_of))._replace(rates=motion(float(max(tick - imu_delay, 0))).rates)
        )


@pytest.mark.parametrize(("delay", "lag", "imu_delay"), [(0, 0, 0), (2, 0, 0), (0, 3, 0), (1, 4, 0), (1, 4, 3)])
def test_an_estimator_makes_up_for_the_latency_of_fixes_but_not_for_its_own(delay, lag, imu_delay):
    """Noise-free flights: the estimate is the truth of its own instant to within what the IMU's finite rate leaves."""
    flights, suite, every, period = (
        Swinging(6),
        Suite(estimator=ErrorState(), delay=delay, lag=lag, imu_delay=imu_delay),
        5,
        1 / 400,
    )
    memory = suite.start(flights.at(0.0)[0], SENSORS, None)
    for tick in range(200):
        motion, force = flights.at(tick * period)
        memory = suite.sense(memory, motion, force, SENSORS, None, float(tick), period)
        if tick % every == 0:
            memory = suite.fix(memory, motion, SENSORS, None, float(tick), every * period)
        known, truth = suite.measured(memory), flights.at(max(tick - imu_delay, 0) * period)[0]
        assert np.abs(stack(known.position - truth.position)).max() < 3e-5
        assert np.abs(stack(known.velocity - truth.velocity)).max() < 3e-4
        assert np.abs(stack(turn_between(known.attitude, truth.attitude))).max() < 3e-5
        assert np.abs(stack(known.rates - truth.rates)).max() < 1e-3


def test_an_estimator_of_sensors_that_claim_to_be_perfect_stays_finite():
    flights, suite, perfect = Swinging(6), Suite(estimator=ErrorState()), Sensors(*[0.0] * 9, GRAVITY)
    memory = suite.start(flights.at(0.0)[0], perfect, None)
    for tick in range(100):
        motion, force = flights.at(tick / 200)
        memory = suite.fix(
            suite.sense(memory, motion, force, perfect, None, float(tick), 1 / 200), motion, perfect, None, tick, 1 / 200
        )
    assert np.abs(stack(suite.measured(memory).position - motion.position)).max() < 1e-5


@pytest.mark.parametrize("name", ["delay", "lag", "imu_delay"])
def test_a_negative_latency_is_refused(name):
    with pytest.raises(ValueError, match=name):
        Suite(**{name: -1})

"""The noise of each sensor: its size, its independence, and that a noiseless sensor draws none."""

import numpy as np
import pytest

from quadstep.numbers import flatten, vector
from quadstep.numbers.noise import key
from quadstep.numbers.rotations import conjugate, from_yaw_pitch_roll, multiply, rotation_vector
from quadstep.sensing.estimator import ErrorState
from quadstep.sensing.sensors import Sensors
from quadstep.sensing.suite import Suite
from quadstep.vehicle.rigid_body import Motion
from tests.flights import Compiled
from tests.sensing import GRAVITY, SENSORS, keys, stack

COUNT = 4000
SILENT = Sensors(*[0.0] * 9, GRAVITY)
ATTITUDE = from_yaw_pitch_roll(vector(0.7, -0.4, 0.9))
MOTION = Motion(vector(1.0, -2.0, 3.0), vector(0.4, 0.5, -0.6), ATTITUDE, vector(0.1, -0.2, 0.3))
FORCE = vector(0.5, -0.25, 9.0)
KEYS = keys(8, COUNT)


def read(suite, sensors, imu=1 / 400, fix=1 / 50, fixes=1):
    """Errors of gyro, accelerometer, position, velocity and attitude, shape (3, flight) each, at rest after some fixes."""
    memory = suite.start(MOTION, sensors, KEYS)
    for tick in range(fixes):
        memory = suite.fix(memory, MOTION, sensors, KEYS, float(tick), fix)
    memory = suite.sense(memory, MOTION, FORCE, sensors, KEYS, float(fixes), imu)
    if suite.estimator.current:
        return stack(memory.estimate.gyro - MOTION.rates), stack(memory.estimate.accelerometer - FORCE)
    known = suite.measured(memory)
    turn = rotation_vector(multiply(conjugate(ATTITUDE), known.attitude))
    gyro, position, velocity = (known.rates - MOTION.rates, known.position - MOTION.position, known.velocity - MOTION.velocity)
    return tuple(np.broadcast_to(stack(part), (3, COUNT)) for part in (gyro, position, velocity, turn))


def assert_white(errors, size):
    """Three independent axes of this standard deviation, none with a mean; 4.5 standard errors are allowed."""
    bound = 4.5 / np.sqrt(COUNT)
    np.testing.assert_allclose(errors.std(axis=1) / size, 1.0, atol=bound / np.sqrt(2.0))
    assert np.all(np.abs(errors.mean(axis=1)) < bound * size)
    assert np.all(np.abs(np.corrcoef(errors) - np.eye(3)) < bound)


@pytest.mark.parametrize("period", [1 / 400, 1 / 100])
def test_white_noise_of_the_imu_has_its_density_at_any_rate(period):
    assert_white(read(Suite(noisy=True), SILENT._replace(gyro_noise=0.01), imu=period)[0], 0.01 / np.sqrt(period))
    _, force = read(Suite(noisy=True, estimator=ErrorState()), SILENT._replace(accelerometer_noise=0.02), imu=period)
    assert_white(force, 0.02 / np.sqrt(period))


@pytest.mark.parametrize("fix", [1 / 50, 1 / 10])
def test_biases_start_anywhere_in_their_range_and_wander_by_their_density_at_any_rate(fix):
    sensors = SILENT._replace(gyro_bias=0.003, accelerometer_bias=0.05)
    for errors, size in zip(read(Suite(noisy=True, estimator=ErrorState()), sensors), (0.003, 0.05), strict=True):
        assert_white(errors, size)
    sensors = SILENT._replace(gyro_walk=0.001, accelerometer_walk=0.02)
    for errors, walk in zip(
        read(Suite(noisy=True, estimator=ErrorState()), sensors, fix=fix, fixes=9), (0.001, 0.02), strict=True
    ):
        assert_white(errors, walk * np.sqrt(9 * fix))


@pytest.mark.parametrize(("name", "place"), [("position_noise", 1), ("velocity_noise", 2), ("attitude_noise", 3)])
def test_a_fix_has_the_noise_of_its_sensor_and_no_other(name, place):
    errors = read(Suite(noisy=True), SILENT._replace(**{name: 0.02}))
    for part, error in enumerate(errors):
        if part == place:
            assert_white(error, 0.02)
        else:
            assert np.abs(error).max() < 1e-14


def test_no_two_sensors_share_their_noise_nor_two_instants():
    gyro, position, velocity, attitude = read(Suite(noisy=True), SENSORS)
    _, force = read(Suite(noisy=True, estimator=ErrorState()), SENSORS)
    again = read(Suite(noisy=True), SENSORS, fixes=2)
    suite = Suite(noisy=True, estimator=ErrorState())
    before = suite.start(MOTION, SENSORS, KEYS)
    after = suite.fix(before, MOTION, SENSORS, KEYS, 0.0, 1 / 50)
    steps = [stack(new - old) for new, old in zip(after.biases, before.biases, strict=True)]
    everything = np.concatenate([*steps, gyro, position, velocity, attitude, force, *again[1:]])
    correlations = np.corrcoef(everything) - np.eye(len(everything))
    assert np.abs(correlations).max() < 4.5 / np.sqrt(COUNT)


def test_an_estimator_changes_no_sensor():
    for suite in (Suite(noisy=True), Suite(noisy=True, estimator=ErrorState())):
        memory = suite.start(MOTION, SENSORS, KEYS)
        for tick in range(3):
            memory = suite.sense(memory, MOTION, FORCE, SENSORS, KEYS, float(tick), 0.01)
            memory = suite.fix(memory, MOTION, SENSORS, KEYS, float(tick), 0.01)
        gyro = memory.estimate.gyro if suite.estimator.current else memory.estimate.motion.rates
        first = stack(gyro) if not suite.estimator.current else first  # noqa: F821
    np.testing.assert_array_equal(stack(gyro), first)


def test_a_flight_has_its_own_noise_and_the_same_as_floats():
    sensors, suite = SENSORS, Suite(noisy=True)
    for flight in (0, 7):
        alone = key(8, flight)
        memory = suite.fix(suite.start(MOTION, sensors, alone), MOTION, sensors, alone, 5.0, 0.1)
        many = suite.fix(suite.start(MOTION, sensors, KEYS), MOTION, sensors, KEYS, 5.0, 0.1)
        np.testing.assert_allclose(flatten(memory), stack(flatten(many))[:, flight], rtol=1e-13)
    assert len(np.unique(stack(many.estimate.motion.position)[0])) == COUNT


def test_without_noise_the_truth_comes_through_exactly_and_not_one_instruction_is_emitted():
    suite = Suite()
    memory = suite.start(MOTION, None, None)
    later = MOTION._replace(position=vector(9.0, 8.0, 7.0), rates=vector(3.0, 2.0, 1.0))
    memory = suite.fix(suite.sense(memory, later, FORCE, None, None, 1.0, 0.01), later, None, None, 1.0, 0.01)
    assert flatten(suite.measured(memory)) == flatten(later)

    def law(memory, motion, force, tick):
        memory = suite.sense(memory, motion, force, None, None, tick, 0.01)
        return suite.measured(suite.fix(memory, motion, None, None, tick, 0.01))

    assert Compiled(law, memory, MOTION, FORCE, 0.0).instructions == 0

"""The error-state Kalman filter: its linearisation, its update, late fixes, and its arithmetic."""

import numpy as np
import pytest

from quadstep.numbers import Vector, flatten, matrix
from quadstep.numbers.rotations import from_rotation_vector, multiply
from quadstep.sensing import estimator
from quadstep.sensing.estimator import ErrorState, Instant, Transition, carried, diagonal, propagated, transition
from quadstep.sensing.sensors import Navigation, fixed, navigation
from quadstep.sensing.suite import Suite
from tests.flights import Compiled
from tests.sensing import GRAVITY, NOTHING, SENSORS, Swinging, covariance_matrix, errors_of, keys, stack

PERIOD, EVERY = 1 / 200, 8


def dead_reckoned(state, gyro_bias, force_bias, flights, first, samples, period=PERIOD):
    """The state after some samples of the IMU with these biases, and nothing else."""
    motion, force = flights.at(first * period)
    memory = estimator.start(state, motion.rates + gyro_bias, SENSORS, 0, 0)._replace(accelerometer=force + force_bias)
    for tick in range(first + 1, first + 1 + samples):
        motion, force = flights.at(tick * period)
        memory = estimator.predict(memory, motion.rates + gyro_bias, force + force_bias, GRAVITY, period)
    return memory.now.state


def test_dead_reckoning_follows_the_truth_to_second_order():
    flights, ends = Swinging(8), []
    for rate in (100, 200):
        state = dead_reckoned(navigation(flights.at(0.0)[0]), NOTHING, NOTHING, flights, 0, rate, 1 / rate)
        ends.append(errors_of(state, NOTHING, NOTHING, flights.at(1.0)[0], (NOTHING, NOTHING))[:9])
    assert np.abs(ends[1]).max() < 3e-4
    np.testing.assert_allclose(ends[0], 4.0 * ends[1], atol=0.02 * np.abs(ends[0]).max())


@pytest.mark.parametrize("place", range(15))
def test_an_error_grows_as_the_transition_says(place):
    """A small error in one of the fifteen, against the difference of two dead reckonings of 40 ms.

    What a gyro's bias does to the velocity within the transition, of second order in its time, is left out.
    """
    flights, size, first, samples = Swinging(8, quick=2.0), 1e-4, 40, 8
    time = samples * PERIOD
    error = Vector(np.where(np.arange(15) == place, size, 0.0).tolist())
    dp, dv, dtheta, da, dw = estimator.parts(error)
    start = navigation(flights.at(first * PERIOD)[0])
    true = Navigation(start.position + dp, start.velocity + dv, multiply(from_rotation_vector(dtheta), start.attitude))
    believed = dead_reckoned(start, NOTHING, NOTHING, flights, first, samples)
    really = dead_reckoned(true, -1.0 * dw, -1.0 * da, flights, first, samples)
    grown = errors_of(believed, NOTHING, NOTHING, really, (dw, da))
    step = transition(start, Instant(believed, time), GRAVITY)
    predicted = stack(carried(error, step)).reshape(15, -1)
    moved = np.abs(grown - stack(error)[:, None]).max(1).reshape(5, 3).max(1)
    half = 0.5 * size * time * np.linalg.norm(stack(step.gained), axis=0).max() * (place >= estimator.GYRO_BIAS)
    left_out = 1.1 * half * np.array([time / 3.0, 1.0, 0.0, 0.0, 0.0])
    assert np.all(np.abs(predicted - grown).reshape(5, -1).max(1) < 0.02 * moved + 0.003 * size * time + left_out)


def test_the_covariance_grows_as_the_errors_do():
    rng = np.random.default_rng(4)
    step = Transition(0.3, Vector(rng.normal(size=3).tolist()), matrix(*rng.normal(size=(3, 3)).tolist()))
    f = np.array([list(carried(Vector(row.tolist()), step)) for row in np.eye(15)]).T
    p = np.diag(rng.uniform(0.5, 2.0, 15))
    q = np.kron(np.diag([0.0, 2e-2, 2e-3, 1e-3, 1e-4]) ** 2, np.eye(3)) * 0.3
    drift = np.eye(15) + 0.15 * np.eye(15, k=3) * (np.arange(15)[:, None] < 3)
    got = covariance_matrix(propagated(diagonal(Vector(np.diag(p).tolist())), step, SENSORS))[0]
    np.testing.assert_allclose(got, f @ p @ f.T + drift @ q @ drift.T, rtol=1e-12, atol=1e-14)


def test_nine_numbers_one_by_one_are_the_kalman_update_with_all_at_once():
    rng = np.random.default_rng(9)
    root = 0.01 * rng.normal(size=(15, 15))
    p, r, h = root @ root.T, np.diag([1e-4] * 3 + [2.5e-3] * 3 + [4e-4] * 3), np.eye(15)[:9]
    state = Navigation(
        *(Vector(rng.normal(size=3).tolist()) for _ in range(2)), from_rotation_vector(Vector([1.0, -2.0, 0.5]))
    )
    memory = estimator.start(state, NOTHING, SENSORS, 0, 0)
    memory = memory._replace(covariance=tuple(Vector(p[i, i:].tolist()) for i in range(15)))
    surprise = 1e-3 * rng.normal(size=9)
    dp, dv, dtheta = (Vector(part.tolist()) for part in surprise.reshape(3, 3))
    fix = Navigation(state.position + dp, state.velocity + dv, multiply(from_rotation_vector(dtheta), state.attitude))
    after = estimator.correct(memory, fix, SENSORS)
    gain = p @ h.T @ np.linalg.inv(h @ p @ h.T + r)
    np.testing.assert_allclose(covariance_matrix(after.covariance)[0], p - gain @ h @ p, atol=1e-15)
    moved = errors_of(state, NOTHING, NOTHING, after.now.state, (after.gyro_bias, after.accelerometer_bias))
    np.testing.assert_allclose(moved, gain @ surprise, atol=1e-12)


@pytest.mark.parametrize(("delay", "lag"), [(0, 3), (2, 0), (2, 3)])
def test_a_filter_of_late_fixes_is_a_filter_of_the_past_followed_by_a_prediction(delay, lag):
    rng, flights, count = np.random.default_rng(2), Swinging(8), 45
    noisy = SENSORS._replace(attitude_noise=0.002)
    imu = [
        tuple(
            Vector(list(stack(part) + size * rng.normal(size=(3, 8))))
            for part, size in zip((m.rates, f), (0.03, 0.3), strict=True)
        )
        for m, f in (flights.at(tick * PERIOD) for tick in range(count))
    ]
    spoken_of = [max(tick - delay * EVERY - lag, 0) for tick in range(0, count, EVERY)]
    noise = [[Vector(list(rng.normal(size=(3, 8)))) for _ in range(3)] for _ in spoken_of]
    fixes = [fixed(navigation(flights.at(past * PERIOD)[0]), noisy, draw) for past, draw in zip(spoken_of, noise, strict=True)]
    first = fixed(navigation(flights.at(0.0)[0]), noisy, noise[0])

    def run(delay, lag, due):
        memory = estimator.start(first, imu[0][0], noisy, lag, delay)
        for tick, sample in enumerate(imu):
            memory = estimator.predict(memory, *sample, GRAVITY, PERIOD if tick else 0.0)
            for fix in (fix for fix, when in zip(fixes, due, strict=True) if when == tick):
                memory = estimator.correct(memory, fix, noisy)
        return memory

    late, past = run(delay, lag, range(0, count, EVERY)), run(0, 0, spoken_of)
    size = np.sqrt(np.einsum("fii->if", covariance_matrix(late.covariance)))
    apart = errors_of(
        late.now.state, late.gyro_bias, late.accelerometer_bias, past.now.state, (past.gyro_bias, past.accelerometer_bias)
    )
    assert np.abs(apart / size).max() < 0.01
    np.testing.assert_allclose(stack(flatten(late.covariance)), stack(flatten(past.covariance)), rtol=1e-3, atol=1e-9)


def test_a_wrong_start_is_forgotten():
    """Half a radian and half a metre off, with sensors that admit as much at the start."""
    flights, suite, sensors = (
        Swinging(8),
        Suite(estimator=ErrorState()),
        SENSORS._replace(attitude_noise=0.2, position_noise=0.2),
    )
    memory = suite.start(flights.at(0.0)[0], sensors, None)
    wrong = memory.estimate.now.state._replace(
        position=memory.estimate.now.state.position + Vector([0.5, 0.0, 0.0]),
        attitude=multiply(from_rotation_vector(Vector([0.3, -0.3, 0.3])), memory.estimate.now.state.attitude),
    )
    memory = memory._replace(estimate=memory.estimate._replace(now=Instant(wrong, 0.0), settled=wrong))
    for tick in range(800):
        motion, force = flights.at(tick * PERIOD)
        memory = suite.sense(memory, motion, force, sensors, None, float(tick), PERIOD)
        if tick % EVERY == 0:
            memory = suite.fix(memory, motion, sensors, None, float(tick), EVERY * PERIOD)
    left = errors_of(suite.measured(memory), NOTHING, NOTHING, motion, (NOTHING, NOTHING))
    assert np.abs(left[:6]).max() < 0.05
    assert np.abs(left[6:9]).max() < 0.02


def test_the_rates_are_freed_of_the_bias_of_the_gyro():
    flights, suite, key = Swinging(8), Suite(noisy=True, estimator=ErrorState()), keys(1, 8)
    sensors = SENSORS._replace(gyro_noise=1e-4, gyro_walk=0.0, gyro_bias=0.05)
    memory = suite.start(flights.at(0.0)[0], sensors, key)
    for tick in range(400):
        motion, force = flights.at(tick * PERIOD)
        memory = suite.sense(memory, motion, force, sensors, key, float(tick), PERIOD)
        if tick % EVERY == 0:
            memory = suite.fix(memory, motion, sensors, key, float(tick), EVERY * PERIOD)
    assert np.abs(stack(memory.biases[0])).max() > 0.05
    assert np.abs(stack(suite.measured(memory).rates - motion.rates)).max() < 0.015


def flight(suite, width, kind, sense, fix, seconds):
    """The memory after every fix of some flights."""
    flights, key = Swinging(width, kind=kind), keys(1, width, kind)
    memory = suite.start(flights.at(0.0)[0], SENSORS, key)
    for tick in range(round(seconds / PERIOD)):
        motion, force = flights.at(tick * PERIOD)
        memory = sense(memory, motion, force, key, float(tick))
        if tick % EVERY == 0:
            memory = fix(memory, motion, key, float(tick))
            yield memory


def laws(suite):
    """`sense` and `fix` of a suite without what does not change."""
    return (
        lambda memory, motion, force, key, tick: suite.sense(memory, motion, force, SENSORS, key, tick, PERIOD),
        lambda memory, motion, key, tick: suite.fix(memory, motion, SENSORS, key, tick, EVERY * PERIOD),
    )


@pytest.mark.parametrize("double", [True, False], ids=["f64", "f32"])
def test_lanes_give_what_arrays_give_and_in_f32_the_covariance_stays_positive(double):
    suite, width, kind = Suite(noisy=True, estimator=ErrorState(), delay=1, lag=1), 8, np.float64 if double else np.float32
    sense, fix = laws(suite)
    key, (motion, force) = keys(1, width), Swinging(width).at(0.0)
    memory = suite.start(motion, SENSORS, key)
    likes = (sense, (memory, motion, force, key, 0.0)), (fix, (memory, motion, key, 0.0))
    compiled = [Compiled(law, *like, double=double, width=width) for law, like in likes]
    seconds = 0.2 if double else 3.0
    lanes, arrays = (list(flight(suite, width, *how, seconds)) for how in ((kind, *compiled), (np.float64, sense, fix)))
    if double:
        np.testing.assert_allclose(stack(flatten(lanes[-1])), stack(flatten(arrays[-1])), rtol=1e-9, atol=1e-12)
        return
    for narrow, wide in zip(lanes[::5], arrays[::5], strict=True):
        p, exact = (covariance_matrix(memory.estimate.covariance).astype(np.float64) for memory in (narrow, wide))
        size, wanted = (np.sqrt(np.einsum("fii->fi", each)) for each in (p, exact))
        assert np.linalg.eigvalsh(p / size[:, :, None] / size[:, None, :]).min() > 0.1
        np.testing.assert_allclose(size, wanted, rtol=1e-4)
        error = np.abs(stack(narrow.estimate.now.state.position) - stack(wide.estimate.now.state.position))
        assert error.max() < 0.01 * wanted[:, :3].min()

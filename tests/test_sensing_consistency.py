"""Over many flights: errors of the estimate are as large as the filter says (NEES, NIS), and much smaller than the sensors'.

Over independent flights the normalised estimation error squared, e^T P^-1 e, is chi-square with 15 degrees of freedom, and the
normalised innovation squared with 9 (Bar-Shalom, Li, Kirubarajan 2001, section 5.4).
"""

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
import pytest
from scipy.stats import chi2

from quadstep.sensing.estimator import ErrorState, innovation, propagated, transition
from quadstep.sensing.sensors import FIX, Navigation, draws, fixed, navigation
from quadstep.sensing.suite import Suite
from quadstep.vehicle.rigid_body import Motion
from tests.sensing import GRAVITY, NOTHING, SENSORS, Swinging, covariance_matrix, errors_of, keys, stack

FLIGHTS, PERIOD, EVERY, SECONDS = 150, 1 / 200, 8, 4
ESTIMATORS = {
    "at once": Suite(noisy=True, estimator=ErrorState()),
    "95 ms late": Suite(noisy=True, estimator=ErrorState(), delay=2, lag=3),
}
LATENCIES = pytest.mark.parametrize("latency", ["at once", "95 ms late"])


class Row(NamedTuple):
    """At one fix: what happens, the memory before and after it, the truth of which it speaks, and what it says of that."""

    t: float
    motion: Motion
    known: Motion
    before: Any
    after: Any
    past: Motion
    fix: Navigation


@lru_cache
def flown(suite):
    """Every fix of `FLIGHTS` flights."""
    flights, key, rows = Swinging(FLIGHTS), keys(1, FLIGHTS), []
    memory = suite.start(flights.at(0.0)[0], SENSORS, key)
    for tick in range(round(SECONDS / PERIOD)):
        motion, force = flights.at(tick * PERIOD)
        memory = suite.sense(memory, motion, force, SENSORS, key, float(tick), PERIOD)
        if tick % EVERY == 0:
            before, memory = memory, suite.fix(memory, motion, SENSORS, key, float(tick), EVERY * PERIOD)
            past = flights.at(max(tick - EVERY * suite.delay - suite.lag, 0) * PERIOD)[0]
            fix = fixed(navigation(past), SENSORS, draws(key, FIX, float(tick), 3))
            rows.append(Row(tick * PERIOD, motion, suite.measured(memory), before, memory, past, fix))
    return rows


def rmse(suite, what, after=1.5):
    """Of what is known, or of what the fixes say: position [m], velocity [m/s] and attitude [rad], of an axis."""
    rows = [row for row in flown(suite) if row.t >= after]
    errors = [errors_of(getattr(row, what), NOTHING, NOTHING, row.motion, (NOTHING, NOTHING))[:9] for row in rows]
    return np.sqrt(np.mean(np.square(errors), axis=(0, 2)).reshape(3, 3).mean(1))


def bounds(freedom, count):
    """Where the mean of `count` chi-square numbers lies with a chance of 99.9 %."""
    return chi2.ppf((0.0005, 0.9995), freedom * count) / count


@LATENCIES
def test_estimation_errors_are_as_large_as_the_filter_says(latency):
    means = []
    for row in flown(ESTIMATORS[latency])[5::10]:
        known = row.after.estimate
        error = errors_of(known.settled, known.gyro_bias, known.accelerometer_bias, row.past, row.before.biases).T[:, :, None]
        squares = np.swapaxes(error, 1, 2) @ np.linalg.solve(covariance_matrix(known.covariance), error)
        means.append(squares.mean())
    low, high = bounds(15, FLIGHTS)
    assert low < min(means)
    assert max(means) < high


@LATENCIES
def test_innovations_are_white_and_as_large_as_the_filter_says(latency):
    """Every fix of every flight counts, since the innovations of a Kalman filter are independent of one another."""
    rows, normalised = flown(ESTIMATORS[latency]), []
    for row in rows[ESTIMATORS[latency].delay + 1 :]:
        known = row.before.estimate
        seen = (*known.older, (*known.recent, known.now)[0]._replace(since=known.elapsed))[0]
        p = covariance_matrix(propagated(known.covariance, transition(known.settled, seen, GRAVITY), SENSORS))
        root = np.linalg.cholesky(p[:, :9, :9] + np.diag([1e-4] * 3 + [2.5e-3] * 3 + [4e-4] * 3))
        normalised.append(np.linalg.solve(root, stack(innovation(row.fix, seen.state)).T[:, :, None])[:, :, 0])
    normalised = np.array(normalised)  # fix, flight, 9
    low, high = bounds(9, normalised[:, :, 0].size)
    assert low < np.square(normalised).sum(2).mean() < high
    one_later = (normalised[1:] * normalised[:-1]).mean((0, 1))
    assert np.abs(one_later).max() < 4.0 / np.sqrt(normalised[1:, :, 0].size)


@LATENCIES
def test_the_estimate_is_several_times_better_than_the_fixes(latency):
    gain = rmse(ESTIMATORS[latency], "fix") / rmse(ESTIMATORS[latency], "known")
    assert np.all(gain > ((2.4, 3.2, 5.0) if latency == "at once" else (20.0, 10.0, 8.0)))


@LATENCIES
def test_both_biases_are_found(latency):
    rows = flown(ESTIMATORS[latency])
    for name, place, share in (("gyro_bias", 0, 0.45), ("accelerometer_bias", 1, 0.45)):
        first, last = (
            np.sqrt(np.mean(stack(row.after.biases[place] - getattr(row.after.estimate, name)) ** 2))
            for row in (rows[0], rows[-1])
        )
        assert last < share * first

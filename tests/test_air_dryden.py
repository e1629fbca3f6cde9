"""Dryden turbulence: its scales, and that a step of any length keeps variance and correlation of the continuous field."""

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy import signal

from quadstep.numbers import Vector, flatten, rebuild
from quadstep.world.air import DRAWS, Dryden, gamma_tails, gusts, scales, start_turbulence, turbulence_step
from tests.flights import array, column, through_lanes

FIELD = Dryden(wind_20=15.0, height=20.0, airspeed=10.0)
PERIODS = [1e-6, 1e-3, 0.02, 0.3, 2.0, 30.0, 1e4]
BEGUN = start_turbulence()._replace(begun=1.0)


def shares(dryden=FIELD):
    """(tau, sigma) of u, v, w, by the formulas in feet."""
    feet = dryden.height / 0.3048
    shape = 0.177 + 0.000823 * feet
    lengths = np.array([feet / shape**1.2] * 2 + [feet]) * 0.3048
    vertical = 0.1 * dryden.wind_20
    return lengths / dryden.airspeed, np.array([vertical / shape**0.4] * 2 + [vertical])


def step(memory, draws, period, dryden=FIELD):
    return array(Vector(flatten(turbulence_step(memory, dryden, column(draws), period))[1:]))


def as_memory(states):
    return rebuild(BEGUN, iter([1.0, *map(float, states)]))


def transition(period):
    """A step as matrices: (what it does to the state, what the draws add)."""
    keep = np.array([step(as_memory(unit), np.zeros(DRAWS), period) for unit in np.eye(5)]).T
    add = np.array([step(BEGUN, unit, period) for unit in np.eye(DRAWS)]).T
    return keep, add


OUTPUT = np.array([array(gusts(as_memory(unit))) for unit in np.eye(5)]).T
FIRST = np.array([step(start_turbulence(), unit, 0.02) for unit in np.eye(DRAWS)]).T
STATIONARY = FIRST @ FIRST.T


def correlation(lag):
    """Of u, v, w at two times `lag` apart: sigma^2 e^-x for u, sigma^2 e^-x (1 - x/2) for v and w, with x = lag / tau."""
    tau, sigma = shares()
    x = lag / tau
    return sigma**2 * np.exp(-x) * (1 - np.array([0, 0.5, 0.5]) * x)


def test_scales_are_those_of_mil_f_8785c():
    # 20 ft: 0.177 + 0.01646 = 0.19346; L_u = 20 / 0.19346^1.2 = 143.59 ft; sigma_u / sigma_w = 0.19346^-0.4 = 1.9291
    lengths, sigmas = scales(Dryden(10.0, 20.0 * 0.3048, 5.0))
    np.testing.assert_allclose(array(lengths) / 0.3048, [143.59, 143.59, 20.0], rtol=1e-4)
    np.testing.assert_allclose(array(sigmas), [1.9291, 1.9291, 1.0], rtol=1e-4)
    # at 1000 ft turbulence is isotropic: 0.177 + 0.823 = 1
    lengths, sigmas = scales(Dryden(10.0, 304.8, 5.0))
    np.testing.assert_allclose(array(lengths), 304.8, rtol=1e-12)
    np.testing.assert_allclose(array(sigmas), 1.0, rtol=1e-12)


def test_the_first_step_draws_a_stationary_state():
    _, sigma = shares()
    covariance = OUTPUT @ STATIONARY @ OUTPUT.T
    np.testing.assert_allclose(covariance, np.diag(sigma**2), rtol=1e-12, atol=1e-15)
    again = np.array([step(start_turbulence(), unit, 5.0) for unit in np.eye(DRAWS)]).T
    np.testing.assert_allclose(again, FIRST, atol=1e-15)


@pytest.mark.parametrize("period", PERIODS)
def test_a_step_of_any_period_keeps_the_stationary_covariance(period):
    keep, add = transition(period)
    np.testing.assert_allclose(keep @ STATIONARY @ keep.T + add @ add.T, STATIONARY, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("period", PERIODS)
def test_steps_of_any_period_have_the_correlation_of_drydens_field(period):
    keep, _ = transition(period)
    for count in (1, 2, 7):
        got = OUTPUT @ np.linalg.matrix_power(keep, count) @ STATIONARY @ OUTPUT.T
        np.testing.assert_allclose(got, np.diag(correlation(count * period)), rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("period", PERIODS[1:5])
def test_two_steps_are_one_of_twice_the_period(period):
    keep, add = transition(period)
    twice, added = transition(2 * period)
    np.testing.assert_allclose(keep @ keep, twice, rtol=1e-12)
    np.testing.assert_allclose(keep @ add @ add.T @ keep.T + add @ add.T, added @ added.T, rtol=1e-9, atol=1e-15)


@pytest.mark.parametrize("period", [1e-5, 1e-3, 0.1])
def test_noise_of_a_short_step_is_that_of_the_integral(period):
    tau, sigma = shares()
    h = period / tau[2]
    z1, z2 = np.exp(-(s := np.linspace(0, h, 2001))), s * np.exp(-s)  # answers of the states to a pulse
    wanted = sigma[2] ** 2 * np.array([[np.trapezoid(a * b, s) for a in (z1, z2)] for b in (z1, z2)])
    _, add = transition(period)
    np.testing.assert_allclose((add @ add.T)[3:, 3:], wanted, rtol=2e-6)


def test_u_v_and_w_are_independent():
    keep, add = transition(0.1)
    blocks = [[0], [1, 2], [3, 4]]
    for i, one in enumerate(blocks):
        for other in blocks[i + 1 :]:
            assert not np.any(keep[np.ix_(one, other)])
            assert not np.any((add @ add.T)[np.ix_(one, other)])


def test_a_field_that_stands_still_stays_and_no_wind_is_no_turbulence():
    frozen = FIELD._replace(airspeed=0.0)
    started = step(start_turbulence(), (1, -2, 0.5, 0.3, 2), 0.02, frozen)
    assert np.all(started != 0.0)
    np.testing.assert_allclose(step(as_memory(started), (3, 1, 4, 1, 5), 0.02, frozen), started, rtol=1e-15)
    assert not np.any(step(start_turbulence(), (1, -2, 0.5, 0.3, 2), 0.02, FIELD._replace(wind_20=0.0)))


@pytest.mark.parametrize("double", [True, False], ids=["f64", "f32"])
def test_gamma_tails_are_the_incomplete_gamma_functions(double):
    from scipy.special import gammainc

    x = np.concatenate([np.logspace(-6, 2, 200), [0.0, 0.25, 0.2499999, 100.0]])
    wanted = [gammainc(n, x) for n in (1, 2, 3)]
    got = through_lanes(lambda x: list(gamma_tails(x)), x, double=double)
    np.testing.assert_allclose(got, wanted, rtol=1e-11 if double else 1e-4)
    floats = np.array([gamma_tails(float(value)) for value in x]).T
    np.testing.assert_allclose(floats, wanted, rtol=1e-11)


PERIOD, FLIGHTS, SAMPLES = 0.05, 64, 4096


@pytest.fixture(scope="module")
def records():
    """u, v, w of many flights, shape (3, FLIGHTS, SAMPLES)."""
    rng, memory, rows = np.random.default_rng(21), start_turbulence(), []
    for _ in range(SAMPLES):
        memory = turbulence_step(memory, FIELD, Vector(rng.normal(size=(DRAWS, FLIGHTS))), PERIOD)
        rows.append(np.array(list(gusts(memory))))
    return np.array(rows).transpose(1, 2, 0)


def spectrum(omega):
    """Of u, v, w, one-sided over angular frequency [m^2/s]: MIL-F-8785C."""
    tau, sigma = (part[:, None] for part in shares())
    s = (tau * omega) ** 2
    first = sigma**2 * 2 * tau / math.pi / (1 + s)
    second = sigma**2 * tau / math.pi * (1 + 3 * s) / (1 + s) ** 2
    return np.concatenate([first[:1], second[1:]])


def test_the_spectrum_of_many_flights_is_drydens(records):
    frequency, density = signal.welch(records, fs=1 / PERIOD, nperseg=1024, window="hann", detrend=False)
    omega, density = 2 * math.pi * frequency[3:], density.mean(axis=1)[:, 3:] / (2 * math.pi)
    folds = 2 * math.pi / PERIOD * np.arange(1, 200)  # a sampled spectrum holds what is folded into it
    wanted = spectrum(omega) + sum(spectrum(fold - omega) + spectrum(fold + omega) for fold in folds)
    edges = np.geomspace(omega[0], omega[-1] * 1.001, 13)
    for low, high in pairwise(edges):
        inside = (omega >= low) & (omega < high)
        if inside.any():
            segments = FLIGHTS * (SAMPLES / 1024 * 2 - 1) * inside.sum()
            bound = 4.5 * math.sqrt(2.0 / segments) + 0.01
            np.testing.assert_allclose((density / wanted)[:, inside].mean(axis=1), 1.0, atol=bound)


def test_the_variance_of_many_flights_is_that_of_the_scales_from_the_first_sample_on(records):
    _, sigma = shares()
    np.testing.assert_allclose(records.var(axis=(1, 2)) / sigma**2, 1.0, atol=0.1)
    start = records[:, :, 0].std(axis=1) / sigma
    np.testing.assert_allclose(start, 1.0, atol=4.5 / math.sqrt(2 * FLIGHTS))

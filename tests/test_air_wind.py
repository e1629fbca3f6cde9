"""Wind at a time: its parts, their directions, and the axes of the turbulence."""

import math

import numpy as np
import pytest

from quadstep.numbers import vector
from quadstep.world.air import DRAWS, Dryden, Turbulence, Wind, start_turbulence, steady, untroubled, wind_at
from tests.flights import array, column

NONE = vector(0.0, 0.0, 0.0)
CALM = Wind(NONE, NONE, 0.0, NONE, gust_start=0.0, gust_length=1.0, turbulence=Dryden(0.0, 6.0, 1.0))
ALONG = Turbulence(1.0, 1.0 / math.sqrt(2.0), vector(0.0, 0.0), vector(0.0, 0.0))
ACROSS = Turbulence(1.0, 0.0, vector(1.0 / math.sqrt(3.0), 0.0), vector(0.0, 0.0))
VERTICAL = Turbulence(1.0, 0.0, vector(0.0, 0.0), vector(1.0 / math.sqrt(3.0), 0.0))


def blowing(wind, t=0.0, memory=None):
    return array(wind_at(wind, memory or start_turbulence(), t))


def test_a_step_takes_five_draws():
    assert DRAWS == 5


def test_calm_is_calm_and_the_mean_blows_always():
    assert blowing(CALM, 3.0).tolist() == [0, 0, 0]
    for t in (0.0, 2.0, 1e3):
        assert blowing(CALM._replace(mean=vector(3.0, -4.0, 0.5)), t).tolist() == [3, -4, 0.5]


def test_wind_swings_about_the_mean():
    wind = CALM._replace(mean=vector(8.5, 0.0, 0.0), swing=vector(2.4, 0.0, 1.0), swing_frequency=2.0)
    for t in (0.0, 0.3, math.pi / 4, 2.0):
        np.testing.assert_allclose(blowing(wind, t), [8.5 + 2.4 * math.sin(2 * t), 0, math.sin(2 * t)], atol=1e-12)


def test_a_gust_comes_and_goes_within_its_length():
    wind = CALM._replace(gust=vector(0.0, 6.0, -2.0), gust_start=5.0, gust_length=4.0)
    for t, share in [(0.0, 0), (5.0, 0), (6.0, 0.5), (7.0, 1.0), (8.0, 0.5), (9.0, 0), (50.0, 0)]:
        np.testing.assert_allclose(blowing(wind, t), [0, 6 * share, -2 * share], atol=1e-12)
    assert abs(blowing(wind, 5.001)[1]) < 1e-5  # it begins softly


@pytest.mark.parametrize("heading", [0.0, 0.7, 2.0, -2.5, math.pi])
@pytest.mark.parametrize("climb", [0.0, 3.0])
def test_turbulence_is_along_the_mean_wind_to_its_left_and_up(heading, climb):
    mean = np.array([7 * math.cos(heading), 7 * math.sin(heading), climb])
    wind = CALM._replace(mean=column(mean))
    left = [-math.sin(heading), math.cos(heading), 0]
    for memory, direction in [(ALONG, [math.cos(heading), math.sin(heading), 0]), (ACROSS, left), (VERTICAL, [0, 0, 1])]:
        np.testing.assert_allclose(blowing(wind, 0.0, memory) - mean, direction, atol=1e-12)


@pytest.mark.parametrize("mean", [(0, 0, 0), (0, 0, 2)])
def test_turbulence_without_a_level_wind_is_along_x(mean):
    wind = CALM._replace(mean=column(mean))
    for memory, direction in [(ALONG, [1, 0, 0]), (ACROSS, [0, 1, 0]), (VERTICAL, [0, 0, 1])]:
        np.testing.assert_allclose(blowing(wind, 0.0, memory) - mean, direction, atol=1e-15)


def test_without_swing_and_gust_the_mean_is_all_there_is_to_the_bit():
    rng = np.random.default_rng(5)

    def some(*sizes):
        return rng.choice([0.0, 1.0, -1.0, 1e5, np.nan], 2000, p=[0.6, 0.1, 0.1, 0.1, 0.1]) * rng.choice(sizes, 2000)

    swing, gust = vector(some(0.0), some(0.0, 2.0), some(0.0)), vector(some(0.0), some(0.0), some(0.0, 1.0))
    wind = Wind(vector(3.0, 0.0, -2.0), swing, some(1.0, 20.0), gust, 1.0, some(0.0, 2.0), None)
    with np.errstate(all="ignore"):
        for t in (0.0, 1.0, 1.5, 2000.0):
            holds, mean = steady((wind, t))
            assert np.any(holds)
            for one, other in zip(mean, untroubled((wind, t)), strict=True):
                np.testing.assert_array_equal(np.broadcast_to(one, holds.shape)[holds], other[holds])

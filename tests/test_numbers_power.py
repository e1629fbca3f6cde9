"""Powers with a sign: the same bits for every kind of number, and slopes that are known at zero."""

import math

import numpy as np
import pytest

from quadstep.numbers import exp, log, power, vector
from quadstep.numbers.dual import Seeds, slopes_of
from tests.flights import through_lanes

VALUES = np.concatenate([np.random.default_rng(1).normal(size=200), 10.0 ** np.linspace(-200, 200, 41), [0.0, 1.0, -1.0]])


@pytest.mark.parametrize("a", [0.3, 0.5, 1.0, 1.7, 3.0])
def test_a_power_is_that_of_the_size_with_the_sign(a):
    x = VALUES[np.abs(a * np.log(np.maximum(np.abs(VALUES), 1e-300))) < 690.0]
    got = [power(one, a) for one in x.tolist()]
    assert got == pytest.approx([math.copysign(abs(one) ** a, one) for one in x.tolist()], rel=3e-13)
    assert [power(-one, a) for one in x.tolist()] == [-one for one in got]
    assert power(x, a).tolist() == got
    assert through_lanes(lambda one: power(one, a), x).tolist() == got
    assert math.isnan(power(math.nan, a))


@pytest.mark.parametrize(("a", "slope"), [(1.5, 0.0), (1.0, 1.0), (2.0, 0.0)])
def test_slopes_of_powers_at_zero(a, slope):
    (x,) = Seeds(1, 1.0).seeded([0.0], 0)
    _, slopes, lost = slopes_of([power(3.0 * x, a)], 1)
    assert slopes[0, 0] == pytest.approx(3.0 * slope)
    assert lost == [None]


@pytest.mark.parametrize(("law", "why"), [
    (lambda x: power(x, 0.5), "a power below 1 of zero (test_numbers_power.py, line "),
    (lambda x: exp(0.5 * log(abs(x))), "a logarithm of zero (test_numbers_power.py, line "),
])  # fmt: skip
def test_what_has_no_slope_at_zero_is_named(law, why):
    (x,) = Seeds(1, 1.0).seeded([0.0], 0)
    _, _, (lost,) = slopes_of([law(x)], 1)
    assert lost
    assert lost.startswith(why)


def test_slopes_away_from_zero_are_those_of_differences():
    for value in (-2.0, 0.3, 5.0):
        x, a = Seeds(2, 1.0).seeded([value, 1.7], 0)
        _, slopes, _ = slopes_of([power(x, a)], 2)
        h = 1e-6
        by_x = (power(value + h, 1.7) - power(value - h, 1.7)) / (2.0 * h)
        by_a = (power(value, 1.7 + h) - power(value, 1.7 - h)) / (2.0 * h)
        assert slopes[0] == pytest.approx([by_x, by_a], rel=1e-7)


def test_a_norm_at_zero_has_the_slope_of_its_side():
    way = np.array([3.0, 4.0])
    for side in (1.0, -1.0):
        seeds = Seeds(2, 1.0, side * way)
        x, y = seeds.seeded([0.0, 0.0], 0)
        _, slopes, lost = slopes_of([vector(x, 2.0 * y).norm()], 2)
        assert slopes[0] == pytest.approx(side * np.array([3.0, 16.0]) / math.hypot(3.0, 8.0))
        assert lost == [None]
        assert len(seeds.edges) == 1


def test_numbers_add_to_each_entry_of_a_vector():
    v = vector(1.0, 2.0)
    assert [list(one) for one in (v + 4.0, 4.0 + v, v - 4.0, 4.0 - v)] == [[5.0, 6.0], [5.0, 6.0], [-3.0, -2.0], [3.0, 2.0]]

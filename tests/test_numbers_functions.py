"""The functions of a number on Python floats and NumPy arrays, against `math` and IEEE 754."""

import itertools
import math

import numpy as np
import pytest
import sympy
from hypothesis import given
from hypothesis import strategies as st

from quadstep.numbers import absolute, atan2, clip, cos, exp, log, maximum, minimum, sigmoid, sin, sqrt, where

ANY = st.floats(allow_nan=False)
FINITE = st.floats(allow_nan=False, allow_infinity=False)


@pytest.mark.parametrize("bad", [math.inf, -math.inf, math.nan])
def test_sine_and_cosine_of_what_is_not_finite_are_nan_and_raise_nothing(bad):
    assert math.isnan(sin(bad))
    assert math.isnan(cos(bad))


def test_float_exponential_overflows_to_infinity_and_underflows_to_zero():
    assert exp(1e4) == math.inf
    assert exp(math.inf) == math.inf
    assert exp(-1e4) == 0.0
    assert math.isnan(exp(math.nan))


def test_float_square_root_below_zero_is_nan():
    assert math.isnan(sqrt(-1.0))
    assert math.isnan(sqrt(math.nan))
    assert sqrt(math.inf) == math.inf


def test_logarithm_stops_falling_below_the_smallest_normal_number():
    assert math.log(2.0**-1023) <= log(5e-324) < log(2.0**-1022)


def test_logarithm_of_a_symbol_is_sympys():
    x = sympy.Symbol("x", positive=True)
    assert sympy.diff(log(x), x) == 1 / x


def test_float_products_overflow_to_infinity_without_raising():
    assert sigmoid(-1e4) == 0.0
    assert sigmoid(1e4) == 1.0
    assert sigmoid(0.0) == 0.5


@given(ANY, ANY)
def test_minimum_and_maximum_are_those_of_python(a, b):
    assert minimum(a, b) == min(a, b)
    assert maximum(a, b) == max(a, b)
    assert absolute(a) == abs(a)


@given(FINITE, FINITE, FINITE)
def test_a_clipped_number_lies_between_its_bounds_and_a_number_within_is_untouched(x, a, b):
    low, high = min(a, b), max(a, b)
    clipped = clip(x, low, high)
    assert low <= clipped <= high
    assert clipped == (x if low <= x <= high else low if x < low else high)


def test_where_chooses_entry_by_entry_whatever_is_an_array():
    x = np.array([-1.0, 2.0])
    assert where(True, 1.0, 2.0) == 1.0
    assert where(False, 1.0, 2.0) == 2.0
    assert where(x > 0.0, 1.0, 2.0).tolist() == [2.0, 1.0]
    assert where(x > 0.0, x, -x).tolist() == [1.0, 2.0]
    assert where(True, x, 0.0).tolist() == [-1.0, 2.0]
    assert where(False, x, 0.0).tolist() == [0.0, 0.0]
    assert where(np.float64(1.0) > 0.0, 1.0, 2.0) == 1.0


@pytest.mark.filterwarnings("ignore:Bitwise inversion")
def test_a_negated_comparison_chooses_alike_whatever_kind_of_number_is_compared():
    def law(x, y):
        few, many = x < 1.0, y < 1.0
        conditions = ~few, ~few & many, ~few | many, ~(few & many), ~few & ~many
        return tuple(where(one, 3.0, 4.0) for one in conditions)

    for x, y in itertools.product((0.0, 2.0), repeat=2):
        holds = x >= 1.0, x >= 1.0 and y < 1.0, x >= 1.0 or y < 1.0, x >= 1.0 or y >= 1.0, x >= 1.0 and y >= 1.0
        wanted = tuple(3.0 if one else 4.0 for one in holds)
        assert law(x, y) == wanted
        assert tuple(float(one[0]) for one in law(np.array([x]), np.array([y]))) == wanted


def test_array_helpers_act_entry_by_entry():
    x, y = np.array([-2.0, 0.5, 3.0]), np.array([1.0, -1.0, 2.0])
    assert minimum(x, y).tolist() == [-2.0, -1.0, 2.0]
    assert maximum(x, y).tolist() == [1.0, 0.5, 3.0]
    assert clip(x, -1.0, 1.0).tolist() == [-1.0, 0.5, 1.0]
    assert absolute(x).tolist() == [2.0, 0.5, 3.0]
    assert atan2(x, 2.0).tolist() == [atan2(one, 2.0) for one in x]
    assert atan2(2.0, x).tolist() == [atan2(2.0, one) for one in x]
    np.testing.assert_allclose(sigmoid(x), 1 / (1 + np.exp(-x)), rtol=1e-15)

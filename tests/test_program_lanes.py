"""The functions of a number on lanes: compiled for this machine, in f64 and f32, against 80-bit references."""

import math
import operator

import numpy as np
import pytest
from llvmlite import ir

from quadstep.numbers import (
    Table,
    absolute,
    atan2,
    clip,
    cos,
    exp,
    flatten,
    log,
    maximum,
    minimum,
    sigmoid,
    sin,
    solve_symmetric,
    sqrt,
    vector,
    where,
)
from quadstep.numbers.vectors import matrix
from quadstep.program.emitter import Emitter
from quadstep.program.recorded import RecordedNumber
from tests.flights import through_lanes

WIDTHS = pytest.mark.parametrize("double", [True, False], ids=["f64", "f32"])
RNG = np.random.default_rng(7)
LONG = np.longdouble


def kind(double):
    return np.float64 if double else np.float32


def long(x, double):
    """Columns as the lanes see them, with room to spare."""
    return np.asarray(x).astype(kind(double)).astype(LONG)


def units_off(got, wanted, double):
    """Largest error in units of the last place of what is wanted."""
    unit = np.spacing(np.abs(wanted).astype(kind(double))).astype(LONG)
    return float(np.max(np.abs(got.astype(LONG) - wanted) / unit))


@WIDTHS
def test_exponential_is_infinite_above_and_zero_below_its_range_and_keeps_nan(double):
    low, high = (-708.5, 709.25) if double else (-87.5, 88.25)
    got = through_lanes(exp, [high + 0.25, 1e30, math.inf, low - 0.25, -1e30, -math.inf, math.nan], double=double)
    assert got.tolist()[:6] == [math.inf] * 3 + [0.0] * 3
    assert np.isnan(got[6])
    ends = through_lanes(exp, [high, low], double=double)
    np.testing.assert_allclose(ends, np.exp(LONG([high, low])).astype(kind(double)), rtol=1e-15 if double else 1e-6)


@WIDTHS
def test_logarithm_of_what_is_not_positive_and_finite_is_that_of_ieee_754(double):
    x = [0.0, -0.0, math.inf, -1.0, -math.inf, math.nan, 1.0]
    got = through_lanes(log, x, double=double)
    np.testing.assert_array_equal(got, [-math.inf, -math.inf, math.inf, math.nan, math.nan, math.nan, 0.0])


@WIDTHS
def test_logarithm_stays_within_one_of_the_smallest_normal_numbers_below_it(double):
    tiny = np.finfo(kind(double)).tiny
    got = through_lanes(log, [tiny * share for share in (1e-6, 0.01, 0.5, 0.99)], double=double)
    assert np.all((got < math.log(tiny)) & (got > math.log(tiny) - 1.0))


@WIDTHS
def test_angle_of_a_point_on_the_axes_and_at_the_origin(double):
    y, x = [0, 0, 0, 3, -3, 2, 2, -2, -2], [0, 1, -1, 0, 0, 2, -2, 2, -2]
    pi = math.pi
    wanted = [0, 0, pi, pi / 2, -pi / 2, pi / 4, 3 * pi / 4, -pi / 4, -3 * pi / 4]
    np.testing.assert_allclose(through_lanes(atan2, y, x, double=double), wanted, rtol=3e-16 if double else 2e-7)


@WIDTHS
def test_angle_of_a_point_that_is_no_number_is_none(double):
    y, x = [1.0, math.nan, math.nan, 0.0, math.nan], [math.nan, 1.0, 0.0, math.nan, math.nan]
    assert np.isnan(through_lanes(atan2, y, x, double=double)).all()


@WIDTHS
def test_angle_of_a_point_with_one_coordinate_a_constant(double):
    got = through_lanes(lambda x: [atan2(1.0, x), atan2(x, -2.0)], [1.0, -1.0], double=double)
    np.testing.assert_allclose(got[0], np.arctan2(1.0, [1.0, -1.0]), rtol=1e-6)
    np.testing.assert_allclose(got[1], np.arctan2([1.0, -1.0], -2.0), rtol=1e-6)


@WIDTHS
def test_square_root_is_exact_to_rounding_and_nan_below_zero(double):
    x = RNG.uniform(0, 1e6, 2000)
    assert units_off(through_lanes(sqrt, x, double=double), np.sqrt(long(x, double)), double) <= 0.51
    got = through_lanes(sqrt, [0.0, -1.0, math.nan, math.inf], double=double)
    assert got[0] == 0.0
    assert np.isnan(got[1:3]).all()
    assert got[3] == math.inf


@WIDTHS
def test_choices_are_those_of_arrays(double):
    a, b = RNG.normal(size=(2, 501)).astype(kind(double))

    def law(x, y):
        return [
            where(x < y, x, 2.0),
            minimum(x, y),
            maximum(x, y),
            absolute(x),
            clip(x, -0.5, 0.25),
            where((x > 0.0) & (y > 0.0), 1.0, 0.0) + where((x > 0.0) | (y > 0.0), 10.0, 0.0) + where(~(x <= 0.0), 100.0, 0.0),
        ]

    for got, wanted in zip(through_lanes(law, a, b, double=double), law(a, b), strict=True):
        np.testing.assert_array_equal(got, wanted)


def test_every_comparison_with_nan_is_false_but_unequal():
    def law(x):
        conditions = x < 1.0, x <= 1.0, x > 1.0, x >= 1.0, x == 1.0, x != 1.0
        return [where(condition, 1.0, 0.0) for condition in conditions]

    got = through_lanes(law, [math.nan, 0.0, 1.0, 2.0])
    assert got.T.tolist() == [[0, 0, 0, 0, 0, 1], [1, 1, 0, 0, 0, 1], [0, 1, 0, 1, 1, 0], [0, 0, 1, 1, 0, 1]]


@WIDTHS
def test_table_lookup_gives_each_lane_its_own_entry(double):
    table = Table(RNG.normal(size=37))
    index = RNG.integers(0, 37, 203).astype(float)
    got = through_lanes(lambda i, entries: entries.at(i), index, double=double, table=table)
    np.testing.assert_array_equal(got, table.at(index).astype(kind(double)))
    fixed = through_lanes(lambda i, entries: entries.at(5) + 0.0 * i, index, double=double, table=table)
    assert set(fixed.tolist()) == {float(kind(double)(table.values[5]))}


@WIDTHS
def test_arithmetic_with_lanes_and_constants_on_either_side(double):
    def law(x, y):
        return [
            x + y,
            x - y,
            x * y,
            x / y,
            2.0 + x,
            2.0 - x,
            3.0 * x,
            2.0 / x,
            x + 0.0,
            x * 1.0,
            x * -1.0,
            0.0 - x,
            x / 1.0,
            -x,
        ]

    a, b = RNG.uniform(0.5, 2, (2, 64)).astype(kind(double))
    for got, wanted in zip(through_lanes(law, a, b, double=double), law(a, b), strict=True):
        np.testing.assert_array_equal(got, wanted)


def test_laws_over_vectors_and_matrices_agree_with_floats():
    def law(*entries):
        a, b, c, d, e, f = entries
        m = matrix((4.0 + a * a, b, c), (b, 5.0 + d * d, e), (c, e, 6.0 + f * f))
        return [*solve_symmetric(m, vector(a, b, c)), (m @ m.T).norm(), vector(a, b, c).norm(), sigmoid(a), *flatten(m @ m)]

    columns = RNG.normal(size=(6, 50))
    got = through_lanes(law, *columns)
    wanted = np.array([law(*row) for row in columns.T.tolist()]).T
    np.testing.assert_array_equal(got, wanted)


def probe():
    module = ir.Module("probe")
    element = ir.DoubleType()
    function = ir.Function(module, ir.FunctionType(ir.VoidType(), [ir.VectorType(element, 4)]), "probe")
    emitter = Emitter(ir.IRBuilder(function.append_basic_block("entry")), element, 4)
    return RecordedNumber(emitter, function.args[0])


def test_a_lane_and_its_comparison_refuse_to_decide_a_branch():
    x = probe()
    for condition in (x, x < 1.0, x == 1.0):
        with pytest.raises(TypeError, match="where"):
            bool(condition)
    with pytest.raises(TypeError, match="where"):
        _ = x > 0.0 and x < 1.0
    with pytest.raises(TypeError, match="where"):
        _ = x > 0.0 or x < 1.0
    with pytest.raises(TypeError):
        min(x, x * 2.0)


def test_constants_fold_and_repeated_work_is_emitted_once():
    x = probe()
    assert x * 0.0 == 0.0
    assert 0.0 * x == 0.0
    assert x * 1.0 is x
    assert x + 0.0 is x
    assert x / 1.0 is x
    assert (x * x).place is (x * x).place
    assert sin(x).place is not cos(x).place
    assert (x - 2.0).place is not (2.0 - x).place


@pytest.mark.parametrize("operation", [operator.add, operator.mul, operator.sub])
def test_a_lane_does_not_mix_with_what_is_not_a_number(operation):
    with pytest.raises(TypeError):
        operation(probe(), "text")

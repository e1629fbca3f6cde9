"""How far the functions of numbers are from the true ones: at most what docs/decisions/0012-equal-bits.md states."""

import math
import re
from pathlib import Path

import mpmath
import numpy as np
import pytest

from quadstep.numbers import atan2, cos, exp, log, sigmoid, sin
from quadstep.numbers.elementary import MOST_ANGLE
from tests.flights import through_lanes

RANDOM = np.random.default_rng(12)
QUARTERS = np.arange(-600, 600) * math.pi / 2
ANGLES = np.concatenate([RANDOM.uniform(-30, 30, 6000), RANDOM.uniform(-1.6e6, 1.6e6, 2000), QUARTERS])
POWERS = RANDOM.uniform(-708, 709, 8000)
ENDS = [0.5, 1.0, 2.0, math.sqrt(0.5), math.sqrt(2.0), np.finfo(float).tiny, np.finfo(float).max]
NEXT = [np.nextafter(one, other) for one in ENDS[:5] for other in (0.0, 9.0)]
POSITIVE = np.concatenate([np.exp(RANDOM.uniform(-700, 700, 4000)), RANDOM.uniform(0.5, 2.0, 4000), ENDS, NEXT])
PLANE = np.ldexp(RANDOM.normal(size=(2, 8000)), RANDOM.integers(-10, 10, (2, 8000)))
CASES = {
    "sin": (sin, mpmath.sin, (ANGLES,)),
    "cos": (cos, mpmath.cos, (ANGLES,)),
    "exp": (exp, mpmath.exp, (POWERS,)),
    "sigmoid": (sigmoid, lambda x: 1 / (1 + mpmath.exp(-x)), (np.concatenate([RANDOM.uniform(-6, 6, 6000), POWERS]),)),
    "log": (log, mpmath.log, (POSITIVE,)),
    "atan2": (atan2, mpmath.atan2, tuple(PLANE)),
}
SINGLE = {"sin": 12000.0, "cos": 12000.0, "exp": 87.0, "sigmoid": 87.0}
"""The arguments in f32 are held to this."""

LEAST = {"sin": (1e-12, 1e-3), "cos": (1e-12, 1e-3), "sigmoid": (0.5, 0.5)}
"""Of f64 and of f32: a smaller value has its error measured in units of this one. Near its zeros a sine keeps that of the
reduction of a large angle; a sigmoid goes beside 1.
"""

PAGE = Path(__file__).parents[1] / "docs" / "decisions" / "0012-equal-bits.md"
STATED = re.findall(r"\| (\w+) \| ([\d.]+) \| ([\d.]+) \|", PAGE.read_text(encoding="utf-8"))


def units_off(got, true, bits, least=0.0):
    """The largest distance from the true value in units of its last place; of a value below `least`, in those of `least`."""
    worst = 0.0
    for one, exact in zip(got, true, strict=True):
        unit = mpmath.mpf(2) ** (math.frexp(max(abs(float(exact)), least))[1] - 1 - bits)
        worst = max(worst, float(abs(mpmath.mpf(float(one)) - exact) / unit))
    return worst


def measured(name):
    """Of f64 and of f32."""
    law, reference, columns = CASES[name]
    single = [np.clip(column, -SINGLE.get(name, 1e30), SINGLE.get(name, 1e30)).astype(np.float32) for column in columns]
    if name == "log":
        single = [np.clip(columns[0], 1e-37, 1e37).astype(np.float32)]
    with mpmath.workprec(160):
        true = [reference(*map(mpmath.mpf, row)) for row in np.array(columns).T.tolist()]
        true_32 = [reference(*map(mpmath.mpf, row)) for row in np.array(single, dtype=float).T.tolist()]
        least, least_32 = LEAST.get(name, (0.0, 0.0))
        double = units_off(law(*columns), true, 52, least)
        return double, units_off(through_lanes(law, *single, double=False), true_32, 23, least_32)


@pytest.mark.parametrize(("name", "double", "single"), STATED)
def test_errors_are_at_most_the_stated_ones(name, double, single):
    found = measured(name)
    assert found[0] <= float(double)
    assert found[1] <= float(single)


@pytest.mark.parametrize("count", [1, 2, 3, 4, 7])
@pytest.mark.parametrize("kind", [np.float32, np.int64])
def test_arrays_of_other_numbers_count_as_f64(count, kind):
    x = np.linspace(1.0, 7.0, count).astype(kind)
    for law, _, columns in CASES.values():
        np.testing.assert_array_equal(law(*(x,) * len(columns)), law(*(x.astype(float),) * len(columns)), strict=True)
    assert cos(np.float32(0.5)) == cos(float(np.float32(0.5)))


def test_every_function_is_stated():
    assert sorted(name for name, *_ in STATED) == sorted(CASES)


def test_an_angle_beyond_the_reduction_has_no_sine():
    for double in (True, False):
        most = MOST_ANGLE[double]
        inside, outside = through_lanes(sin, [0.999 * most, 1.001 * most], double=double)
        assert abs(inside - math.sin(np.float32(0.999 * most) if not double else 0.999 * most)) < 1e-3
        assert math.isnan(outside)
    assert math.isnan(sin(2e6))
    assert math.isnan(cos(np.array([-2e6]))[0])

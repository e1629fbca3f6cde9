"""Python's own functions applied to a recorded number, which has no value yet."""

import math

import numpy as np
import pytest
from llvmlite import ir

import quadstep.numbers  # noqa: F401 (gives both kinds their functions)
from quadstep.program.assignments import Record
from quadstep.program.emitter import Emitter
from quadstep.program.recorded import RecordedNumber
from tests.flights import through_lanes


def a_lane():
    module = ir.Module()
    function = ir.Function(module, ir.FunctionType(ir.VoidType(), [ir.VectorType(ir.DoubleType(), 2)]), "f")
    emitter = Emitter(ir.IRBuilder(function.append_basic_block()), ir.DoubleType(), 2)
    return RecordedNumber(emitter, function.args[0])


@pytest.fixture(params=["lane", "script"])
def number(request):
    return a_lane() if request.param == "lane" else Record().input("x")


@pytest.mark.parametrize("function", [float, int, round, math.sin, math.sqrt, math.floor, np.sin, np.exp])
def test_a_function_of_python_is_refused_with_what_to_use_instead(number, function):
    with pytest.raises(TypeError, match=r"take sin, cos, .* from quadstep\.numbers"):
        function(number)


@pytest.mark.parametrize("function", [lambda x: max(x, 1.0), lambda x: min(1.0, x), lambda x: 1.0 if x > 0.0 else 0.0])
def test_max_and_min_say_what_to_use_instead(number, function):
    with pytest.raises(TypeError, match="maximum"):
        function(number)


@pytest.mark.parametrize("function", [lambda x: x % 2.0, lambda x: 7.0 % x, lambda x: x // 2.0, lambda x: divmod(x, 2.0)])
def test_remainders_are_refused(number, function):
    with pytest.raises(TypeError, match="a law cannot use remainders"):
        function(number)


@pytest.mark.parametrize("power", [2, 3, 0.5, -1, "x"])
def test_powers_are_refused(number, power):
    with pytest.raises(TypeError, match=r"cannot use powers: .* sqrt\(x\)"):
        number**power


def test_on_lanes_they_are_what_they_are_on_floats():
    x = np.array([-2.5, 0.0, 1.5, 1e100, -1e-3])
    got = through_lanes(lambda x: [abs(x), +x], x)
    np.testing.assert_array_equal(got, [np.abs(x), x])

"""A Python function inside a law: on floats, on arrays, and called from compiled code that is kept between runs."""

import ctypes
import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import sympy
from llvmlite import ir

from quadstep.engines.kernel import compile_module
from quadstep.numbers import Vector
from quadstep.numbers.scan import call, raise_pending, register, release
from quadstep.program.emitter import Emitter
from quadstep.program.recorded import RecordedNumber
from tests.flights import through_lanes

LANES = pytest.mark.parametrize(("double", "width"), [(True, 1), (True, 4), (False, 1), (False, 8)])


def mixed(inputs):
    return [inputs[0] - 2 * inputs[1], inputs.sum()]


@pytest.fixture
def registered():
    """Registers functions for the length of a test."""
    handles = []

    def enter(function):
        handles.append(register(function))
        return handles[-1]

    yield enter
    for handle in handles:
        release(handle)


def test_on_floats_the_function_gets_a_float64_array_and_floats_come_back(registered):
    seen = []
    handle = registered(lambda inputs: (seen.append(inputs), mixed(inputs))[1])
    assert call(float(handle), [1.0, 2.0, 3], 2) == [-3.0, 6.0]
    assert seen[0].dtype == np.float64
    assert seen[0].tolist() == [1.0, 2.0, 3.0]


def test_on_arrays_it_is_called_for_each_element_in_order(registered):
    order = []
    handle = registered(lambda inputs: (order.append(inputs[0]), mixed(inputs))[1])
    a, b = np.arange(6.0), np.array([2.0])
    first, second = call(handle, [a, b, 1.0], 2)
    assert first.tolist() == (a - 4.0).tolist()
    assert second.tolist() == (a + 3.0).tolist()
    assert order == a.tolist()


def test_array_elements_may_have_functions_of_their_own(registered):
    handles = np.array([registered(lambda inputs, factor=factor: inputs * factor) for factor in (2.0, 3.0)])
    assert call(handles, [10.0], 1)[0].tolist() == [20.0, 30.0]


@LANES
def test_on_lanes_each_lane_is_a_call_of_its_own_function(registered, double, width):
    def scaled(factor):
        def function(inputs):
            assert inputs.dtype == np.float64
            assert inputs.flags.c_contiguous
            return [factor * inputs[0], inputs[1] - factor]

        return function

    handles = [registered(scaled(factor)) for factor in (2.0, 3.0, 5.0)]
    which = np.arange(16) % 3
    x, y = np.arange(16.0), 100.0 + np.arange(16.0)
    got = through_lanes(lambda h, a, b: call(h, [a, b], 2), np.array(handles)[which], x, y, double=double, width=width)
    factor = np.array([2.0, 3.0, 5.0])[which]
    assert got.tolist() == [(factor * x).tolist(), (y - factor).tolist()]


@LANES
def test_lanes_and_constants_may_be_mixed_and_the_handle_may_be_a_constant(registered, double, width):
    handle = registered(lambda inputs: inputs @ [1.0, 10.0, 100.0] + [0.0, 0.25])
    got = through_lanes(lambda x: call(handle, [2.0, x, 3], 2), np.arange(8.0), double=double, width=width)
    assert got.tolist() == [(302.0 + 10.0 * np.arange(8.0)).tolist(), (302.25 + 10.0 * np.arange(8.0)).tolist()]


def test_every_call_is_made_and_in_order_even_with_the_same_inputs_and_an_unused_answer(registered):
    calls = []
    handle = registered(lambda inputs: (calls.append(inputs[0]), [len(calls)])[1])

    def law(which, x):
        (first,) = call(which, [x], 1)
        (second,) = call(which, [x], 1)
        call(which, [7.0], 1)
        return second - first

    assert through_lanes(law, [handle], [5.0], width=1).tolist() == [1.0]
    assert calls == [5.0, 5.0, 7.0]


def test_a_function_may_keep_and_change_its_inputs_and_give_the_same_array_again(registered):
    kept, memory = [], np.zeros(1)

    def function(inputs):
        kept.append(inputs)
        memory[0] = inputs[0]
        inputs += 1.0
        return memory

    handle = registered(function)
    first, second = through_lanes(lambda x: [*call(handle, [x], 1), *call(handle, [2.0 * x], 1)], [3.0, 4.0], width=1)
    assert first.tolist() == [3.0, 4.0]
    assert second.tolist() == [6.0, 8.0]
    assert [inputs[0] for inputs in kept] == [4.0, 7.0, 5.0, 9.0]


@pytest.mark.parametrize("given", [(1, 2), [1.0, np.float32(2)], np.array([1, 2]), Vector([1.0, 2.0])], ids=repr)
def test_any_sequence_of_numbers_is_an_answer(registered, given):
    answer = call(registered(lambda _: given), [0.0], 2)
    assert answer == [1.0, 2.0]
    assert all(type(number) is float for number in answer)


def test_what_f32_cannot_hold_becomes_infinite(registered):
    handle = registered(lambda inputs: [1e300, -1e300])
    got = through_lanes(lambda x: call(handle, [x], 2), [0.0], double=False, width=1)
    assert got.ravel().tolist() == [math.inf, -math.inf]


def engines(handle, outputs):
    """The law on each kind of number, at two inputs."""
    yield lambda: [call(handle, [x], outputs) for x in (1.0, 2.0)]
    yield lambda: call(handle, [np.array([1.0, 2.0])], outputs)
    yield lambda: through_lanes(lambda x: call(handle, [x], outputs), [1.0, 2.0], width=1)
    yield lambda: through_lanes(lambda x: call(handle, [x], outputs), [1.0, 2.0], double=False, width=4)


ERRORS = [ValueError("no"), ZeroDivisionError(), KeyboardInterrupt(), SystemExit(3), GeneratorExit()]
WRONG = [[1.0], [1.0, 2.0, 3.0], 1.0, None, "12", ["1", "2"], [[1.0], [2.0]], [1.0, [2.0]], [1.0, None], [1j, 2.0], {1.0, 2.0}]


@pytest.mark.parametrize("error", ERRORS, ids=repr)
def test_what_a_function_raises_is_kept_and_its_outputs_are_nan(registered, error):
    calls = []

    def function(inputs):
        calls.append(inputs)
        raise error

    handle = registered(function)
    for count, run in enumerate(engines(handle, 2), 1):
        assert np.isnan(run()).all()
        assert len(calls) == count, "a function that has raised is not called again"
        with pytest.raises(type(error)) as raised:
            raise_pending(handle)
        assert raised.value is error
        assert "function" in [entry.name for entry in raised.traceback]
        raise_pending(handle)  # nothing any more


@pytest.mark.parametrize("given", WRONG, ids=repr)
def test_an_answer_that_is_not_the_numbers_wanted_is_an_error(registered, given):
    handle = registered(lambda _: given)
    for run in engines(handle, 2):
        assert np.isnan(run()).all()
        with pytest.raises((TypeError, ValueError), match=r"2 numbers|inhomogeneous"):
            raise_pending(handle)


def test_one_function_that_raises_leaves_the_others_alone(registered):
    good, bad = registered(lambda inputs: inputs), registered(lambda inputs: 1 / 0)
    got = through_lanes(lambda handle, x: call(handle, [x], 1), [good, bad, good, bad], [1.0, 2.0, 3.0, 4.0])
    np.testing.assert_array_equal(got, [1.0, math.nan, 3.0, math.nan])
    raise_pending(good)
    with pytest.raises(ZeroDivisionError):
        raise_pending(bad)


def test_a_released_handle_answers_nan_and_can_be_given_out_again():
    handle = register(mixed)
    release(handle)
    assert np.isnan(call(handle, [1.0, 2.0], 2)).all()
    with pytest.raises(LookupError, match=f"handle {handle}"):
        raise_pending(handle)
    call(handle, [1.0, 2.0], 2)
    again = register(mixed)
    assert again == handle
    assert call(handle, [1.0, 2.0], 2) == [-3.0, 3.0]
    raise_pending(handle)
    release(handle)


def test_handles_differ_while_they_are_in_use(registered):
    handles = [registered(mixed) for _ in range(100)]
    assert len(set(handles)) == 100
    assert all(0 <= handle < 2**24 for handle in handles)


def test_a_handle_given_out_again_is_nobody_elses(registered):
    first, second = register(lambda _: [1.0]), registered(lambda _: [2.0])
    release(first)
    third = registered(lambda _: [3.0])
    assert [call(handle, [0.0], 1) for handle in (second, third)] == [[2.0], [3.0]]


def test_symbols_are_refused(registered):
    with pytest.raises(TypeError, match="no equations"):
        call(registered(mixed), [sympy.Symbol("x")], 2)


# Kept between runs

IN_ANOTHER_PROCESS = """
from quadstep.numbers.scan import register
from quadstep.io import code_cache
from tests.test_numbers_opaque import loop, run
kept = []
code_cache.write = lambda *_: kept.append(1)
for _ in range(3):
    register(lambda inputs: inputs)
handle = register(lambda inputs: [inputs[0] + 10.0])
print(run(loop(), handle), len(kept))
"""


def loop():
    """A module whose `fly` calls a function `count` times over, each time on its last answer; as text."""
    module = ir.Module("flight")
    number, count = ir.DoubleType(), ir.IntType(64)
    kind = ir.FunctionType(ir.VoidType(), [number.as_pointer(), count])
    function = ir.Function(module, kind, "fly")
    builder = ir.IRBuilder(function.append_basic_block("entry"))
    emitter = Emitter(builder, number, 1)
    memory = builder.bitcast(function.args[0], emitter.vector.as_pointer())
    handle = RecordedNumber(emitter, builder.load(memory))
    entry, body, done = builder.block, function.append_basic_block("body"), function.append_basic_block("done")
    builder.branch(body)
    emitter.enter(body)
    place, x = builder.phi(count), builder.phi(emitter.vector)
    (after,) = call(handle, [RecordedNumber(emitter, x)], 1)
    following = builder.add(place, count(1))
    for phi, start, step in ((place, count(0), following), (x, emitter.constant(0.0), emitter.value(after))):
        phi.add_incoming(start, entry)
        phi.add_incoming(step, body)
    builder.cbranch(builder.icmp_unsigned("<", following, function.args[1]), body, done)
    emitter.enter(done)
    builder.store(emitter.value(after), memory)
    builder.ret_void()
    return str(module)


def run(text, handle, count=3):
    """What the loop ends with."""
    kernel = compile_module(lambda: text, True)
    fly = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_int64)(kernel.engine.get_function_address("fly"))
    memory = np.array([float(handle)])
    fly(memory.ctypes.data, count)
    return float(memory[0])


def test_compiled_code_is_kept_between_runs_and_serves_every_function(registered, monkeypatch, tmp_path):
    monkeypatch.setenv("QUADSTEP_CACHE", str(tmp_path))
    one, two = registered(lambda inputs: inputs + 1.0), registered(lambda inputs: [2.0])
    text = loop()
    assert run(text, one) == 3.0
    assert len([*tmp_path.iterdir()]) == 1
    assert run(text, two) == 2.0
    assert loop() == text, "no address is in the text"
    command, home = [sys.executable, "-c", IN_ANOTHER_PROCESS], Path(__file__).parents[1]
    other = subprocess.run(command, cwd=home, check=True, capture_output=True, text=True)
    assert other.stdout.split() == ["30.0", "0"], "another process finds the code and its own functions"
    assert len([*tmp_path.iterdir()]) == 1


def test_a_call_in_a_loop_takes_its_stack_once():
    text = loop()
    assert 0 < text.rindex("alloca") < text.index("body:")

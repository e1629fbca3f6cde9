"""The laws as a program for graphics processors: written, assembled, counted; run where there is one."""

import re
from pathlib import Path

import numpy as np
import pytest
from llvmlite import binding as llvm

from benchmarks.gpu_assembler import assembled
from benchmarks.gpu_count import KINDS, Chip, bound, counted, marked, operations
from quadstep.control.backstepping import Backstepping
from quadstep.control.opaque import flying
from quadstep.engines import kernel
from quadstep.engines.cuda import NoDeviceError
from quadstep.engines.gpu_sweep import REGISTERS, GpuSweep, program, ptx
from quadstep.engines.loop import Loop
from quadstep.engines.scored import scored
from quadstep.engines.sweep import Sweep
from quadstep.io.errors import UserError
from quadstep.mission.read import read_mission
from quadstep.numbers import flatten
from quadstep.numbers.noise import flight_key, key, normals, uniforms
from quadstep.vehicle.lagrange import Lagrange
from quadstep.world.pieces import Piecewise
from tests.flights import parameters, state
from tests.needs import GRAPHICS, NO_GRAPHICS, PTXAS, needs
from tests.sweeps import CLOCK, LOOP, NUMBERS, PLACES, TILTED, WAYPOINTS, table, values

WAYPOINT_LOOP = Loop(Lagrange(), Piecewise(), Backstepping())
BOTH = pytest.mark.parametrize("double", [True, False], ids=["f64", "f32"])


@pytest.fixture(scope="module")
def text():
    return ptx(LOOP, TILTED, NUMBERS, frozenset(PLACES))


def test_the_program_calls_nothing_and_keeps_everything_in_registers(text):
    body = text[text.index(".entry sweep") :]
    assert not re.search(r"\bcall\b", body)
    assert ".extern" not in text
    assert ".local" not in body
    assert ".target sm_90" in text
    assert text.count(".entry") == 1


def test_what_all_flights_read_is_in_constant_memory(text):
    assert re.search(r"\.const .*constants\[", text)
    assert len(re.findall("ld.global", text)) < 20 < len(re.findall(r"ld\.const", text))


@BOTH
def test_every_operation_is_rounded_as_ieee_754_has_it_and_nothing_is_fused_or_flushed(double):
    kind, other = ("f64", "f32") if double else ("f32", "f64")
    text = ptx(LOOP, TILTED, NUMBERS, frozenset(PLACES), double=double)
    operations = set(re.findall(rf"\b((?:add|sub|mul|div|rcp|sqrt|fma|mad)[\w.]*\.{kind})", text))
    assert operations <= {f"{name}.rn.{kind}" for name in ("add", "sub", "mul", "div", "rcp", "sqrt")}
    assert {f"{name}.rn.{kind}" for name in ("add", "mul", "rcp", "sqrt")} <= operations
    assert not re.search(rf"ftz|approx|\.{other}", text)


@pytest.mark.parametrize(("architecture", "target"), [(70, "sm_70"), (80, "sm_80"), (90, "sm_90"), (120, "sm_90")])
def test_the_program_is_for_this_processor_or_one_before_it(architecture, target):
    assert f".target {target}" in ptx(LOOP, TILTED, NUMBERS, frozenset(PLACES), architecture=architecture)


def test_processors_too_old_are_refused():
    with pytest.raises(NoDeviceError, match=r"7\.0 or later"):
        ptx(LOOP, TILTED, NUMBERS, frozenset(PLACES), architecture=61)


def test_a_controller_that_calls_python_is_refused():
    plan = read_mission(Path("examples/a_bad_day.toml")).plan(Path("examples"))
    with flying(lambda t, measured, reference: (9.0, (0.0, 0.0, 0.0))) as (law, gains):
        flown = plan.with_controller(law, gains)
        with pytest.raises(UserError, match="calls Python"):
            ptx(scored(flown.loop, plan.ticks, 0.02)[0], plan.start, flown.parameters, frozenset())


def test_what_is_written_does_not_depend_on_how_this_machine_s_code_is_written(text, monkeypatch):
    kernel.host.cache_clear()
    kernel.host()
    assert ptx(LOOP, TILTED, NUMBERS, frozenset(PLACES)) == text
    llvm.set_option("", "-pre-RA-sched=list-ilp")
    assert ptx(LOOP, TILTED, NUMBERS, frozenset(PLACES)) == text
    told = []
    monkeypatch.setattr(kernel.llvm, "set_option", lambda name, option: told.append(option))
    kernel.host()
    assert told  # and that has its own options back


def draw(high, low):
    """A law that gives the varying numbers of a flight: one of each kind."""
    one = flight_key(key(7, 0).words, high, low)
    return [*uniforms(one, 0, 0.0, 2), *normals(one, 1, 0.0, 2)]


def test_numbers_drawn_on_the_processor_are_read_from_nowhere(text):
    given, text = text, ptx(LOOP, TILTED, NUMBERS, frozenset(PLACES), generate=draw)
    head = text[text.index(".entry sweep") : text.index("{")]
    assert len(re.findall(r"\.param", head)) == 7  # first, count, last, step, every, tables, results
    rows = 2 + len(flatten(LOOP.start(TILTED, NUMBERS).score)) + len(PLACES)
    assert len(re.findall(r"st\.global", text)) == rows
    assert len(re.findall(r"ld\.global", text)) == len(re.findall(r"ld\.global", given)) - len(PLACES)
    assert not re.search(r"\.f64", text[text.index("st.global") :].split("\n", 2 * rows)[-1])  # drawn in f64, flown in f32


def test_the_law_must_give_as_many_numbers_as_vary():
    with pytest.raises(ValueError, match="4 numbers generated for 1"):
        ptx(LOOP, TILTED, NUMBERS, frozenset(PLACES[:1]), generate=draw)


@needs(PTXAS)
@pytest.mark.parametrize("generate", [None, draw], ids=["given", "drawn"])
@pytest.mark.parametrize("architecture", [80, 90])
def test_the_paper_s_loop_takes_few_registers_and_spills_little(architecture, generate, record_property):
    text = ptx(LOOP, TILTED, NUMBERS, frozenset(PLACES), architecture=architecture, generate=generate)
    told = assembled(text, architecture, REGISTERS)
    record_property("ptxas", str(told))
    assert 100 < told.registers <= REGISTERS
    assert told.stack <= 128
    roomy = assembled(text, architecture, 208)
    assert (roomy.stack, roomy.stores, roomy.loads) == (0, 0, 0)


@needs(PTXAS)
def test_fewer_registers_are_told_as_spills(text):
    told = assembled(text, 90, 64)
    assert told.registers <= 64
    assert min(told.stack, told.stores, told.loads) > 0


@needs(PTXAS)
def test_what_the_assembler_refuses_is_told(text):
    with pytest.raises(RuntimeError, match="ptxas"):
        assembled(text.replace("mul.rn.f32", "mul.rm.f16", 1), 90)


@needs(PTXAS)
def test_other_loops_assemble(record_property):
    plan = read_mission(Path("examples/a_bad_day.toml")).plan(Path("examples"))
    numbers = parameters(path=WAYPOINTS)
    others = {
        "a_bad_day": (scored(plan.loop, plan.ticks, 0.02)[0], plan.start, plan.parameters, frozenset([0]), False),
        "waypoints_f64": (scored(WAYPOINT_LOOP, CLOCK._replace(every=(1,)), 0.02)[0], state(), numbers, frozenset([0]), True),
    }
    for name, (loop, start, given, varying, double) in others.items():
        told = assembled(ptx(loop, start, given, varying, double), 90)
        record_property(name, str(told))
        assert 100 < told.registers <= 255


# Counting


def test_a_step_s_instructions_are_those_of_every_task_as_often_as_it_runs():
    one = program(LOOP, TILTED, NUMBERS, frozenset(PLACES))
    often = counted(one, LOOP, CLOCK._replace(every=(1, 1)))
    seldom = counted(one, LOOP, CLOCK._replace(every=(1, 10**9)))
    half = counted(one, LOOP, CLOCK._replace(every=(1, 2)))
    never = counted(one, LOOP, CLOCK._replace(every=(10**9, 10**9)))
    for kind in often:
        assert half[kind] == pytest.approx((often[kind] + seldom[kind]) / 2)
    assert seldom["special"] - never["special"] >= 20  # twenty sigmoids
    assert 0 < often["special"] - seldom["special"] < 4  # two norms
    assert sum(never.values()) > 400  # four evaluations of the plant


def test_the_program_with_marks_is_the_same_program():
    one = program(LOOP, TILTED, NUMBERS, frozenset(PLACES))
    marks = re.findall(r"// at ([^\"]+)", marked(one))
    assert {"entry", "head", "law", "score", "moving", "done"} <= set(marks)
    assert re.sub(r".*asm sideeffect.*\n", "", marked(one)) == one


def test_what_bounds_it():
    counts = dict.fromkeys(KINDS, 0.0)
    chip = Chip("made up", 2, 1e9)
    assert bound({**counts, "multiply-add": 1000.0, "special": 24.0, "free": 999.0}, False, chip) == ("issue", 2.5e8)
    assert bound({**counts, "special": 64.0}, False, chip) == ("special functions", 5e8)
    assert bound({**counts, "add": 600.0, "special": 5.0}, True, chip) == ("f64", 2e8)
    assert operations({**counts, "multiply-add": 10.0, "add": 3.0, "multiply": 2.0, "choose": 9.0}) == 25.0


# On a device


@needs(NO_GRAPHICS)
def test_without_a_graphics_processor_it_says_so():
    with pytest.raises(NoDeviceError, match=r"driver|graphics processor"):
        GpuSweep(LOOP, CLOCK, TILTED, NUMBERS, PLACES)


@BOTH
@needs(GRAPHICS)
def test_a_graphics_processor_scores_as_lanes_do(double):
    rows = values(1000)
    wanted = Sweep(LOOP, CLOCK, TILTED, NUMBERS, PLACES, double).fly(rows)
    one = GpuSweep(LOOP, CLOCK, TILTED, NUMBERS, PLACES, double)
    got = one.fly(rows, portion=300)
    np.testing.assert_array_equal(got.outcome, wanted.outcome)
    np.testing.assert_array_equal(got.metrics, wanted.metrics)
    np.testing.assert_array_equal(table(one.fly(rows)), table(got))
    assert one.seconds > 0


@BOTH
@needs(GRAPHICS)
def test_a_graphics_processor_draws_what_the_host_draws(double):
    one = GpuSweep(LOOP, CLOCK, TILTED, NUMBERS, PLACES, double, generate=draw)
    got, drawn = one.generated(65000, 66000)
    flights = np.arange(65000, 66000)
    host = np.array(draw((flights >> 16).astype(float), (flights & 0xFFFF).astype(float))).T
    np.testing.assert_array_equal(drawn[:, np.argsort(PLACES)], host if double else host.astype(np.float32))
    parts, _ = one.generated(65000, 66000, portion=300)
    np.testing.assert_array_equal(table(got), table(parts))

"""The laws as a program for graphics processors: written, assembled, and run thread by thread on this machine's own."""

import ctypes
import importlib.util
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from llvmlite import binding as llvm

from quadstep.control.backstepping import Backstepping
from quadstep.control.opaque import flying
from quadstep.flight.closed_loop import Outcome
from quadstep.flight.cuda import Device, NoDeviceError
from quadstep.flight.gpu_sweep import REGISTERS, GpuSweep
from quadstep.flight.loop import Loop
from quadstep.flight.ptx import ptx
from quadstep.flight.scored import scored
from quadstep.flight.sweep import Batch, Sweep
from quadstep.flight.sweep_trace import SweepTrace
from quadstep.guidance.piecewise import Piecewise
from quadstep.mission.read import read_mission
from tests.flights import parameters, state
from tests.test_engines_agreement import TILTED, WAYPOINTS
from tests.test_engines_scored import CLOCK, LOOP, NUMBERS, PLACES, table, values

WAYPOINT_LOOP = Loop(Piecewise(), Backstepping())
KINDS = pytest.mark.parametrize("double", [True, False], ids=["f64", "f32"])


@pytest.fixture(scope="module")
def text():
    return ptx(LOOP, TILTED, NUMBERS, frozenset(PLACES))


def assembler():
    """ptxas from the path, or from a wheel of NVIDIA's."""
    found = shutil.which("ptxas")
    package = importlib.util.find_spec("nvidia")
    for folder in package.submodule_search_locations or () if package else ():
        found = found or next((str(path) for path in Path(folder).glob("**/bin/ptxas")), None)
    return found


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


def test_f32_flushes_and_divides_fast_but_adds_as_written(text):
    assert "rcp.approx.ftz.f32" in text
    assert "sqrt.approx.ftz.f32" in text
    assert not re.search(r"(div|rcp|sqrt)\.rn\.f32", text)
    assert "add.rn.ftz.f32" in text  # the magic number that finds the nearest whole one is not contracted away
    assert not re.search(r"\.f64", text)


def test_f64_is_exact_to_rounding():
    text = ptx(LOOP, TILTED, NUMBERS, frozenset(PLACES), double=True)
    assert "rcp.rn.f64" in text
    assert not re.search(r"approx|\.f32", text)


@pytest.mark.parametrize(("architecture", "target"), [(70, "sm_70"), (80, "sm_80"), (90, "sm_90"), (120, "sm_90")])
def test_the_program_is_for_this_processor_or_one_before_it(architecture, target):
    assert f".target {target}" in ptx(LOOP, TILTED, NUMBERS, frozenset(PLACES), architecture=architecture)


def test_processors_too_old_are_refused():
    with pytest.raises(ValueError, match=r"7\.0 or later"):
        ptx(LOOP, TILTED, NUMBERS, frozenset(PLACES), architecture=61)


def test_a_controller_that_calls_python_is_refused():
    plan = read_mission(Path("examples/a_bad_day.toml")).plan(Path("examples"))
    with flying(lambda t, measured, reference: (9.0, (0.0, 0.0, 0.0))) as (law, gains):
        flown = plan.with_controller(law, gains)
        with pytest.raises(ValueError, match="calls Python"):
            ptx(scored(flown.loop, plan.ticks, 0.02)[0], plan.start, flown.parameters, frozenset())


@pytest.mark.skipif(assembler() is None, reason="no ptxas: neither on the path nor from the wheel nvidia-cuda-nvcc")
@pytest.mark.parametrize("architecture", [80, 90])
def test_the_paper_s_loop_takes_few_registers_and_spills_none(tmp_path, architecture, record_property):
    source = tmp_path / "sweep.ptx"
    source.write_text(ptx(LOOP, TILTED, NUMBERS, frozenset(PLACES), architecture=architecture))
    command = [assembler(), "-v", f"-arch=sm_{architecture}", f"-maxrregcount={REGISTERS}", str(source), "-o", "/dev/null"]
    told = subprocess.run(command, capture_output=True, text=True, check=True).stderr
    record_property("ptxas", told)
    assert "0 bytes spill stores, 0 bytes spill loads" in told
    assert int(re.search(r"Used (\d+) registers", told).group(1)) <= REGISTERS


@pytest.mark.skipif(assembler() is None, reason="no ptxas: neither on the path nor from the wheel nvidia-cuda-nvcc")
def test_other_loops_assemble(tmp_path, record_property):
    plan = read_mission(Path("examples/a_bad_day.toml")).plan(Path("examples"))
    numbers = parameters(path=WAYPOINTS)
    others = {
        "a_bad_day": (scored(plan.loop, plan.ticks, 0.02)[0], plan.start, plan.parameters, frozenset([0]), False),
        "waypoints_f64": (scored(WAYPOINT_LOOP, CLOCK._replace(every=(1,)), 0.02)[0], state(), numbers, frozenset([0]), True),
    }
    for name, (loop, start, given, varying, double) in others.items():
        source = tmp_path / f"{name}.ptx"
        source.write_text(ptx(loop, start, given, varying, double))
        command = [assembler(), "-v", "-arch=sm_90", str(source), "-o", "/dev/null"]
        record_property(name, subprocess.run(command, capture_output=True, text=True, check=True).stderr)


# The same scalar program, compiled for this machine and run thread by thread


class Threads(Batch):
    """What a graphics processor would do, one thread after the other."""

    def fly(self, rows, size=8):
        trace = SweepTrace(self.loop, TILTED, NUMBERS, frozenset(self.varying), self.double, 1, gpu=True)
        for name in ("ctaid", "ntid", "tid"):  # registers of a graphics processor become variables of the module
            trace.module.get_global(f"llvm.nvvm.read.ptx.sreg.{name}.x").name = name
        text = str(trace.module).replace("addrspace(4)", "")
        for name in ("ctaid", "ntid", "tid"):
            variable = f"@register.{name}"
            body = f"{variable} = global i32 0\ndefine i32 @{name}() {{ %v = load i32, i32* {variable}\n ret i32 %v }}\n"
            text = re.sub(rf'declare i32 @"{name}"\(\)', body, text)
        call, engine = native(text)
        put(engine, "constants", self.constants)
        columns, results = self.columns(self.rows(rows), len(rows)), np.zeros((self.row_count, len(rows)), self.number)
        number = ctypes.c_double if self.double else ctypes.c_float
        kinds = [ctypes.c_int64] * 2 + [number] + [ctypes.c_void_p] * 4
        buffers = [buffer.ctypes.data for buffer in (self.every, columns, self.tables, results)]
        put(engine, "register.ntid", np.int32(size))
        for block in range(-(-len(rows) // size)):
            for thread in range(size):
                put(engine, "register.ctaid", np.int32(block))
                put(engine, "register.tid", np.int32(thread))
                ctypes.CFUNCTYPE(None, *kinds)(call)(len(rows), self.ticks.last, self.ticks.step, *buffers)
        return self.swept(results)


def native(text):
    """Machine code of this computer."""
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    machine = llvm.Target.from_default_triple().create_target_machine(opt=1)
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(text), machine)
    engine.finalize_object()
    return engine.get_function_address("sweep"), engine


def put(engine, name, value):
    value = np.asarray(value)
    ctypes.memmove(engine.get_global_value_address(name), value.ctypes.data, value.nbytes)


@KINDS
def test_threads_score_as_lanes_do(double):
    rows = values(11)
    rows[3, 1] = 0.8  # too fast
    rows[5, 2] = np.nan
    ticks = CLOCK._replace(last=120)
    wanted = Sweep(LOOP, ticks, TILTED, NUMBERS, PLACES, double).fly(rows)
    got = Threads(LOOP, ticks, TILTED, NUMBERS, PLACES, double).fly(rows)
    np.testing.assert_array_equal(got.outcome, wanted.outcome)
    assert Outcome(got.outcome[5]) is Outcome.NOT_FINITE
    np.testing.assert_allclose(got.ended, wanted.ended, atol=1e-9)
    np.testing.assert_allclose(table(got)[[0, 1, 2, 4, 6, 7, 8, 9, 10]], table(wanted)[[0, 1, 2, 4, 6, 7, 8, 9, 10]],
                               rtol=1e-8 if double else 2e-3, atol=1e-9 if double else 1e-5)  # fmt: skip


def has_device():
    try:
        Device()
    except NoDeviceError:
        return False
    return True


@pytest.mark.skipif(has_device(), reason="there is a graphics processor")
def test_without_a_graphics_processor_it_says_so():
    with pytest.raises(NoDeviceError, match=r"driver|graphics processor"):
        GpuSweep(LOOP, CLOCK, TILTED, NUMBERS, PLACES)


@KINDS
@pytest.mark.skipif(not has_device(), reason="no graphics processor")
def test_a_graphics_processor_scores_as_lanes_do(double):
    rows = values(1000)
    wanted = Sweep(LOOP, CLOCK, TILTED, NUMBERS, PLACES, double).fly(rows)
    one = GpuSweep(LOOP, CLOCK, TILTED, NUMBERS, PLACES, double)
    got = one.fly(rows, portion=300)
    np.testing.assert_array_equal(got.outcome, wanted.outcome)
    np.testing.assert_allclose(got.metrics, wanted.metrics, rtol=1e-8 if double else 2e-3, atol=1e-9 if double else 1e-5)
    np.testing.assert_array_equal(table(one.fly(rows)), table(got))
    assert one.seconds > 0

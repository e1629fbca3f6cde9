"""Launches on a graphics processor, over a stand-in for its driver that runs the same scalar program thread by thread."""

import gc

import numpy as np
import pytest

from benchmarks.gpu import measured
from quadstep.engines import cuda
from quadstep.engines.cuda import CudaError, Device, NoDeviceError, OutOfDeviceMemoryError
from quadstep.engines.gpu_sweep import REGISTERS, GpuSweep
from quadstep.engines.sweep import Sweep, places
from quadstep.interfaces.closed_loop import Outcome
from quadstep.io.errors import UserError
from quadstep.numbers.noise import flight_key, key, normals, uniforms
from tests.fake_driver import installed
from tests.flights import through_lanes
from tests.sweeps import CLOCK, LOOP, NUMBERS, PLACES, TILTED, table, values

KINDS = pytest.mark.parametrize("double", [True, False], ids=["f64", "f32"])
TICKS = CLOCK._replace(last=60)
BRIEF = CLOCK._replace(last=10)


def law(high, low):
    """Mass, height, duration and disturbance in the order of their places."""
    one = flight_key(key(2**40 + 5, 0).words, high, low)
    mass, duration, scale = uniforms(one, 3, 0.0, 3)
    (height,) = normals(one, 4, 1.0, 1)
    drawn = (0.8 + 0.4 * mass, 4.0 + 4.0 * duration, 0.05 * height, scale)  # as VARYING names them
    return [drawn[i] for i in np.argsort(PLACES)]


def gpu(ticks=TICKS, double=False, **given):
    return GpuSweep(LOOP, ticks, TILTED, NUMBERS, PLACES, double, **given)


def drawn_on_the_host(first, past):
    flights = np.arange(first, past)
    columns = law((flights >> 16).astype(float), (flights & 0xFFFF).astype(float))
    return np.array(columns).T[:, np.argsort(np.argsort(PLACES))]


@KINDS
def test_threads_score_as_lanes_do(double, monkeypatch):
    driver = installed(monkeypatch)
    rows = values(11)
    rows[3, 1] = 0.8  # too fast
    rows[5, 2] = np.nan
    ticks = CLOCK._replace(last=120)
    wanted = Sweep(LOOP, ticks, TILTED, NUMBERS, PLACES, double).fly(rows)
    got = gpu(ticks, double).fly(rows)
    np.testing.assert_array_equal(got.outcome, wanted.outcome)
    whole = [0, 1, 2, 4, 6, 7, 8, 9, 10]
    assert Outcome(got.outcome[5]) is Outcome.NOT_FINITE
    np.testing.assert_array_equal(got.ended, wanted.ended)
    np.testing.assert_array_equal(table(got)[whole], table(wanted)[whole])
    assert not driver.problems


@KINDS
def test_generated_flights_are_those_of_the_values_drawn_on_the_host(double, monkeypatch):
    driver = installed(monkeypatch)
    first = 65536 - 4  # both halves of the number change
    got, drawn = gpu(double=double, generate=law).generated(first, first + 9)
    host = drawn_on_the_host(first, first + 9)
    np.testing.assert_array_equal(drawn, host if double else host.astype(np.float32))
    assert len(np.unique(drawn[:, 0])) == 9
    wanted = gpu(double=double).fly(drawn)
    np.testing.assert_array_equal(got.outcome, wanted.outcome)
    np.testing.assert_array_equal(table(got), table(wanted))
    assert not driver.problems


@KINDS
def test_portions_change_nothing_to_the_bit(double, monkeypatch):
    driver = installed(monkeypatch)
    one = gpu(BRIEF, double, generate=law)
    whole, drawn = one.generated(0, 300)
    parts, drawn_in_parts = one.generated(0, 300, portion=70, threads=32)
    end, drawn_at_the_end = one.generated(211, 300)
    assert [flights for flights, *_ in driver.launches] == [300, 70, 70, 70, 70, 20, 89]
    np.testing.assert_array_equal(table(whole), table(parts))
    np.testing.assert_array_equal(drawn, drawn_in_parts)
    np.testing.assert_array_equal(table(whole)[211:], table(end))
    np.testing.assert_array_equal(drawn[211:], drawn_at_the_end)
    given, rows = gpu(BRIEF, double), values(40)
    np.testing.assert_array_equal(table(given.fly(rows)), table(given.fly(rows, portion=7)))


@KINDS
def test_a_flight_s_key_from_numbers_is_the_key(double):
    flights = [0, 1, 65535, 65536, 2**31 + 12345, 2**32 - 1]
    base = key(987654321987, 0).words
    wanted = np.array([key(987654321987, flight).words.entries for flight in flights]).T
    halves = [(float(flight >> 16), float(flight & 0xFFFF)) for flight in flights]
    high, low = np.array(halves).T
    assert np.array_equal(np.array([flight_key(base, *pair).words.entries for pair in halves]).T, wanted)
    got = flight_key(base, high, low).words
    assert all(np.array_equal(np.broadcast_to(ours, 6), theirs) for ours, theirs in zip(got, wanted, strict=True))
    pad = [np.resize(column, 8) for column in (high, low)]
    lanes = through_lanes(lambda a, b: [part + 0.0 * a for part in flight_key(base, a, b).words], *pad, double=double)
    assert np.array_equal(np.array(lanes)[2:, :6], wanted[2:])


def test_noise_of_a_flight_may_come_from_its_number(monkeypatch):
    installed(monkeypatch)
    varying = places(TILTED, NUMBERS, ["start.position.0", "start.position.1"])
    drawn = GpuSweep(LOOP, BRIEF, TILTED, NUMBERS, varying[::-1], True, generate=lambda high, low: [high, low]).generated(
        2**32 - 3, 2**32
    )[1]
    np.testing.assert_array_equal(drawn, [[65533, 65535], [65534, 65535], [65535, 65535]])  # in the order of `varying`


def test_a_launch_takes_whole_waves_and_about_as_long_as_wanted(monkeypatch):
    driver = installed(monkeypatch, slow=0.5 / 2000)  # 2 processors of 3 blocks of 128 threads
    told = []
    one = gpu(BRIEF._replace(last=1), generate=law)
    one.generated(0, 5000, told.append)
    assert [flights for flights, *_ in driver.launches] == [768, 1536, 1536, 1160]
    assert told == [768, 1536, 1536, 1160]
    assert driver.launches[0][1:] == (6, 128)
    assert one.seconds == pytest.approx(1.25)
    assert driver.options[0] == REGISTERS


def test_a_launch_fits_the_memory(monkeypatch):
    driver = installed(monkeypatch, memory=60_000)
    one = gpu(BRIEF._replace(last=1))
    rows = values(900)
    wanted = table(one.fly(rows, portion=300))
    driver.launches.clear()
    driver.calls.clear()
    driver.memory = 30_000
    np.testing.assert_array_equal(table(one.fly(rows)), wanted)
    assert max(flights for flights, *_ in driver.launches) < 300
    assert driver.calls["cuMemAlloc_v2"] == 2 + 2 * len(driver.launches)  # none was refused
    assert not driver.problems


def test_when_others_take_the_memory_launches_shrink(monkeypatch):
    driver = installed(monkeypatch)
    one = gpu(BRIEF._replace(last=1))
    rows = values(700)
    wanted = table(one.fly(rows))
    driver.launches.clear()
    driver.do_cuMemGetInfo_v2 = lambda free, total: free.__setitem__(0, 1 << 30)  # as it was a moment ago
    driver.memory = 40_000
    np.testing.assert_array_equal(table(one.fly(rows)), wanted)
    assert [flights for flights, *_ in driver.launches] == [384, 316]
    driver.memory = 3000
    with pytest.raises(OutOfDeviceMemoryError, match=r"cuMemAlloc_v2: out of memory \(2\)$"):
        one.fly(rows)
    assert not driver.held
    assert not driver.stack


@pytest.mark.parametrize(("fail", "said"), [
    ({"cuEventSynchronize": 700}, r"cuEventSynchronize: an illegal memory access was encountered \(700\)$"),
    ({"cuMemcpyDtoH_v2": 214, "cuMemFree_v2": 214}, "ECC"),
    ({"cuLaunchKernel": 701}, r"cuLaunchKernel: unknown error \(701\)"),
])  # fmt: skip
def test_a_failing_kernel_is_one_line_and_leaves_nothing(fail, said, monkeypatch):
    driver = installed(monkeypatch)
    one = gpu(BRIEF)
    driver.fail = fail
    with pytest.raises(CudaError, match=said) as caught:
        one.fly(values(3))
    assert isinstance(caught.value, UserError)
    assert "\n" not in str(caught.value)
    assert not driver.events
    assert not driver.stack
    assert not driver.held or "cuMemFree_v2" in fail


def test_ctrl_c_between_launches_frees_everything(monkeypatch):
    driver = installed(monkeypatch)
    one = gpu(BRIEF, generate=law)

    def interrupt(over):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        one.generated(0, 300, interrupt, portion=100)
    assert len(driver.launches) == 1
    assert not driver.held
    assert not driver.stack
    one.generated(0, 3)  # and it can go on
    assert driver.modules
    del one
    gc.collect()
    assert not driver.modules
    assert not driver.problems


def test_what_the_driver_cannot_compile_is_one_line(monkeypatch):
    installed(monkeypatch)
    monkeypatch.setattr("quadstep.engines.gpu_sweep.assembly", lambda text, architecture: "nonsense")
    with pytest.raises(CudaError, match=r"JIT compilation failed \(218\) ptxas fatal line 1$"):
        gpu(BRIEF)


@pytest.mark.parametrize(("given", "said"), [
    ({"devices": 0}, "finds no graphics processor"),
    ({"fail": {"cuInit": 100}}, r"no CUDA-capable device is detected \(100\)"),
    ({"fail": {"cuDevicePrimaryCtxRetain": 2}}, "out of memory"),
])  # fmt: skip
def test_no_device_is_one_line(given, said, monkeypatch):
    installed(monkeypatch, **given)
    with pytest.raises(NoDeviceError, match=said):
        gpu(BRIEF)


@pytest.mark.parametrize(("name", "said"), [("libthere-is-none.so", "not found"), ("libm.so.6", "too old: it has no cuInit")])
def test_no_driver_is_one_line(name, said, monkeypatch):
    cuda.library.cache_clear()
    monkeypatch.setattr(cuda, "LIBRARY", name)
    with pytest.raises(NoDeviceError, match=said):
        Device()
    cuda.library.cache_clear()


def test_a_device_too_old_is_one_line(monkeypatch):
    driver = installed(monkeypatch)
    driver.do_cuDeviceGetAttribute = lambda value, which, device: value.__setitem__(0, 6)
    with pytest.raises(NoDeviceError, match=r"compute capability 6\.6: 7\.0 or later is needed"):
        gpu(BRIEF)


def test_flying_what_does_not_fit_is_refused(monkeypatch):
    installed(monkeypatch)
    given, generating = gpu(BRIEF), gpu(BRIEF, generate=law)
    with pytest.raises(ValueError, match="`generated` flies them"):
        generating.fly(values(2))
    with pytest.raises(ValueError, match="give `generate`"):
        given.generated(0, 2)
    with pytest.raises(ValueError, match=r"0 to 2\^32 - 1"):
        generating.generated(0, 2**32 + 1)
    with pytest.raises(ValueError, match="1 numbers generated for 4 that vary"):
        gpu(BRIEF, generate=lambda high, low: [high])
    assert len(generating.generated(7, 7)[1]) == 0


def test_the_benchmark_says_what_it_measured(monkeypatch):
    driver = installed(monkeypatch, slow=1e-3)
    for name in ("FLIGHTS", "COMPARED"):
        monkeypatch.setattr(f"benchmarks.gpu.{name}", 3)
    line, accuracy = measured(False)
    assert line.startswith("f32 on Stand-in: ")
    assert "3 blocks of 128: 19% of the threads" in line
    assert accuracy.endswith("0 outcomes differ")
    assert not driver.problems

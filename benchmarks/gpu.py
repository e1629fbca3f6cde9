"""Very many flights on a graphics processor: measured where there is one, else the assembler's figures for the program."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.gpu_assembler import assembled, ptxas
from benchmarks.gpu_count import DOUBLES, H200, ISSUED, KINDS, Bound, Chip, bound, counted, operations
from benchmarks.many_flights import HIGH, LOW, VARYING, plan
from quadstep.engines.cuda import CLOCK, LOCAL_BYTES, PROCESSORS, REGISTERS, THREADS_A_PROCESSOR, NoDeviceError
from quadstep.engines.gpu_sweep import REGISTERS as MOST_REGISTERS
from quadstep.engines.gpu_sweep import THREADS, GpuSweep, assembly, program
from quadstep.engines.scored import scored
from quadstep.engines.sweep import Sweep, places
from quadstep.numbers import Number
from quadstep.numbers.noise import flight_key, key, uniforms

FLIGHTS, COMPARED = 1_000_000, 2048
TARGET = "1e10 steps/s f32 on an H200"
FILE = 65536
"""Registers of one processor."""

WARPS = 64
"""That one processor holds at most."""


def draw(high: Number, low: Number) -> Sequence[Number]:
    """What varies, uniform between LOW and HIGH: drawn on the graphics processor."""
    one = plan()
    shares = uniforms(flight_key(key(1, 0).words, high, low), 0, 0.0, len(VARYING))
    values = [least + (most - least) * share for least, most, share in zip(LOW, HIGH, shares, strict=True)]
    return [values[i] for i in np.argsort(places(one.start, one.parameters, VARYING))]


def gpu(folder: Path) -> tuple[str, str, str, str, str]:
    """A million flights of the paper's closed loop, both nets of ten neurons, RK4, control at 250 Hz, drawn on the device."""
    what = f"graphics processor, closed loop, RK4: {FLIGHTS:,} flights of 10 s at 250 Hz, drawn there"
    del folder
    try:
        lines, accuracy = zip(*(measured(double) for double in (False, True)), strict=True)
    except NoDeviceError as error:
        lines, accuracy = tuple(estimated(double) for double in (False, True)), (f"NOT RUN: {error}",)
    return (
        what,
        "\n".join(lines),
        TARGET,
        "one thread a flight; the estimate has every unit busy all the time",
        "\n".join(accuracy),
    )


def measured(double: bool) -> tuple[str, str]:
    """Steps a second, occupancy and what bounds it; and how far the flights are from those of f64 lanes."""
    one = plan()
    loop, ticks = scored(one.loop, one.ticks, 0.02)
    given = (loop, ticks, one.start, one.parameters, places(one.start, one.parameters, VARYING))
    sweep = GpuSweep(*given, double, generate=draw)
    device, kernel = sweep.device, sweep.kernel
    sweep.generated(0, COMPARED)  # clocks up
    runs = []
    for _ in range(3):
        sweep.generated(0, FLIGHTS)
        runs.append(sweep.seconds)
    rate = FLIGHTS * ticks.last / min(runs)
    blocks = kernel.resident_blocks(THREADS)
    chip = Chip(device.name, device.attribute(PROCESSORS), 1e3 * device.attribute(CLOCK))
    most, counts, limit = chip_bound(double, chip)
    flown, values = sweep.generated(0, COMPARED)
    wanted = Sweep(*given, True).fly(values)
    both = (flown.outcome == 0) & (wanted.outcome == 0)
    apart = np.abs(flown.metrics / wanted.metrics - 1.0)[both, :2].max()
    differing = int((flown.outcome != wanted.outcome).sum())
    line = (
        f"{name(double)} on {device.name}: {rate:.2e} steps/s (kernels {min(runs):.2f} to {max(runs):.2f} s), "
        f"{kernel.attribute(REGISTERS)} registers, {kernel.attribute(LOCAL_BYTES)} local bytes, "
        f"{blocks} blocks of {THREADS}: {blocks * THREADS / device.attribute(THREADS_A_PROCESSOR):.0%} of the threads; "
        f"{rate / limit.steps:.0%} of the bound by {limit.limit}, {operations(counts) * rate:.1e} operations/s of {most:.1e}"
    )
    return line, f"{name(double)} against f64 lanes: RMSE, largest error within {apart:.0e}; {differing} outcomes differ"


def estimated(double: bool) -> str:
    """What the assembler says, and the most that an H200 could do."""
    _, counts, limit = chip_bound(double, H200)
    kinds = ", ".join(f"{counts[kind]:.0f} {kind}" for kind in KINDS if kind != "free")
    line = f"{name(double)}: a step is {kinds}; an H200 at best {limit.steps:.1e} steps/s, bound by {limit.limit} (estimate)"
    if ptxas() is None:
        return f"{line}; no ptxas here"
    told = assembled(assembly(traced(double)), 90, None if double else MOST_REGISTERS)
    blocks = FILE // (-(-told.registers // 8) * 8 * THREADS)
    share = blocks * THREADS / 32 / WARPS
    return f"{line}; ptxas: {told.registers} registers, spills {told.stores} + {told.loads} bytes, {share:.0%} of the warps"


def traced(double: bool) -> str:
    """The program that is measured."""
    one = plan()
    varying = frozenset(places(one.start, one.parameters, VARYING))
    return program(scored(one.loop, one.ticks, 0.02)[0], one.start, one.parameters, varying, double, draw)


def chip_bound(double: bool, chip: Chip) -> tuple[float, dict[str, float], Bound]:
    """Peak operations a second, instructions of a step by kind, and the bound on steps a second."""
    one = plan()
    counts = counted(traced(double), *scored(one.loop, one.ticks, 0.02))
    peak = 2.0 * (DOUBLES if double else ISSUED) * chip.processors * chip.clock
    return peak, counts, bound(counts, double, chip)


def name(double: bool) -> str:
    """Of the kind of number."""
    return "f64" if double else "f32"

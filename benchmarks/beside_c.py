"""A sweep beside the same flights by hand-written C, compiled and flown in the same run."""

import os
import shutil
import statistics
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.airframes import INSTRUCTIONS
from benchmarks.yardstick import COMPILER, STRICT, Yardstick
from quadstep.engines.fly import FlightPlan
from quadstep.engines.kernel import host_width
from quadstep.engines.sweep import Sweep, SweepResults

Row = tuple[str, str, str, str, str]

REPEATS = 7


def in_turn(actions: list[Callable[[], object]], repeats: int = REPEATS) -> list[list[float]]:
    """Seconds of each of several runs of each action, in turn so that a busy moment hits all alike."""
    times: list[list[float]] = [[] for _ in actions]
    for _ in range(repeats):
        for action, taken in zip(actions, times, strict=True):
            start = time.perf_counter()
            action()
            taken.append(time.perf_counter() - start)
    return times


def machine(double: bool) -> str:
    """What the lanes are here."""
    instructions = INSTRUCTIONS.get(host_width(False), "vectors")
    return f"{host_width(double)} lanes of {instructions}, {os.cpu_count()} cores"


def summary(swept: SweepResults) -> NDArray[np.float64]:
    """Of each flight its code, RMS and largest error [m] and the largest norm of its weights, as `yardstick.Flown.scores`."""
    return np.column_stack([swept.outcome, swept.metrics[:, :2], swept.metrics[:, -2:].max(axis=1)])


def beside_c(
    folder: Path,
    name: str,
    source: Path,
    one: FlightPlan,
    sweep: Callable[[bool], Sweep],
    values: NDArray[np.float64],
    double: bool,
    target: str,
) -> Row:
    """A row: flights like `one` that differ in `values`, and the same flights by hand."""
    flights, kind = sweep(double), "f64" if double else "f32"
    swept, other = flights.fly(values), sweep(not double).fly(values)
    if swept.outcome.any():
        raise RuntimeError("a flight of the benchmark was lost")
    precision = np.abs(swept.metrics[:, 0] / other.metrics[:, 0] - 1.0)
    accuracy = f"RMSE f32 to f64: median {np.median(precision):.0e}, largest {precision.max():.0e}"
    steps, name = len(values) * flights.ticks.last, f"{name}, {len(values)} flights of 10 s, {kind}"
    if shutil.which(COMPILER[0]) is None:
        took = min(in_turn([lambda: flights.fly(values)])[0])
        return name, f"{steps / took:.3g} steps/s ({machine(double)})", target, "no C compiler here", accuracy
    strict, fused = (Yardstick(source, flights, one.start, one.parameters, values, folder, fuse) for fuse in (False, True))
    apart = np.abs(summary(swept) - strict.fly().scores).max(axis=1)
    own, *times = in_turn([lambda: flights.fly(values), strict.fly, fused.fly])
    alike, faster = (statistics.median(c / mine for mine, c in zip(own, taken, strict=True)) for taken in times)
    return (
        name,
        f"{steps / min(own):.3g} steps/s ({machine(double)}): {100.0 * alike:.0f} % of the C that rounds alike, "
        f"{100.0 * faster:.0f} % of the C with fused operations",
        target,
        f"hand-vectorised C, {' '.join(COMPILER[:3])}: {STRICT} {steps / min(times[0]):.3g} steps/s, else "
        f"{steps / min(times[1]):.3g}",
        f"to the C: median {np.median(apart):.0e}, largest {apart.max():.0e} in RMSE [m], largest error [m], weights; "
        f"{accuracy}",
    )

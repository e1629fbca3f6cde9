"""Very many flights, each leaving only its score: the paper's closed loop beside hand-written C, start-up, cost by number."""

import json
import os
import shutil
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from benchmarks.airframes import INSTRUCTIONS
from benchmarks.many_flights import drawn, plan, sweep
from benchmarks.processes import run
from benchmarks.yardstick import COMPILER, STRICT, Yardstick
from quadstep.flight.kernel import host_width

Row = tuple[str, str, str, str, str]

FLIGHTS, REPEATS = 4096, 7


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


def beside_c(folder: Path, double: bool, target: str, count: int = FLIGHTS) -> Row:
    """A row: the paper's closed loop and the same by hand in C, compiled and flown in the same run."""
    one, values, flights = plan(), drawn(count), sweep(double)
    swept, other = flights.fly(values), sweep(not double).fly(values)
    if swept.outcome.any():
        raise RuntimeError("a flight of the benchmark was lost")
    precision = np.abs(swept.metrics[:, 0] / other.metrics[:, 0] - 1.0)
    accuracy = f"RMSE f32 to f64: median {np.median(precision):.0e}, largest {precision.max():.0e}"
    steps, name = count * flights.ticks.last, f"paper's closed loop, {count} flights of 10 s, {'f64' if double else 'f32'}"
    if shutil.which(COMPILER[0]) is None:
        took = min(in_turn([lambda: flights.fly(values)])[0])
        return name, f"{steps / took:.3g} steps/s ({machine(double)})", target, "no C compiler here", accuracy
    by_hand, fused = (Yardstick(flights, one.start, one.parameters, values, folder, fused) for fused in (False, True))
    known = by_hand.fly()
    ours = np.column_stack([swept.outcome, swept.metrics[:, :2], swept.metrics[:, -2:].max(axis=1)])
    apart = np.abs(ours - known).max()
    own, *times = in_turn([lambda: flights.fly(values), by_hand.fly, fused.fly])
    alike, faster = (statistics.median(c / mine for mine, c in zip(own, taken, strict=True)) for taken in times)
    return (
        name,
        f"{steps / min(own):.3g} steps/s ({machine(double)}): {100.0 * alike:.0f} % of the C that rounds alike, "
        f"{100.0 * faster:.0f} % of the C with fused operations",
        target,
        f"hand-vectorised C, {' '.join(COMPILER[:3])}: {STRICT} {steps / min(times[0]):.3g} steps/s, else "
        f"{steps / min(times[1]):.3g}",
        f"to the C: {apart:.0e} in RMSE [m], largest error [m], weights; {accuracy}",
    )


def single_precision(folder: Path) -> Row:
    """In f32."""
    return beside_c(folder, False, ">= 6.5e7 on two AVX-512 cores; >= 70 % of the C")


def double_precision(folder: Path) -> Row:
    """In f64."""
    return beside_c(folder, True, ">= 2.5e7 on two AVX-512 cores; >= 70 % of the C")


READY = "from benchmarks.many_flights import sweep; sweep(False)"


def ready(folder: Path) -> Row:
    """A process that imports everything and compiles the paper's loop for very many flights."""

    def process(cache: Path) -> float:
        start = time.perf_counter()
        environment = {**os.environ, "QUADSTEP_CACHE": str(cache)}
        subprocess.run([sys.executable, "-c", READY], check=True, env=environment)
        return time.perf_counter() - start

    uncached = min(process(folder / f"empty{i}") for i in range(5))
    cached = min(process(folder / "empty0") for _ in range(5))
    return (
        "ready to fly very many: a process, all of it",
        f"compiled {uncached:.2f} s, from the cache {cached:.2f} s",
        "< 1 s",
        f"an interpreter that imports numpy {min(run('-c', 'import numpy') for _ in range(5)):.2f} s",
        "-",
    )


COUNTS = (10**3, 10**4, 10**5)
LONG_COUNTS = (*COUNTS, 10**6, 10**7)


def cost(_: Path) -> Row:
    """From few flights to very many, in a process of its own. LONG=1 goes on to ten million: a quarter of an hour."""
    counts = LONG_COUNTS if os.environ.get("LONG") else COUNTS
    command = f"import json; from benchmarks.many_flights import line; print(json.dumps(line({counts})))"
    result = json.loads(subprocess.run([sys.executable, "-c", command], check=True, capture_output=True).stdout)
    seconds = np.array(result["seconds"])
    power = np.polyfit(np.log(counts), np.log(seconds), 1)[0]
    each = ", ".join(f"{count:.0e}: {1e6 * took / count:.0f}" for count, took in zip(counts, seconds, strict=True))
    return (
        "cost of a 10 s flight, f32, by number of flights",
        f"{each} us; {result['memory'] / 1e6:.0f} MB",
        "power 1; < 1 GB",
        f"a million take {1e6 * seconds[-1] / counts[-1]:.0f} s at that",
        f"cost grows with the power {power:.3f} of the number",
    )

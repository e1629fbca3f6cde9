"""Very many flights, each leaving only its score: the paper's closed loop beside hand-written C, start-up, cost by number."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

from benchmarks.beside_c import Row, beside_c
from benchmarks.many_flights import drawn, plan, sweep
from benchmarks.processes import run
from benchmarks.yardstick import PAPER

FLIGHTS = 4096


def beside(folder: Path, double: bool, target: str) -> Row:
    """A row: the paper's closed loop."""
    return beside_c(folder, "paper's closed loop", PAPER, plan(), sweep, drawn(FLIGHTS), double, target)


def single_precision(folder: Path) -> Row:
    """In f32."""
    return beside(folder, False, ">= 6.5e7 on two AVX-512 cores; >= 70 % of the C")


def double_precision(folder: Path) -> Row:
    """In f64."""
    return beside(folder, True, ">= 2.5e7 on two AVX-512 cores; >= 70 % of the C")


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

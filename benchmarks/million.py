"""`quadstep campaign` as a whole process: a million flights with their Parquet files, and the cost of further flights.

As a file: python -m benchmarks.million 10000000 1, for ten times as many of 1 s.
"""

import json
import resource
import subprocess
import sys
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pyarrow.parquet as pq

MILLION = 1_000_000

MISSION = """
[path]
type = "minimum-jerk"
end = [5.0, 1.25, 2.5]
duration = 10.0

[start]
position = [0.0, 0.0, 0.0]

[simulation]
step = 0.004
control_period = 0.004
log_period = 0.02
duration = {seconds}
"""
"""A quarter of Case 1's way in a quarter of its time, at 250 Hz, or the beginning of it."""

SECONDS, RATE = 10.0, 250

CAMPAIGN = """
mission = "mission.toml"
precision = "{precision}"

[vary]
"vehicle.mass" = {{ type = "normal", mean = 1.0, deviation = 0.1, low = 0.6, high = 1.4 }}
"disturbance.scale" = {{ type = "uniform", low = 0.0, high = 2.0 }}
"start.position.0" = {{ type = "uniform", low = -0.2, high = 0.2 }}
"start.position.1" = {{ type = "uniform", low = -0.2, high = 0.2 }}
"start.position.2" = {{ type = "uniform", low = -0.2, high = 0.2 }}

[failure]
largest_error = 0.5
"""


class Cost(NamedTuple):
    """What a campaign took: seconds of wall time, most memory of its process [bytes], Parquet [bytes], share of success."""

    seconds: float
    memory: int
    disk: int
    success: float


def campaign(folder: Path, flights: int, precision: str = "f32", seconds: float = SECONDS) -> Cost:
    """Fly so many flights of so many seconds, from the start of the process to its end."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "mission.toml").write_text(MISSION.format(seconds=seconds), encoding="utf-8")
    file, out = folder / f"{precision}.toml", folder / f"{precision}-{flights}"
    file.write_text(CAMPAIGN.format(precision=precision), encoding="utf-8")
    command = ["campaign", str(file), "--flights", str(flights), "--out", str(out), "--overwrite"]
    start = time.perf_counter()
    subprocess.run([sys.executable, "-m", "quadstep", *command], check=True, capture_output=True)
    took = time.perf_counter() - start
    memory = 1024 * resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss  # the largest child so far
    manifest = json.loads((out / "campaign.json").read_text(encoding="utf-8"))
    disk = sum(path.stat().st_size for path in (out / "flights").iterdir())
    return Cost(took, memory, disk, manifest["summary"]["success"]["value"])


def single_precision_error(folder: Path, flights: int = 2000) -> float:
    """The largest difference of position RMSE between f32 and f64 over the same flights [m]."""
    rmse = []
    for precision in ("f32", "f64"):
        campaign(folder, flights, precision)
        table = pq.read_table(folder / f"{precision}-{flights}" / "flights", columns=["position_rmse[m]"])
        rmse.append(table.column(0).to_numpy().astype(float))
    return float(np.abs(rmse[0] - rmse[1]).max())


def million_flights(folder: Path) -> tuple[str, str, str, str, str]:
    """A million flights of 10 s at 250 Hz, end to end."""
    apart = single_precision_error(folder)
    small, cost = campaign(folder, MILLION // 100), campaign(folder, MILLION)
    return (
        "a million flights of 10 s at 250 Hz: process, Parquet and report",
        f"{cost.seconds:.0f} s, {cost.memory / 1e6:.0f} MB memory, {cost.disk / 1e6:.0f} MB Parquet "
        f"({MILLION * SECONDS * RATE / cost.seconds:.2g} steps/s in f32)",
        "< 60 s on two AVX-512 cores, < 1000 MB",
        f"10,000 flights {small.seconds:.1f} s; the million 100 times that, less {100 * small.seconds - cost.seconds:.0f} s",
        f"f32 to f64: position RMSE of a flight within {1e6 * apart:.1g} um",
    )


def main() -> None:
    """Print the cost of campaigns from a thousand flights up to the number given."""
    folder, most = Path("out/cost"), int(sys.argv[1]) if len(sys.argv) > 1 else MILLION
    seconds = float(sys.argv[2]) if len(sys.argv) > 2 else SECONDS
    flights = 1000
    while flights <= most:
        cost = campaign(folder, flights, seconds=seconds)
        print(
            f"{flights:>10,} flights {cost.seconds:8.1f} s {1e6 * cost.seconds / flights:8.1f} us a flight "
            f"{cost.memory / 1e6:6.0f} MB memory {cost.disk / 1e6:7.1f} MB Parquet",
            flush=True,
        )
        flights *= 10


if __name__ == "__main__":
    main()

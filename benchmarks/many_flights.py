"""Very many flights of the paper's closed loop, alike but for a few numbers; imports no more than flying them needs."""

import resource
import time
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadstep.engines.fly import FlightPlan
from quadstep.engines.scored import scored
from quadstep.engines.sweep import Sweep, places
from quadstep.mission.schema import Mission

CASE_1_IN_10_S: dict[str, Any] = {
    "path": {"type": "minimum-jerk", "end": [5.0, 1.25, 2.5], "duration": 10.0},
    "simulation": {"step": 0.004, "control_period": 0.004, "log_period": 0.02},
}
"""A quarter of Case 1's way in a quarter of its time, at 250 Hz."""

VARYING = (
    "parameters.vehicle.mass",
    "parameters.disturbance.scale",
    *(f"parameters.disturbance.force.{axis}" for axis in range(3)),
    *(f"start.position.{axis}" for axis in range(3)),
)
LOW = (0.8, 0.0, -0.5, -0.5, -0.5, -0.2, -0.2, -0.2)
HIGH = (1.2, 2.0, 0.5, 0.5, 0.5, 0.2, 0.2, 0.2)


def plan() -> FlightPlan:
    """The flight that all others are like."""
    return Mission.model_validate(CASE_1_IN_10_S).plan()


def drawn(count: int, seed: int = 1) -> NDArray[np.float64]:
    """What varies, one row per flight."""
    return np.random.default_rng(seed).uniform(LOW, HIGH, (count, len(VARYING)))


def sweep(double: bool) -> Sweep:
    """Flights of the paper's closed loop, a score every 0.02 s."""
    one = plan()
    loop, ticks = scored(one.loop, one.ticks, 0.02)
    return Sweep(loop, ticks, one.start, one.parameters, places(one.start, one.parameters, VARYING), double)


CHUNK = 2**16


def line(counts: tuple[int, ...]) -> dict[str, Any]:
    """Seconds for each of so many flights in f32, in chunks as a campaign has them, and this process's memory [bytes]."""
    flights = sweep(False)
    flights.fly(drawn(1))
    times = []
    for count in counts:
        start = time.perf_counter()
        for first in range(0, count, CHUNK):
            if flights.fly(drawn(min(CHUNK, count - first), seed=first)).outcome.any():
                raise RuntimeError("a flight of the benchmark was lost")
        times.append(time.perf_counter() - start)
    return {"seconds": times, "memory": peak_memory()}


def peak_memory() -> int:
    """The most that this process has held [bytes]."""
    status = Path("/proc/self/status")
    if status.exists():
        return 1024 * int(status.read_text().partition("VmHWM:")[2].split()[0])
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

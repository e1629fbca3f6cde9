"""Compiling and flying, against the same laws on Python floats and against an adaptive solver."""

import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, cast

import numpy as np
from scipy.integrate import solve_ivp

from quadstep.engines import kernel
from quadstep.engines.engine import Engine
from quadstep.engines.fly import FlightPlan, fly
from quadstep.engines.kernel import host_width
from quadstep.interfaces.closed_loop import Clock
from quadstep.interfaces.controller import Command
from quadstep.interfaces.log import FlightLog
from quadstep.metrics.quantities import position_errors
from quadstep.mission.schema import Mission
from quadstep.numbers import flatten, rebuild
from quadstep.vehicle.lagrange import Lagrange
from quadstep.vehicle.paper import State, derivative

CASE_1_AT_250_HZ: dict[str, Any] = {
    "path": {"type": "minimum-jerk", "end": [20.0, 5.0, 10.0], "duration": 40.0},
    "simulation": {"step": 0.004, "control_period": 0.004, "log_period": 0.02},
}


def seconds(action: Callable[[], object], repeats: int = 7) -> float:
    """The least time of several runs."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        action()
        times.append(time.perf_counter() - start)
    return min(times)


def plan() -> FlightPlan:
    """Case 1 at 250 Hz."""
    return Mission.model_validate(CASE_1_AT_250_HZ).plan()


def compilation(folder: Path) -> tuple[str, str, str, str, str]:
    """First flight of a kind: traced and compiled, or taken from the cache."""

    def first() -> None:
        kernel.KERNELS.clear()
        one = plan()
        kernel.prepare(one.loop, one.parameters, one.start, kernel.shared_leaves(one.parameters), True, host_width(True))

    def cold() -> None:
        os.environ["QUADSTEP_CACHE"] = str(folder / f"cache{time.perf_counter_ns()}")
        first()

    uncached, cached = seconds(cold, 3), seconds(first, 3)
    return (
        "compilation",
        f"{uncached:.2f} s",
        "< 1 s",
        f"from the cache {cached:.2f} s ({uncached / cached:.1f} times less)",
        "-",
    )


def case_1_flight(_: Path) -> tuple[str, str, str, str, str]:
    """One Case 1 flight at 250 Hz on lanes; the same laws on floats; the plant against DOP853."""
    one = plan()
    log = fly(one)
    took = seconds(lambda: fly(one))
    slow = seconds(lambda: fly(one, Engine.PYTHON), 1)
    difference = np.abs(fly(one, Engine.PYTHON).rows - log.rows).max()
    yardstick = f"Python floats {slow:.1f} s ({slow / took:.0f} times more)"
    accuracy = (
        f"largest error {1e6 * np.abs(position_errors(log)).max():.0f} um; lanes to floats {difference:.0e}; "
        f"RK4 to DOP853 {solver_difference(one, log):.0e} m"
    )
    return "Case 1 at 250 Hz, 10,000 steps", f"{1e3 * took:.1f} ms", "< 50 ms", yardstick, accuracy


def solver_difference(one: FlightPlan, log: FlightLog, samples: int = 500) -> float:
    """Largest position difference [m] over the first samples when DOP853 integrates the same held commands."""
    step, worst = one.ticks.step, 0.0
    cycle, plant = one.loop.start(one.start, one.parameters), cast(Lagrange, one.loop.plant)

    def rate(_: float, flat: Any, command: Command) -> list[float]:
        state = rebuild(one.start, iter(flat.tolist()))
        vehicle, disturbance = one.parameters.vehicle, one.parameters.disturbance
        return flatten(derivative(vehicle, disturbance, plant.kinematics, state, command.thrust, command.torque))

    for tick in range(samples):
        cycle, _ = one.loop.law(cycle, one.parameters, Clock(tick * step, float(tick), step))
        flat, command = flatten(cycle.state), (cycle.command,)
        solved = solve_ivp(rate, (0.0, step), flat, args=command, method="DOP853", rtol=1e-12, atol=1e-14)
        state = rebuild(cast(State, cycle.state), iter(solved.y[:, -1].tolist()))
        cycle = cycle._replace(state=state)
        if (tick + 1) % one.ticks.log == 0:
            row = log.table("x", "y", "z")[(tick + 1) // one.ticks.log]
            worst = max(worst, float(np.abs(row - np.array(list(state.position))).max()))
    return worst


def throughput(_: Path) -> tuple[str, str, str, str, str]:
    """Many flights at once, with full logs."""
    one, count = plan(), 512
    short = one._replace(ticks=one.ticks._replace(last=2000))

    def batch() -> list[FlightLog]:
        return kernel.fly_lanes(short.loop, [short.parameters] * count, [short.start] * count, short.ticks)

    took, alone = seconds(batch, 3), seconds(lambda: fly(short))
    rate, single = count * short.ticks.last / took, short.ticks.last / alone
    same = "identical to the bit" if np.array_equal(batch()[-1].rows, fly(short).rows) else "NOT identical"
    return (
        f"{count} flights with logs, {os.cpu_count()} cores",
        f"{rate:.2g} steps/s",
        "-",
        f"one flight alone {single:.2g} steps/s ({rate / single:.1f} times less)",
        f"last flight to the same one alone: {same}",
    )

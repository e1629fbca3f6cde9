"""The engine without a compiler: the loop runs in Python, step by step, on floats or on NumPy arrays.

Floats fly one vehicle and are for reading, debugging and teaching; arrays fly a batch by broadcasting. Same laws, same order.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadstep.flight.log import COLUMNS, FlightLog, finished, log_row
from quadstep.flight.loop import Cycle, Loop, Outcome, Parameters, Ticks
from quadstep.numbers import Table, flatten, rebuild, where
from quadstep.vehicle.state import State

Progress = Callable[[int], None]
"""Told how many ticks were flown since the last call."""


def fly_floats(loop: Loop, parameters: Parameters, start: State, ticks: Ticks, progress: Progress | None = None) -> FlightLog:
    """One flight on Python floats."""
    rows: list[list[float]] = []
    cycle, code, tick = loop.start(start, parameters), 0.0, 0
    for tick in range(ticks.last + 1):
        t = tick * ticks.step
        try:
            if tick % ticks.control == 0:
                command, memory, code = loop.sample(cycle, parameters, t, ticks.step * ticks.control)
                if code:
                    break
                cycle = Cycle(cycle.state, memory, command)
            if tick % ticks.log == 0:
                rows.append(log_row(loop, parameters, cycle, t))
            if tick < ticks.last:
                cycle = cycle._replace(state=loop.advance(cycle, parameters, ticks.step))
        except (ArithmeticError, ValueError):  # what floats raise where other numbers give inf or NaN
            code = float(Outcome.NOT_FINITE)
            break
        if progress and tick % 500 == 499:
            progress(500)
    return finished(np.array(rows).reshape(-1, len(COLUMNS)), code, tick, ticks, cycle)


def fly_arrays(loop: Loop, parameters: Sequence[Parameters], starts: Sequence[State], ticks: Ticks) -> list[FlightLog]:
    """A batch of flights on NumPy arrays, one flight an element. Tables (paths) must be shared by all flights."""
    count = len(parameters)
    stacked, start = stack(parameters), stack(starts)
    cycle = loop.start(start, stacked)
    code, ended = np.zeros(count), np.full(count, ticks.last)
    log = np.empty((ticks.last // ticks.log + 1, len(COLUMNS), count))
    with np.errstate(all="ignore"):
        for tick in range(ticks.last + 1):
            t = tick * ticks.step
            if tick % ticks.control == 0:
                command, memory, fresh = loop.sample(cycle, stacked, t, ticks.step * ticks.control)
                failed = (code == 0.0) & (np.asarray(fresh) != 0.0)
                code, ended = np.where(failed, fresh, code), np.where(failed, tick, ended)
                cycle = keep(code == 0.0, Cycle(cycle.state, memory, command), cycle)
            if tick % ticks.log == 0:
                log[tick // ticks.log] = [np.broadcast_to(value, count) for value in log_row(loop, stacked, cycle, t)]
            if tick < ticks.last:
                cycle = keep(code == 0.0, cycle._replace(state=loop.advance(cycle, stacked, ticks.step)), cycle)
    return [
        finished(log[:, :, i], code[i], int(ended[i]), ticks, rebuild(cycle, iter(pick(cycle, i, count))))
        for i in range(count)
    ]


def stack(structures: Sequence[Any]) -> Any:
    """One structure of arrays from many structures of floats."""
    columns = zip(*(flatten(structure) for structure in structures), strict=True)
    leaves = (column[0] if isinstance(column[0], Table) else np.array(column, dtype=float) for column in columns)
    return rebuild(structures[0], leaves)


def keep(alive: NDArray[np.bool_], new: Cycle, old: Cycle) -> Cycle:
    """The new cycle for flights still alive, the old one for those that have ended."""
    pairs = zip(flatten(new), flatten(old), strict=True)
    return rebuild(new, (where(alive, fresh, held) for fresh, held in pairs))  # type: ignore[arg-type]


def pick(structure: Any, index: int, count: int) -> list[float]:
    """The leaves of one flight."""
    return [float(np.broadcast_to(leaf, count)[index]) for leaf in flatten(structure)]

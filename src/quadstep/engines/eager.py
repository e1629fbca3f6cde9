"""The engine without a compiler: the loop runs in Python, step by step, on floats or on NumPy arrays.

Floats fly one vehicle, for reading, debugging and teaching; arrays fly a batch by broadcasting. Same laws, same order.
"""

from collections.abc import Callable, Sequence
from typing import TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from quadstep.interfaces.closed_loop import Advance, Clock, ClosedLoop, Ticks
from quadstep.interfaces.log import FlightLog, finished
from quadstep.numbers import Table, flatten, rebuild, where

S = TypeVar("S")


def fly_floats(
    loop: ClosedLoop, parameters: object, start: tuple[object, ...], ticks: Ticks, progress: Advance | None = None
) -> FlightLog:
    rows: list[tuple[float, ...]] = []
    runs, advance = [always(task.run) for task in loop.tasks], always(loop.advance)
    row = always(lambda *given: tuple(loop.row(*given)))
    cycle, code, tick = loop.start(start, parameters), 0.0, 0
    for tick in range(ticks.last + 1):
        t = tick * ticks.step
        for run, every in zip(runs, ticks.every, strict=True):
            if tick % every == 0:
                after, code = run(cycle, parameters, Clock(t, float(tick), ticks.step * every))
                if code:
                    break
                cycle = after
        if code:
            break
        if tick % ticks.log == 0:
            rows.append(row(cycle, parameters, t))
        if tick < ticks.last:
            cycle = advance(cycle, parameters, Clock(t, float(tick), ticks.step))
        if progress and tick % 500 == 499:
            progress(500)
    return finished(loop.columns, np.array(rows).reshape(-1, len(loop.columns)), code, tick, ticks, cycle)


def always(law: Callable[..., S]) -> Callable[..., S]:
    """The law on floats, repeated on arrays of one element where floats raise and other numbers continue (1 / 0)."""

    def run(*given: object) -> S:
        try:
            return law(*given)
        except (ArithmeticError, ValueError):
            with np.errstate(all="ignore"):
                result = law(*(stack([one]) for one in given))
            return rebuild(result, iter(pick(result, 0, 1)))

    return run


def fly_arrays(
    loop: ClosedLoop, parameters: Sequence[object], starts: Sequence[tuple[object, ...]], ticks: Ticks
) -> list[FlightLog]:
    """A batch of flights on NumPy arrays, one flight per element. Tables (paths) must be shared by all flights."""
    count = len(parameters)
    stacked, start = stack(parameters), cast("tuple[object, ...]", stack(starts))
    cycle = loop.start(start, stacked)
    code, ended = np.zeros(count), np.full(count, ticks.last)
    log = np.empty((ticks.last // ticks.log + 1, len(loop.columns), count))
    with np.errstate(all="ignore"):
        for tick in range(ticks.last + 1):
            t = tick * ticks.step
            now = np.full(count, float(tick))
            for task, every in zip(loop.tasks, ticks.every, strict=True):
                if tick % every == 0:
                    after, fresh = task.run(cycle, stacked, Clock(t, now, ticks.step * every))  # type: ignore[arg-type]
                    failed = (code == 0.0) & (np.asarray(fresh) != 0.0)
                    code, ended = np.where(failed, fresh, code), np.where(failed, tick, ended)
                    cycle = keep(code == 0.0, after, cycle)
            if tick % ticks.log == 0:
                log[tick // ticks.log] = [np.broadcast_to(value, count) for value in loop.row(cycle, stacked, t)]
            if tick < ticks.last:
                after = loop.advance(cycle, stacked, Clock(t, now, ticks.step))  # type: ignore[arg-type]
                cycle = keep(code == 0.0, after, cycle)
    return [
        finished(loop.columns, log[:, :, i], code[i], int(ended[i]), ticks, rebuild(cycle, iter(pick(cycle, i, count))))
        for i in range(count)
    ]


def stack(structures: Sequence[object]) -> object:
    """One structure of arrays from many structures of floats."""
    columns = zip(*(flatten(structure) for structure in structures), strict=True)
    leaves = (column[0] if isinstance(column[0], Table) else np.array(column, dtype=float) for column in columns)
    return rebuild(structures[0], leaves)


def keep(alive: NDArray[np.bool_], new: object, old: object) -> object:
    """The new cycle for flights still alive, the old one for those that have ended."""
    pairs = zip(flatten(new), flatten(old), strict=True)
    return rebuild(new, (where(alive, fresh, held) for fresh, held in pairs))  # type: ignore[arg-type]


def pick(structure: object, index: int, count: int) -> list[float]:
    return [float(np.broadcast_to(leaf, count)[index]) for leaf in flatten(structure)]

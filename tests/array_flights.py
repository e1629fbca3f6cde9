"""A batch of flights on NumPy arrays, by broadcasting: the loop once more, to compare what the engines make of it."""

from collections.abc import Sequence
from typing import cast

import numpy as np
from numpy.typing import NDArray

from quadstep.engines.eager import stack
from quadstep.interfaces.closed_loop import Clock, ClosedLoop, Ticks
from quadstep.interfaces.log import FlightLog, finished
from quadstep.numbers import flatten, rebuild, where


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
    last = [np.broadcast_to(leaf, count).astype(float).tolist() for leaf in flatten(cycle)]
    return [
        finished(loop.columns, log[:, :, i], code[i], int(ended[i]), ticks, rebuild(cycle, iter([leaf[i] for leaf in last])))
        for i in range(count)
    ]


def keep(alive: NDArray[np.bool_], new: object, old: object) -> object:
    """The new cycle for flights still alive, the old one for those that have ended."""
    pairs = zip(flatten(new), flatten(old), strict=True)
    return rebuild(new, (where(alive, fresh, held) for fresh, held in pairs))  # type: ignore[arg-type]

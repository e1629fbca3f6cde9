"""The engine without a compiler: the loop runs in Python, step by step, on floats, for reading, debugging and teaching."""

from collections.abc import Callable, Sequence
from typing import TypeVar

import numpy as np

from quadstep.interfaces.closed_loop import Advance, Clock, ClosedLoop, Ticks
from quadstep.interfaces.log import FlightLog, finished
from quadstep.numbers import Table, flatten, rebuild

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
            return rebuild(result, iter([float(np.broadcast_to(leaf, 1)[0]) for leaf in flatten(result)]))

    return run


def stack(structures: Sequence[object]) -> object:
    """One structure of arrays from many structures of floats."""
    columns = zip(*(flatten(structure) for structure in structures), strict=True)
    leaves = (column[0] if isinstance(column[0], Table) else np.array(column, dtype=float) for column in columns)
    return rebuild(structures[0], leaves)

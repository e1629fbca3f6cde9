"""The default engine: flights side by side in the lanes of compiled vector code, blocks of them on every core."""

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray

from quadstep.engines.kernel import Kernel, Kernels, Trace, compile_module, host_width
from quadstep.interfaces.closed_loop import Advance, ClosedLoop, Ticks
from quadstep.interfaces.log import FlightLog, finished
from quadstep.numbers import Table, flatten, in_matrix, rebuild

SLICE = 100_000
"""Ticks flown between checks for Ctrl-C and updates of the progress bar."""

KERNELS = Kernels()


def fly_lanes(
    loop: ClosedLoop,
    parameters: Sequence[object],
    starts: Sequence[tuple[object, ...]],
    ticks: Ticks,
    progress: Advance | None = None,
    double: bool = True,
) -> list[FlightLog]:
    """A batch of flights of one structure. A flight's result depends neither on the others nor on the number of cores.

    Tables (paths) and matrices (the nets' weights) must be the same in all flights.
    """
    width = host_width(double)
    numbers = np.float64 if double else np.float32
    leaves = [flatten(one) for one in parameters]
    tables = [leaf for leaf in leaves[0] if isinstance(leaf, Table)]
    shared = shared_leaves(parameters[0])
    for one in leaves[1:]:
        if any(
            is_shared and mine is not first and mine != first
            for mine, first, is_shared in zip(one, leaves[0], shared, strict=True)
        ):
            raise ValueError("flights of one batch must share their paths' tables and their nets' weights")
    kernel = prepare(loop, parameters[0], starts[0], shared, double, width)
    if progress:
        progress(0)  # compiled

    count = len(parameters)
    members = np.minimum(np.arange(-(-count // width) * width), count - 1).reshape(-1, width)  # the last fills its block
    cycles = [flatten(loop.start(start, one)) for start, one in zip(starts, parameters, strict=True)]
    varying = [[leaf for leaf, common in zip(one, shared, strict=True) if not common] for one in leaves]
    common = [leaf for leaf, is_common in zip(leaves[0], shared, strict=True) if is_common and not isinstance(leaf, Table)]

    def blocks(values: Sequence[Sequence[float]]) -> NDArray[np.floating]:
        with np.errstate(over="ignore"):  # a limit beyond the range of f32 is infinite there
            return np.ascontiguousarray(np.array(values).astype(numbers)[members].transpose(0, 2, 1))

    cycle, changing = blocks(cycles), blocks(varying)
    outcome = np.zeros((len(members), 2, width), dtype=numbers)
    outcome[:, 1] = ticks.last
    rows = np.zeros((len(members), ticks.last // ticks.log + 1, len(loop.columns), width), dtype=numbers)
    constant = np.array(common, dtype=numbers)
    table = np.concatenate([table.array for table in tables] or [np.zeros(1)]).astype(numbers)

    every = np.array(ticks.every, dtype=np.int64)

    def fly(block: int, first: int, past: int) -> None:
        buffers = (every, cycle[block], constant, changing[block], table, rows[block], outcome[block])
        kernel.fly(first, past, ticks.last, ticks.log, ticks.step, *(b.ctypes.data for b in buffers))

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for first in range(0, ticks.last + 1, SLICE):
            past = min(first + SLICE, ticks.last + 1)
            list(pool.map(lambda block: fly(block, first, past), range(len(members))))  # noqa: B023 (used at once)
            if progress:
                progress(past - first)

    def result(flight: int) -> FlightLog:
        block, lane = divmod(flight, width)
        final = rebuild(loop.start(starts[flight], parameters[flight]), iter(cycle[block, :, lane].astype(float).tolist()))
        code, ended = outcome[block, :, lane]
        return finished(loop.columns, rows[block, :, :, lane].astype(float), code, int(ended), ticks, final)

    return [result(flight) for flight in range(count)]


def shared_leaves(parameters: object) -> tuple[bool, ...]:
    """For each parameter, whether all flights read it from one place: tables and matrices (the nets' input weights).

    Everything else is kept per flight even where it agrees, so that one compiled program serves all such flights.
    """
    pairs = zip(flatten(parameters), in_matrix(parameters), strict=True)
    return tuple(entry or isinstance(leaf, Table) for leaf, entry in pairs)


def prepare(
    loop: ClosedLoop, parameters: object, start: tuple[object, ...], shared: tuple[bool, ...], double: bool, width: int
) -> Kernel:
    """The kernel for flights of this structure, traced and compiled on first request."""
    sizes = tuple(leaf.size if isinstance(leaf, Table) else 1 for leaf in flatten(parameters))
    key = (loop, sizes, shared, double, width)

    def made() -> Kernel:
        return compile_module(str(Trace(loop, parameters, start, list(shared), double, width).module), double)

    return KERNELS.get_or_make(key, made)

"""Very many flights of one structure at once, each leaving only its outcome and its score: no logs, no Python per flight.

    sweep = Sweep(loop, ticks, start, parameters, varying)   # compiled here, or taken from the cache
    swept = sweep.fly(values)                                # as often as needed; values: one row per flight

A flight's result depends on its own numbers only, to the bit: not on the batch or its order, the number of threads, which
of its numbers vary, or the processor.
"""

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from quadstep.engines.kernel import Kernel, Kernels, compile_module, host_width, structure
from quadstep.engines.loop import Numbers
from quadstep.engines.scored import Score, ScoredLoop, metrics
from quadstep.engines.sweep_trace import BUFFERS, COUNTERS, OUTCOME, SweepTrace
from quadstep.interfaces.closed_loop import Advance, Ticks
from quadstep.io.code_identity import as_it_is
from quadstep.numbers import Table, flatten, leaf_names, rebuild
from quadstep.program.emitter import SYMBOL

KERNELS = Kernels()

PORTION = 0.02
"""About how long a call into compiled code should take [s], so that Ctrl-C and the progress bar are not kept waiting."""

STEPS_A_SECOND = 1e7
"""A guess for `PORTION`; it decides nothing else."""


class SweepResults(NamedTuple):
    """Results of many flights, one element per flight.

    outcome: the `Outcome`'s number. ended: its time [s]. score: of arrays, in f64; `metrics(score)` evaluates it.
    """

    outcome: NDArray[np.int8]
    ended: NDArray[np.float64]
    score: Score

    @property
    def metrics(self) -> NDArray[np.float64]:
        """The metrics, shape (flights, metrics), in the order of `score_names`."""
        return metrics(self.score)


def joined(parts: Sequence[SweepResults]) -> SweepResults:
    """Results of one structure, one after the other."""
    scores = zip(*(flatten(part.score) for part in parts), strict=True)
    score = rebuild(parts[0].score, iter([np.concatenate(leaf) for leaf in scores]))
    return SweepResults(
        np.concatenate([part.outcome for part in parts]), np.concatenate([part.ended for part in parts]), score
    )


def places(start: tuple[object, ...], parameters: Numbers, names: Sequence[str]) -> list[int]:
    """Where the leaves of these names stand among all of a flight's: `start.position.2`, `parameters.vehicle.mass`."""
    known = number_names(start, parameters)
    return [known.index(name) for name in names]


def number_names(start: tuple[object, ...], parameters: Numbers) -> list[str]:
    """The name of every number of a flight, in order."""
    return [*leaf_names(start, "start"), *leaf_names(parameters, "parameters")]


class Batch:
    """Flights that differ in some of their numbers, given as arrays of one kind of number.

    loop, ticks: as `scored` gives them; rows are not written. start, parameters: of all flights, but for the leaves that vary.
    varying: the places of these in `flatten((start, parameters))`, see `places`; a table cannot vary. double: f64, else f32.
    """

    def __init__(
        self, loop: ScoredLoop, ticks: Ticks, start: tuple[object, ...], parameters: Numbers,
        varying: Sequence[int], double: bool = False,
    ) -> None:  # fmt: skip
        self.loop, self.ticks, self.varying, self.double = loop, ticks, tuple(varying), double
        given = flatten((start, parameters))
        check(given, self.varying)
        self.number = np.float64 if double else np.float32
        self.shape = loop.start(start, parameters).score
        self.row_count = OUTCOME + len(flatten(self.shape))
        constants = [leaf for i, leaf in enumerate(given) if i not in self.varying and not isinstance(leaf, Table)]
        self.constants = narrow(constants, self.number)
        self.tables = narrow([value for leaf in given if isinstance(leaf, Table) for value in leaf.values], self.number)
        self.every = np.array(ticks.every, dtype=np.int64)
        self.compiled(start, parameters)

    def compiled(self, start: tuple[object, ...], parameters: Numbers) -> None:
        """Called when all else is known, by those that compile the loop."""

    def rows(self, values: ArrayLike) -> NDArray[np.float64]:
        """The values in the required shape and kind."""
        rows = np.asarray(values, dtype=np.float64)
        if rows.ndim != 2 or rows.shape[1] != len(self.varying):
            raise ValueError(f"values of shape {rows.shape} do not fit {len(self.varying)} varying numbers")
        return rows

    def columns(self, rows: NDArray[np.float64], length: int) -> NDArray[np.floating]:
        """The varying numbers, one row per leaf in the order of `flatten`, the last flight repeated to fill up `length`."""
        columns = np.empty((len(self.varying), length), dtype=self.number)
        with np.errstate(over="ignore"):  # a limit beyond the range of f32 is infinite there
            columns[:, : len(rows)] = rows[:, np.argsort(self.varying)].T
        columns[:, len(rows) :] = columns[:, len(rows) - 1 : len(rows)]
        return columns

    def swept(self, results: NDArray[np.floating]) -> SweepResults:
        """Results in the order of `SweepTrace`."""
        code, ended, *score = results.astype(np.float64)
        return SweepResults(code.astype(np.int8), ended * self.ticks.step, rebuild(self.shape, iter(score)))


class Sweep(Batch):
    """A batch for the lanes of this machine."""

    def compiled(self, start: tuple[object, ...], parameters: Numbers) -> None:
        self.width = host_width(self.double)
        self.kernel = prepare(self.loop, start, parameters, frozenset(self.varying), self.double, self.width)

    def fly(self, values: ArrayLike, threads: int | None = None, progress: Advance | None = None) -> SweepResults:
        """Fly a flight for each row of values, shape (flights, len(varying)).

        threads: as many as there are cores if not given. progress: told the number of newly finished flights.
        """
        rows = self.rows(values)
        flights, length = len(rows), -(-len(rows) // self.width) * self.width
        results = np.zeros((self.row_count, length), dtype=self.number)
        columns = self.columns(rows, length)
        buffers = self.every, self.constants, columns, self.tables, results

        def run(first: int, past: int) -> int:
            # keeps the buffers: Ctrl-C while a thread starts leaves one that nobody waits for, and it still writes to them
            self.kernel.fly(first, past, length, self.ticks.last, self.ticks.step, *(one.ctypes.data for one in buffers))
            return min(past, flights) - first

        count = threads or os.cpu_count() or 1
        with ThreadPoolExecutor(count) as pool:
            for over in completed(pool, run, self.portions(length), 4 * count):
                if progress:
                    progress(over)
        return self.swept(results[:, :flights])

    def portions(self, length: int) -> Iterator[tuple[int, int]]:
        """Spans of flights, whole blocks each."""
        blocks = max(1, int(PORTION * STEPS_A_SECOND / (self.width * (self.ticks.last + 1))))
        size = blocks * self.width
        return ((first, min(first + size, length)) for first in range(0, length, size))


def completed(
    pool: ThreadPoolExecutor, run: Callable[[int, int], int], portions: Iterator[tuple[int, int]], most: int
) -> Iterator[int]:
    """The result of each portion as it finishes; at most `most` wait at a time, so that an interrupt takes effect soon."""
    waiting: set[Future[int]] = set()
    for portion in portions:
        waiting.add(pool.submit(run, *portion))
        if len(waiting) >= most:
            done, waiting = wait(waiting, return_when=FIRST_COMPLETED)
            yield from (future.result() for future in done)
    yield from (future.result() for future in wait(waiting).done)


def prepare(
    loop: ScoredLoop, start: tuple[object, ...], parameters: Numbers, varying: frozenset[int], double: bool, width: int
) -> Kernel:
    """The kernel for flights of this structure, traced and compiled on first request."""
    sizes = tuple(leaf.size if isinstance(leaf, Table) else 1 for leaf in flatten((start, parameters)))
    key = (loop, as_it_is(loop), sizes, varying, double, width)

    def made() -> Kernel:
        def written() -> str:
            trace = SweepTrace(loop, start, parameters, varying, double, width)
            if SYMBOL in trace.module.globals:  # Python must not be called for a diverged flight
                trace = SweepTrace(loop, start, parameters, varying, double, width, frozen=True)
            return str(trace.module)

        known = structure(loop, "sweep", leaf_names((start, parameters)), sizes, sorted(varying), double, width)
        return compile_module(written, double, known, "sweep", COUNTERS, BUFFERS)

    return KERNELS.get_or_make(key, made)


def check(given: Sequence[object], varying: Sequence[int]) -> None:
    wrong = [i for i in varying if not 0 <= i < len(given) or isinstance(given[i], Table)]
    if wrong or len(set(varying)) < len(varying):
        raise ValueError(f"places {sorted(varying)} of {len(given)}: each once, and no table")


def narrow(values: ArrayLike, number: type[np.floating]) -> NDArray[np.floating]:
    """An array of at least one number of the lanes' kind; what is beyond the range of f32 is infinite there."""
    with np.errstate(over="ignore"):
        array: NDArray[np.floating] = np.asarray(values, dtype=np.float64).astype(number)
    return array if array.size else np.zeros(1, dtype=number)

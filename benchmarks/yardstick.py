"""Hand-written C (`yardstick.c`, `vehicle_yardstick.c`) for the flights of a sweep, compiled when asked for."""

import ctypes
import os
import subprocess
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadstep.engines.kernel import shared_leaves
from quadstep.engines.sweep import Sweep
from quadstep.numbers import flatten, rebuild

PAPER = Path(__file__).with_suffix(".c")
COMPILER = ("cc", "-O3", "-march=native", "-fno-math-errno", "-fno-trapping-math")
STRICT = "-ffp-contract=off"
"""Every operation rounded by itself, as in the laws; without it products and sums are fused where the processor can."""

LINE = 64
"""Bytes: vectors lie on whole cache lines."""


class Flown(NamedTuple):
    """What is left of the flights, one row each. scores: code, RMS and largest error [m], largest norm of the weights. cycles:
    all that persists from step to step, in the order of `flatten`.
    """

    scores: NDArray[np.float64]
    cycles: NDArray[np.float64]


class Yardstick:
    """The flights of a sweep, laid out as the C wants them: a struct of vectors for each block of flights."""

    def __init__(
        self, source: Path, sweep: Sweep, start: Any, parameters: Any, values: NDArray[np.float64], folder: Path, fused: bool
    ) -> None:
        self.number, self.ticks = sweep.number, sweep.ticks
        library = ctypes.CDLL(str(compiled(source, folder, sweep.double, fused)))
        self.call = library.fly
        real, whole, buffer = ctypes.c_double if sweep.double else ctypes.c_float, ctypes.c_int64, ctypes.c_void_p
        self.call.argtypes, self.call.restype = [whole, whole, buffer, real, *[buffer] * 5], None
        width = library.width()
        if len(values) % width:
            raise ValueError(f"{len(values)} flights are no whole number of blocks of {width}")

        leaves = flatten((start, parameters))
        flights = np.repeat(
            np.array([np.nan if hasattr(leaf, "values") else leaf for leaf in leaves])[:, None], len(values), 1
        )
        flights[list(sweep.varying)] = values.T
        first, numbers = rebuild((start, parameters), iter(flights))
        cycle = flatten(sweep.loop.start(first, numbers).flight)[: library.cycle_of()]
        varying = [
            leaf for leaf, shared in zip(flatten(numbers), shared_leaves(parameters), strict=True) if not shared
        ]  # what all flights share: the input weights
        if len(varying) != library.numbers_of():
            raise ValueError(f"{source.name} has {library.numbers_of()} numbers of a flight, its parameters {len(varying)}")
        self.blocks = len(values) // width
        self.cycles = self._blocks([np.broadcast_to(leaf, len(values)) for leaf in cycle], width)
        self.numbers = self._blocks(varying, width)
        self.scores = aligned((self.blocks, library.score_of(), width), self.number)
        nets = (parameters.gains.force_net, parameters.gains.torque_net)
        self.weights = [np.array(flatten(net.input_weights), dtype=self.number) for net in nets]

    def _blocks(self, columns: list[NDArray[np.float64]], width: int) -> NDArray[Any]:
        result = aligned((len(columns[0]) // width, len(columns), width), self.number)
        with np.errstate(over="ignore"):  # a limit beyond the range of f32 is infinite there
            result[...] = np.array(columns).reshape(len(columns), -1, width).transpose(1, 0, 2)
        return result

    def fly(self, threads: int | None = None) -> Flown:
        """Fly all. Cycles start anew."""
        cycles = aligned(self.cycles.shape, self.number)
        cycles[...] = self.cycles
        every = np.array(self.ticks.every, dtype=np.int64)
        count = threads or os.cpu_count() or 1
        bounds = np.linspace(0, self.blocks, 4 * count + 1).astype(int).tolist()

        def part(first: int, past: int) -> None:
            buffers = [every, *self.weights, self.numbers[first:], cycles[first:], self.scores[first:]]
            if past > first:
                places = [buffer.ctypes.data for buffer in buffers]
                self.call(past - first, self.ticks.last, places[0], self.ticks.step, *places[1:])

        with ThreadPoolExecutor(count) as pool:
            list(pool.map(part, bounds[:-1], bounds[1:]))
        square, largest, _, _, norm, samples, code = by_flight(self.scores).T[:7]
        scores = np.array([code, np.sqrt(square / samples), np.sqrt(largest), np.sqrt(norm)]).T
        return Flown(scores, by_flight(cycles))


def by_flight(blocks: NDArray[Any]) -> NDArray[np.float64]:
    """One row per flight."""
    rows: NDArray[np.float64] = blocks.transpose(0, 2, 1).reshape(-1, blocks.shape[1]).astype(np.float64)
    return rows


def compiled(source: Path, folder: Path, double: bool, fused: bool) -> Path:
    """The C as a shared library. fused: whether products and sums may become one operation."""
    library = folder / f"{source.stem}{64 if double else 32}{'-fused' if fused else ''}.so"
    options = [*COMPILER, *([] if fused else [STRICT])]
    subprocess.run([*options, f"-DDOUBLE={int(double)}", "-shared", "-fPIC", source, "-o", library], check=True)
    return library


def aligned(shape: tuple[int, ...], number: Any) -> NDArray[Any]:
    """Zeros that start on a cache line."""
    size = int(np.prod(shape)) * np.dtype(number).itemsize
    raw = np.zeros(size + LINE, dtype=np.uint8)
    offset = -raw.ctypes.data % LINE
    numbers: NDArray[Any] = raw[offset : offset + size].view(number).reshape(shape)
    return numbers

"""Very many flights on a graphics processor, one thread a flight."""

import ctypes
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from quadstep.flight.closed_loop import Ticks
from quadstep.flight.cuda import Device, Memory, Module
from quadstep.flight.ptx import ptx
from quadstep.flight.scored import Scored
from quadstep.flight.sweep import Batch, Swept

THREADS = 128
"""Of a block."""

REGISTERS = 168
"""Of a thread at most, in f32: as many as let three blocks live on one processor."""

PORTION = 1 << 20
"""Flights of one launch."""


class GpuSweep(Batch):
    """As `Sweep`, on the first graphics processor. `NoDeviceError` where there is none.

    Its numbers agree with the lanes' to round-off: it computes in another order and with other quotients.
    seconds: the time that the kernels of the last `fly` took by themselves.
    """

    def __init__(
        self,
        loop: Scored,
        ticks: Ticks,
        start: Any,
        parameters: Any,
        varying: Sequence[int],
        double: bool = False,
        registers: int | None = None,
    ) -> None:
        super().__init__(loop, ticks, start, parameters, varying, double)
        self.device = Device()
        text = ptx(loop, start, parameters, frozenset(self.varying), double, self.device.capability)
        self.module = Module(self.device, text, registers or (None if double else REGISTERS))
        self.module.fill("constants", self.constants)
        self.kernel = self.module.kernel("sweep")
        self.seconds = 0.0

    def fly(
        self, values: ArrayLike, progress: Callable[[int], None] | None = None, threads: int = THREADS, portion: int = PORTION
    ) -> Swept:
        """Fly a flight for each row of values, shape (flights, len(varying)). progress: told how many more are over."""
        rows = self.rows(values)
        results = np.zeros((self.row_count, len(rows)), dtype=self.number)
        self.seconds = 0.0
        self.device.enter()
        with Memory.holding(self.device, self.every) as every, Memory.holding(self.device, self.tables) as tables:
            for first in range(0, len(rows), portion):
                part = rows[first : first + portion]
                over = np.empty((self.row_count, len(part)), dtype=self.number)
                with (
                    Memory.holding(self.device, self.columns(part, len(part))) as varying,
                    Memory(self.device, over.nbytes) as answers,
                ):
                    numbers = [ctypes.c_int64(len(part)), ctypes.c_int64(self.ticks.last), self.step()]
                    buffers = [every.address, varying.address, tables.address, answers.address]
                    self.seconds += self.kernel.run(-(-len(part) // threads), threads, *numbers, *buffers)
                    answers.read(over)
                results[:, first : first + portion] = over
                if progress:
                    progress(len(part))
        return self.swept(results)

    def step(self) -> ctypes.c_double | ctypes.c_float:
        """The integrator's step as the kernel takes it."""
        return ctypes.c_double(self.ticks.step) if self.double else ctypes.c_float(self.ticks.step)

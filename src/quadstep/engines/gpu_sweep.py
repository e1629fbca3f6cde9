"""Very many flights on a graphics processor, one thread a flight: PTX, the assembly language of NVIDIA's, generated
by LLVM without CUDA.
"""

import ctypes
import math
from collections.abc import Sequence
from contextlib import ExitStack
from functools import lru_cache

import numpy as np
from llvmlite import binding as llvm
from numpy.typing import ArrayLike, NDArray

from quadstep.engines import kernel
from quadstep.engines.cuda import PROCESSORS, Device, DeviceKernel, Memory, Module, NoDeviceError, OutOfDeviceMemoryError
from quadstep.engines.loop import Numbers
from quadstep.engines.scored import ScoredLoop
from quadstep.engines.sweep import Batch, SweepResults
from quadstep.engines.sweep_trace import Generate, SweepTrace
from quadstep.interfaces.closed_loop import Advance, Ticks
from quadstep.io.errors import UserError
from quadstep.program.emitter import SYMBOL

TRIPLE = "nvptx64-nvidia-cuda"
NEWEST = 90
"""PTX of this architecture (times ten) runs on it and all later ones."""

OLDEST = 70
FEATURES = "+ptx78"

OPTIONS = ("-nvptx-prec-divf32=2", "-nvptx-prec-sqrtf32=1")
"""Quotients and roots rounded as in IEEE 754, in f32 too: the same bits as on the lanes of any processor."""

SCHEDULER = "-pre-RA-sched=default"
"""This machine's own code uses another setting, and the option is global in LLVM; here that would cost registers."""


@lru_cache(maxsize=1)
def prepare() -> llvm.Target:
    """LLVM ready to write PTX. Raises ValueError if it was built without."""
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    try:
        target = llvm.Target.from_triple(TRIPLE)
    except RuntimeError as error:
        raise ValueError("this LLVM cannot write PTX") from error
    for option in OPTIONS:
        llvm.set_option("", option)
    return target


def ptx(
    loop: ScoredLoop, start: tuple[object, ...], parameters: Numbers, varying: frozenset[int], double: bool = False,
    architecture: int = NEWEST, generate: Generate | None = None,
) -> str:  # fmt: skip
    """PTX of a kernel `sweep`, see `SweepTrace`. architecture: compute capability times ten, 90 for 9.0."""
    if architecture < OLDEST:
        raise NoDeviceError(f"compute capability {architecture / 10}: {OLDEST / 10} or later is needed")
    return assembly(program(loop, start, parameters, varying, double, generate), architecture)


def program(
    loop: ScoredLoop, start: tuple[object, ...], parameters: Numbers, varying: frozenset[int], double: bool = False,
    generate: Generate | None = None,
) -> str:  # fmt: skip
    """The kernel as LLVM text, not yet optimised."""
    trace = SweepTrace(loop, start, parameters, varying, double, 1, gpu=True, generate=generate)
    if SYMBOL in trace.module.globals:
        raise UserError("a controller that calls Python cannot fly on a graphics processor")
    trace.function.calling_convention = "ptx_kernel"
    trace.module.triple = TRIPLE
    return str(trace.module)


def assembly(text: str, architecture: int = NEWEST) -> str:
    machine = prepare().create_target_machine(cpu=f"sm_{min(architecture, NEWEST)}", features=FEATURES, opt=3)
    module = kernel.verified(text, machine)
    llvm.set_option("", SCHEDULER)
    try:
        written: str = machine.emit_assembly(module)
    finally:
        kernel.host.cache_clear()  # it sets its own option again
    return written


SECONDS = 0.5
"""Target duration of a launch [s]; no launch can be shorter than one flight."""

SHARE = 0.8
"""Share of the free memory that a launch may take."""


class Portions:
    """The size of the next launch.

    A wave, as many flights as run at once, comes first; its duration determines how many whole waves come next. Each
    flight is a thread of its own, so its numbers do not depend on any of this.

    fixed: flights per launch instead, if that many fit into memory.
    """

    def __init__(
        self, device: Device, kernel: DeviceKernel, threads: int, bytes_a_flight: int, fixed: int | None = None
    ) -> None:
        self.threads, self.fixed = threads, fixed
        self.wave = device.attribute(PROCESSORS) * max(1, kernel.resident_blocks(threads)) * threads
        self.most = max(threads, int(SHARE * device.free_memory()) // bytes_a_flight)
        self.size = min(fixed or self.wave, self.most)

    def took(self, flights: int, seconds: float) -> None:
        """Learn from a launch that went well."""
        if not self.fixed:
            waves = math.floor(SECONDS * flights / max(seconds, 1e-9) / self.wave)
            self.size = min(max(1, waves) * self.wave, self.most)

    def smaller(self) -> bool:
        """Half as many from now on, because others use the memory; returns whether that is possible."""
        self.most = min(self.size, self.most) // 2
        self.size = self.most
        return self.most >= self.threads


THREADS = 128
"""Threads of a block."""

REGISTERS = 168
"""Most registers of a thread, in f32: as many as let three blocks share a processor. The paper's loop then has 40 bytes in
local memory; with 200 registers none, but two blocks, and flies 12 % slower on an H200.
"""

MOST_FLIGHTS = 2**32
"""Number of possible flight numbers."""


class GpuSweep(Batch):
    """Like `Sweep`, on the first graphics processor. Raises `NoDeviceError` if there is none, `CudaError` if it fails.

    Its results equal those of the lanes to the bit.

    generate: a law that gives the varying numbers of the flight high * 65536 + low from these two numbers, in the order of
    their places; they are then drawn on the processor, see `generated`, else passed to `fly`.
    seconds: the time that the kernels of the last call took by themselves.
    """

    def __init__(
        self, loop: ScoredLoop, ticks: Ticks, start: tuple[object, ...], parameters: Numbers,
        varying: Sequence[int], double: bool = False, registers: int | None = None,
        generate: Generate | None = None,
    ) -> None:  # fmt: skip
        super().__init__(loop, ticks, start, parameters, varying, double)
        self.device, self.generates = Device(), generate is not None
        text = ptx(loop, start, parameters, frozenset(self.varying), double, self.device.capability, generate)
        with self.device:
            self.module = Module(self.device, text, registers or (None if double else REGISTERS))
            self.module.fill("constants", self.constants)
            self.kernel = self.module.kernel("sweep")
        self.seconds = 0.0

    def fly(
        self, values: ArrayLike, progress: Advance | None = None, threads: int = THREADS,
        portion: int | None = None,
    ) -> SweepResults:  # fmt: skip
        """Fly a flight for each row of values, shape (flights, len(varying)).

        progress: called with the number of newly finished flights. threads: per block. portion: flights per launch.
        """
        if self.generates:
            raise ValueError("these flights draw their own numbers: `generated` flies them")
        rows = self.rows(values)
        return self.swept(self._flown(0, len(rows), rows, progress, threads, portion))

    def generated(
        self, first: int, past: int, progress: Advance | None = None, threads: int = THREADS,
        portion: int | None = None,
    ) -> tuple[SweepResults, NDArray[np.float64]]:  # fmt: skip
        """Fly the flights of these numbers with the values that `generate` draws; returns those too, as rows for `fly`."""
        if not self.generates:
            raise ValueError("nothing generates these flights' numbers: give `generate`, or fly rows of values")
        if not 0 <= first <= past <= MOST_FLIGHTS:
            raise ValueError(f"flights {first} to {past}: their numbers are from 0 to 2^32 - 1")
        results = self._flown(first, past - first, None, progress, threads, portion)
        drawn = results[self.row_count :][np.argsort(np.argsort(self.varying))]
        return self.swept(results[: self.row_count]), drawn.T.astype(np.float64)

    def _flown(
        self, first: int, flights: int, rows: NDArray[np.float64] | None, progress: Advance | None,
        threads: int, portion: int | None,
    ) -> NDArray[np.floating]:  # fmt: skip
        """Results in the order of `SweepTrace`, launch by launch."""
        results = np.zeros((self.row_count + (len(self.varying) if self.generates else 0), flights), dtype=self.number)
        bytes_a_flight = (self.row_count + len(self.varying)) * results.itemsize
        self.seconds, done = 0.0, 0
        with self.device, Memory.holding(self.device, self.every) as every, Memory.holding(self.device, self.tables) as tables:
            portions = Portions(self.device, self.kernel, threads, bytes_a_flight, portion)
            while done < flights:
                past = min(done + portions.size, flights)
                given = None if rows is None else self.columns(rows[done:past], past - done)
                try:
                    over, seconds = self._launch(first + done, past - done, given, (every, tables), threads)
                except OutOfDeviceMemoryError:
                    if not portions.smaller():
                        raise
                    continue
                results[:, done:past] = over
                portions.took(past - done, seconds)
                self.seconds += seconds
                if progress:
                    progress(past - done)
                done = past
        return results

    def _launch(
        self, first: int, flights: int, given: NDArray[np.floating] | None, common: tuple[Memory, Memory], threads: int
    ) -> tuple[NDArray[np.floating], float]:
        """The results of one launch and the seconds it took; the kernel's arguments are as `SweepTrace` has them."""
        over = np.empty((self.row_count + (len(self.varying) if given is None else 0), flights), dtype=self.number)
        every, tables = common
        counters = [flights, self.ticks.last] if given is not None else [first, flights, self.ticks.last]
        step = ctypes.c_double(self.ticks.step) if self.double else ctypes.c_float(self.ticks.step)
        with ExitStack() as stack:
            varying = [] if given is None else [stack.enter_context(Memory.holding(self.device, given))]
            results = stack.enter_context(Memory(self.device, over.nbytes))
            buffers = [memory.address for memory in (every, *varying, tables, results)]
            arguments = [*map(ctypes.c_int64, counters), step, *buffers]
            seconds = self.kernel.run(-(-flights // threads), threads, *arguments)
            results.read(over)
        return over, seconds

"""A traced loop as machine code of this computer, and the default engine, which runs it: flights side
by side in the lanes of compiled vector code, blocks of them on every core.
"""

import ctypes
import os
from collections import OrderedDict
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import llvmlite
import numpy as np
from llvmlite import binding as llvm
from llvmlite.binding.newpassmanagers import NewPassManager
from numpy.typing import NDArray

from quadstep.engines.flight_trace import BUFFERS, COUNTERS, Trace
from quadstep.interfaces.closed_loop import Advance, ClosedLoop, Ticks
from quadstep.interfaces.log import FlightLog, finished
from quadstep.io import code_cache
from quadstep.io.code_identity import as_it_is, described, in_memory
from quadstep.io.errors import UserError, unknown_name
from quadstep.io.parts import source_digest
from quadstep.numbers import Table, flatten, in_matrix, leaf_names, rebuild
from quadstep.program.emitter import SYMBOL

SCHEDULER = "-pre-RA-sched=list-ilp"
"""Instructions scheduled so that independent ones are adjacent: a tenth to a fifth more steps per second (AVX2). On x86
only: on ARM it crashes LLVM 22.
"""

DIRECTION = "-misched-prera-direction=topdown"
"""And once more before register allocation, from the first instruction down: another tenth, whatever the loop."""


@dataclass(frozen=True)
class Kernel:
    """Compiled code. fly: a C function as described in `Trace` or `SweepTrace`; engine: keeps it in memory."""

    engine: llvm.ExecutionEngine
    fly: Callable[..., None]


WIDTHS = {"x86-64": 2, "nehalem": 2, "haswell": 4, "skylake-avx512": 8, "znver4": 8}
"""Processors that $QUADSTEP_CPU may name (LLVM ends the process for a name that it does not know), and how many f64 numbers
a vector register of each holds.
"""


class Processor(NamedTuple):
    """The target of generated code. name, features: LLVM's, empty features for the name's default; doubles: numbers in f64
    that a vector register holds.
    """

    name: str
    features: str
    doubles: int


@lru_cache(maxsize=1)
def host() -> Processor:
    """The processor of this machine, or the one that $QUADSTEP_CPU names; prepares LLVM for it. Raises UserError.

    A flight has the same bits for any of them. Instructions that this machine lacks end the process.
    """
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    native = llvm.Target.from_default_triple().name.startswith("x86")
    if native:
        for option in (SCHEDULER, DIRECTION):
            llvm.set_option("", option)
    chosen = os.environ.get("QUADSTEP_CPU")
    if chosen:
        if not native or chosen not in WIDTHS:
            raise UserError(f"QUADSTEP_CPU: {unknown_name('processor', chosen, WIDTHS if native else ())}")
        return Processor(chosen, "", WIDTHS[chosen])
    features = llvm.get_host_cpu_features().flatten()
    return Processor(llvm.get_host_cpu_name(), features, 8 if "+avx512f" in features else 4 if "+avx," in features else 2)


def host_width(double: bool) -> int:
    """Numbers in one vector register of that processor."""
    return host().doubles * (1 if double else 2)


def compile_module(
    written: Callable[[], str], double: bool, known: str = "", name: str = "fly",
    counters: Sequence[str] = COUNTERS, buffers: Sequence[str] = BUFFERS,
) -> Kernel:  # fmt: skip
    """Machine code of an LLVM module that defines a function of this name as `Trace` or `SweepTrace` writes it. It runs
    without the interpreter's lock. known: as in `machine_code`.
    """
    engine, number = machine_code(written, known), ctypes.c_double if double else ctypes.c_float
    kinds: Sequence[Any] = [*[ctypes.c_int64] * len(counters), number, *[ctypes.c_void_p] * (1 + len(buffers))]
    return Kernel(engine, ctypes.CFUNCTYPE(None, *kinds)(engine.get_function_address(name)))


def optimised() -> bool:
    """Whether code is: unless $QUADSTEP_OPTIMISE is 0, for short flights such as those of tests. Then it is compiled in a
    fifth of the time and flies at about half the speed, with the same bits. Raises UserError.
    """
    chosen = os.environ.get("QUADSTEP_OPTIMISE", "1")
    if chosen not in ("0", "1"):
        raise UserError(f"QUADSTEP_OPTIMISE: {unknown_name('value', chosen, ('0', '1'))}")
    return chosen == "1"


def structure(loop: ClosedLoop, *rest: object) -> str:
    """What decides the text of a loop's module, with the package's code; nothing where only the text itself tells. rest: what
    decides it besides, as text tells it.
    """
    said, package = described(loop), in_memory()
    return f"{source_digest()} {package} {said} {rest}" if said and package else ""


def machine_code(written: Callable[[], str], known: str) -> llvm.ExecutionEngine:
    """An LLVM module compiled and in memory; taken from the cache if it was compiled before. Raises UserError.

    written: writes it. known: what decides its text (`structure`), by which code is found without writing it, as that takes
    longer than all else; "" to look for the text.
    """
    cpu, features, _ = host()
    level = 3 if optimised() else 0
    target = llvm.Target.from_default_triple().create_target_machine(cpu=cpu, features=features, opt=level, jit=True)
    compiler = cpu, features, llvmlite.__version__, target.triple, SCHEDULER, DIRECTION, str(level)
    place = code_cache.key("place", known, *compiler) if known else ""
    name = (code_cache.read(place) or b"").decode() if place else ""
    code = code_cache.read(name) if name else None
    if code is None:
        text = written()
        name = code_cache.key(text, *compiler)
        code = code_cache.read(name)
        if code is None:
            code = object_code(text, target, level)
            code_cache.write(name, code)
        if place and SYMBOL not in text:  # writing it lets such code find Python
            code_cache.write(place, name.encode())
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), target)
    engine.add_object_file(llvm.ObjectFileRef.from_data(code))
    engine.finalize_object()
    return engine


def object_code(text: str, target: llvm.TargetMachine, level: int = 3) -> bytes:
    """An LLVM module as an object file of this kind of machine, optimised without a change to any result; at level 0 not."""
    return target.emit_object(verified(text, target, level))


def verified(text: str, target: llvm.TargetMachine, level: int = 3) -> llvm.ModuleRef:
    """An LLVM module, parsed and verified; after the passes that gain speed here, but at level 0."""
    module = llvm.parse_assembly(text)
    module.verify()
    if not level:
        return module
    tuning = llvm.create_pipeline_tuning_options(speed_level=2)
    tuning.loop_unrolling = tuning.slp_vectorization = tuning.loop_vectorization = False
    builder = llvm.create_pass_builder(target, tuning)
    passes = builder.getModulePassManager()
    passes.run(module, builder)
    # Closing them frees nothing (llvmlite 0.50 inherits `_dispose` from the wrong base): 9 MB for each law compiled.
    NewPassManager._dispose(passes)
    passes.detach()
    return module


MOST = 64


class Kernels(OrderedDict[object, Kernel]):
    """Kernels by a key that determines their code, the most recently used one last."""

    def get_or_make(self, key: object, make: Callable[[], Kernel]) -> Kernel:
        """The kernel of this key, made on first request; the least recently used one is dropped to make room."""
        kernel = self.pop(key, None) or make()
        self[key] = kernel
        if len(self) > MOST:
            self.popitem(last=False)
        return kernel


SLICE = 100_000
"""Ticks flown between checks for Ctrl-C and updates of the progress bar."""

KERNELS = Kernels()


def fly_lanes(
    loop: ClosedLoop, parameters: Sequence[object], starts: Sequence[tuple[object, ...]], ticks: Ticks,
    progress: Advance | None = None, double: bool = True,
) -> list[FlightLog]:  # fmt: skip
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
    key = (loop, as_it_is(loop), sizes, shared, double, width)

    def made() -> Kernel:
        known = structure(loop, "flight", leaf_names((parameters, start)), sizes, shared, double, width)
        return compile_module(lambda: str(Trace(loop, parameters, start, list(shared), double, width).module), double, known)

    return KERNELS.get_or_make(key, made)

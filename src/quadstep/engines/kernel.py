"""A traced loop as machine code of this computer."""

import ctypes
import os
from collections import OrderedDict
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple, cast

import llvmlite
from llvmlite import binding as llvm
from llvmlite import ir
from llvmlite.binding.newpassmanagers import NewPassManager

from quadstep.engines import sweep_trace
from quadstep.engines.ticking import INDEX, Ticking
from quadstep.interfaces.closed_loop import ClosedLoop
from quadstep.io import code_cache
from quadstep.io.errors import UserError, unknown_name
from quadstep.numbers import Number, Table, flatten
from quadstep.program.recorded import RecordedNumber

COUNTERS = ("first", "past", "final", "log")
BUFFERS = ("cycle", "shared", "varying", "tables", "rows", "outcome")


class Trace(Ticking):
    """One module with one function,

    fly(first, past, final, log, step, every*, cycle*, shared*, varying*, tables*, rows*, outcome*),

    which flies one block of `width` flights through the ticks from `first` up to `past`, advancing the vehicle before tick
    `final` only. every: for each task, the ticks from one run to the next. cycle, varying and
    outcome (code, tick) are arrays of vectors, one entry a flight, the first and last updated; shared and tables hold what
    all flights read; a row is written to rows every `log` ticks.
    """

    def __init__(
        self, loop: ClosedLoop, parameters: object, start: tuple[object, ...], shared: list[bool], double: bool, width: int
    ):
        kinds = {**dict.fromkeys(COUNTERS, INDEX), "step": ir.DoubleType() if double else ir.FloatType()}
        super().__init__("fly", double, width, {**kinds, "every": INDEX.as_pointer(), **dict.fromkeys(BUFFERS)})
        self.loop = loop
        self.first, self.past, self.final = (self.argument[name] for name in COUNTERS[:3])
        tables = (isinstance(leaf, Table) for leaf in flatten(parameters))
        self.parameters = self.leaves(
            parameters,
            ["tables" if table else "shared" if common else "varying" for table, common in zip(tables, shared, strict=True)],
        )
        shape = loop.start(start, parameters)
        count = len(flatten(shape))
        self.hold = [True] * count
        self.live(shape, self._loaded("cycle", count), self._loaded("outcome", 2))
        self.fly(self.argument["step"], self.argument["every"], self._log)
        self.save("cycle", self.cycle)
        self.save("outcome", [self.code, self.ended])
        self.builder.ret_void()

    def address(self, buffer: str, place: ir.Value) -> ir.Value:
        return self.vector_at(buffer, self.builder.mul(place, INDEX(self.emitter.width)))

    def _loaded(self, buffer: str, count: int) -> list[ir.Value]:
        return [self.builder.load(self.address(buffer, INDEX(place)), align=self.align) for place in range(count)]

    def _log(self, tick: ir.Value, time: RecordedNumber) -> None:
        """A row, if one is due."""
        builder, every = self.builder, self.argument["log"]

        def write() -> None:
            row = builder.mul(builder.udiv(tick, every), INDEX(len(self.loop.columns)))
            for place, number in enumerate(self.loop.row(self.current(), self.parameters, cast(Number, time))):
                address = self.address("rows", builder.add(row, INDEX(place)))
                builder.store(self.emitter.value(number), address, align=self.align)

        self.when(builder.icmp_unsigned("==", builder.urem(tick, every), INDEX(0)), "logging", write)


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


def compile_module(text: str, double: bool) -> Kernel:
    """Machine code of an LLVM module that defines `fly`, as `Trace` writes it."""
    engine = machine_code(text)
    return Kernel(engine, function(engine, "fly", len(COUNTERS), double, 1 + len(BUFFERS)))


def compile_sweep(text: str, double: bool) -> Kernel:
    """Machine code of an LLVM module that defines `sweep`, as `SweepTrace` writes it."""
    engine = machine_code(text)
    counters, buffers = len(sweep_trace.COUNTERS), 1 + len(sweep_trace.BUFFERS)
    return Kernel(engine, function(engine, "sweep", counters, double, buffers))


def function(engine: llvm.ExecutionEngine, name: str, counters: int, double: bool, buffers: int) -> Callable[..., None]:
    """A compiled function of some counters, a number and some addresses; it runs without the interpreter's lock."""
    number = ctypes.c_double if double else ctypes.c_float
    kinds: Sequence[Any] = [ctypes.c_int64] * counters + [number] + [ctypes.c_void_p] * buffers
    compiled: Callable[..., None] = ctypes.CFUNCTYPE(None, *kinds)(engine.get_function_address(name))
    return compiled


def optimised() -> bool:
    """Whether code is: unless $QUADSTEP_OPTIMISE is 0, for short flights such as those of tests. Then it is compiled in a
    fifth of the time and flies at about half the speed, with the same bits. Raises UserError.
    """
    chosen = os.environ.get("QUADSTEP_OPTIMISE", "1")
    if chosen not in ("0", "1"):
        raise UserError(f"QUADSTEP_OPTIMISE: {unknown_name('value', chosen, ('0', '1'))}")
    return chosen == "1"


def machine_code(text: str) -> llvm.ExecutionEngine:
    """An LLVM module compiled and in memory; taken from the cache if it was compiled before. Raises UserError."""
    cpu, features, _ = host()
    level = 3 if optimised() else 0
    target = llvm.Target.from_default_triple().create_target_machine(cpu=cpu, features=features, opt=level, jit=True)
    name = code_cache.key(text, cpu, features, llvmlite.__version__, target.triple, SCHEDULER, DIRECTION, str(level))
    code = code_cache.read(name)
    if code is None:
        code = object_code(text, target, level)
        code_cache.write(name, code)
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), target)
    engine.add_object_file(llvm.ObjectFileRef.from_data(code))
    engine.finalize_object()
    return engine


def object_code(text: str, target: llvm.TargetMachine, level: int = 3) -> bytes:
    """An LLVM module as an object file of this kind of machine, optimised without a change to any result; at level 0 not."""
    code: bytes = target.emit_object(verified(text, target, level))
    return code


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

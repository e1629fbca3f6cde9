"""Very many flights without a log as LLVM instructions: for the lanes of this machine, or a thread of a graphics processor."""

from collections.abc import Callable, Sequence
from typing import TypeAlias, cast

from llvmlite import ir

from quadstep.engines.loop import Numbers
from quadstep.engines.scored import ScoredLoop
from quadstep.engines.ticking import INDEX, Ticking
from quadstep.numbers import Number, Table, flatten, leaf_names
from quadstep.numbers.functions import number
from quadstep.numbers.kinds import Word
from quadstep.program.emitter import Emitter
from quadstep.program.instructions import WHOLE
from quadstep.program.recorded import RecordedWord

COUNTERS = ("first", "past", "count", "last")
BUFFERS = ("constants", "varying", "tables", "results")

CONSTANT_MEMORY = 4
"""Its address space on a graphics processor."""

OUTCOME = 2
"""Results before the score: the outcome's code and its tick."""

Generate: TypeAlias = Callable[[Number, Number], Sequence[Number]]
"""The varying numbers, in the order of their places, of the flight high * 65536 + low: a law over these two numbers."""


class SweepTrace(Ticking):
    """One module with one function,

    sweep(first, past, count, last, step, every*, constants*, varying*, tables*, results*),

    which flies the flights from `first` up to `past`, a multiple of `width` of them, of a batch of `count`, each to tick
    `last`. constants and tables hold what all flights read, varying and results one row of `count` numbers a leaf: of those
    that differ from flight to flight; of code, tick and the score. The cycle before the first tick is made here too.

    frozen: whether an ended flight's cycle is held; else only its score is, and the laws continue with whatever they compute
    for the rest.

    On a graphics processor (width 1) each thread flies the flight of its own number: no `first`, no `past`, and `constants` is
    a variable of the module. generate: there, a law for the varying numbers in place of a buffer; flights are then numbered
    from `first`, the first thread's, and the numbers drawn are written into the rows after the score.
    """

    def __init__(
        self, loop: ScoredLoop, start: tuple[object, ...], parameters: Numbers, varying: frozenset[int],
        double: bool, width: int, gpu: bool = False, frozen: bool = False, generate: Generate | None = None,
    ):  # fmt: skip
        counters = COUNTERS if not gpu else ("first", *COUNTERS[2:]) if generate else COUNTERS[2:]
        kinds = {**dict.fromkeys(counters, INDEX), "step": ir.DoubleType() if double else ir.FloatType()}
        buffers = BUFFERS if not gpu else BUFFERS[2:] if generate else BUFFERS[1:]
        super().__init__("sweep", double, width, {**kinds, "every": INDEX.as_pointer(), **dict.fromkeys(buffers)})
        self.loop, self.gpu = loop, gpu
        self.first, self.past, self.final = INDEX(0), self.builder.add(self.argument["last"], INDEX(1)), self.argument["last"]
        self._thread() if gpu else self._next_block()
        given = (start, parameters)
        if gpu:
            self._constant_memory(len(flatten(given)))
        self.drawn: list[ir.Value] = []
        if generate:
            self._draw(generate, len(varying), OUTCOME + len(flatten(loop.start(start, parameters).score)))
        homes = [
            "tables" if isinstance(leaf, Table) else "varying" if place in varying else "constants"
            for place, leaf in enumerate(flatten(given))
        ]
        start, self.parameters = self.leaves(given, homes)
        cycle = loop.start(start, self.parameters)
        summed = len(flatten(cycle.score))
        count = len(flatten(cycle))
        self.hold = [frozen or place >= count - summed for place in range(count)]
        if not gpu:
            self.shown = {at for at, name in enumerate(leaf_names(cycle)) if name.startswith("flight.command.")}
        flying, last = self.emitter.constant(0.0), self.emitter.spread(self.builder.sitofp(self.final, self.emitter.element))
        self.live(cycle, [self.emitter.value(number) for number in flatten(cycle)], [flying, last])
        self.fly(self.argument["step"], self.argument["every"])
        self.save("results", [self.code, self.ended, *self.cycle[count - summed :]])
        if gpu:
            self.builder.ret_void()
        else:
            self.builder.store(self.builder.add(self.flight, INDEX(width)), self.flights)
            self.builder.branch(self.block("next flights"))

    def _next_block(self) -> None:
        """Continue with the next flights, or return."""
        self.flights = self.variable(self.argument["first"])
        self.goto("next flights")
        self.flight = self.builder.load(self.flights)
        more = self.builder.icmp_unsigned("<", self.flight, self.argument["past"])
        self.branch(more, "flights", "all flown")
        self.enter("all flown")
        self.builder.ret_void()
        self.enter("flights")

    def _thread(self) -> None:
        """The flight of this thread; return if there is none."""
        block, size, thread = (self._register(name) for name in ("ctaid.x", "ntid.x", "tid.x"))
        self.flight = self.builder.add(self.builder.mul(block, size), thread)
        self.branch(self.builder.icmp_unsigned("<", self.flight, self.argument["count"]), "flight", "no flight")
        self.enter("no flight")
        self.builder.ret_void()
        self.enter("flight")

    def _draw(self, generate: Generate, count: int, row: int) -> None:
        """Draw the flight's varying numbers: written into the results from this row on and kept for `address`.

        In f64 whatever the flight's precision, and rounded, as in `draws.draw`.
        """
        emitter = Emitter(self.builder, ir.DoubleType(), self.emitter.width)
        index = self.builder.trunc(self.builder.add(self.argument["first"], self.flight), WHOLE)
        flight = cast(Word, RecordedWord(emitter, index))
        values = generate(number(flight >> 16), number(flight & 0xFFFF))
        if len(values) != count:
            raise ValueError(f"{len(values)} numbers generated for {count} that vary")
        drawn = [emitter.value(value) for value in values]
        if not self.emitter.precise:
            drawn = [self.builder.fptrunc(value, self.emitter.vector) for value in drawn]
        self.drawn = [self.variable(value) for value in drawn]
        for place, slot in enumerate(self.drawn, row):
            self.builder.store(self.builder.load(slot), self.address("results", INDEX(place)), align=self.align)

    def _constant_memory(self, size: int) -> None:
        """Constant memory, into which the host puts what all flights read: access is as fast as to a register."""
        kind = ir.ArrayType(self.emitter.element, size)
        self.constants = ir.GlobalVariable(self.module, kind, "constants", CONSTANT_MEMORY)
        self.constants.initializer = ir.Constant(kind, None)

    def common(self, buffer: str, place: ir.Value) -> ir.Value:
        """The address of a constant; a graphics processor has separate memory for constants."""
        if self.gpu and buffer == "constants":
            return self.builder.gep(self.constants, [INDEX(0), place])
        return super().common(buffer, place)

    def _register(self, name: str) -> ir.Value:
        kind = ir.FunctionType(ir.IntType(32), [])
        read = ir.Function(self.module, kind, f"llvm.nvvm.read.ptx.sreg.{name}")
        return self.builder.zext(self.builder.call(read, []), INDEX)

    def address(self, buffer: str, place: ir.Value) -> ir.Value:
        """A row of `count` numbers for each place."""
        if buffer == "varying" and self.drawn:
            return self.drawn[place.constant]
        return self.vector_at(buffer, self.builder.add(self.builder.mul(place, self.argument["count"]), self.flight))

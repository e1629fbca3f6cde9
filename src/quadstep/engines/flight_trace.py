"""Logged flights as LLVM instructions: blocks of them side by side, or one from beginning to end."""

from typing import cast

from llvmlite import ir

from quadstep.engines.ticking import INDEX, Ticking
from quadstep.interfaces.closed_loop import ClosedLoop
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


class WholeFlight(Trace):
    """The same of one flight in f64 from its beginning to its end,

    fly(final, log, step, every*, parameters*, tables*, start*, rows*, outcome*).
    """

    def __init__(self, loop: ClosedLoop, parameters: object, start: tuple[object, ...]):
        kinds = {**dict.fromkeys(("final", "log"), INDEX), "step": ir.DoubleType(), "every": INDEX.as_pointer()}
        buffers = ("parameters", "tables", "start", "rows", "outcome")
        Ticking.__init__(self, "fly", True, 1, {**kinds, **dict.fromkeys(buffers)})
        self.loop = loop
        self.first, self.final = INDEX(0), self.argument["final"]
        self.past = self.builder.add(self.final, INDEX(1))
        homes = ["tables" if isinstance(leaf, Table) else "parameters" for leaf in flatten(parameters)]
        self.parameters, begin = self.leaves((parameters, start), [*homes, *["start"] * len(flatten(start))])
        cycle = loop.start(begin, self.parameters)
        self.hold = [True] * len(flatten(cycle))
        flying, last = self.emitter.constant(0.0), self.builder.sitofp(self.final, self.emitter.element)
        self.live(cycle, [self.emitter.value(number) for number in flatten(cycle)], [flying, self.emitter.spread(last)])
        self.fly(self.argument["step"], self.argument["every"], self._log)
        self.save("outcome", [self.code, self.ended])
        self.builder.ret_void()

"""The closed loop written as LLVM instructions: every law is called once with lanes, the loop around them is built here."""

from collections.abc import Callable
from typing import Any

from llvmlite import ir

from quadstep.flight.closed_loop import Clock, ClosedLoop, Task
from quadstep.numbers import Table, flatten, rebuild
from quadstep.numbers.lane import Emitter, Lane, LaneTable
from quadstep.numbers.lane_functions import LaneFunctions

INDEX = ir.IntType(64)
COUNTERS = ("first", "past", "final", "log")
BUFFERS = ("cycle", "shared", "varying", "tables", "rows", "outcome")

Lanes = LaneFunctions()


class Trace:
    """One module with one function,

    fly(first, past, final, log, step, every*, cycle*, shared*, varying*, tables*, rows*, outcome*),

    which flies one block of `width` flights through the ticks from `first` up to `past`, advancing the vehicle before tick
    `final` only. every: for each task, the ticks from one run to the next. cycle, varying and
    outcome (code, tick) are arrays of vectors, one entry a flight, the first and last updated; shared and tables hold what
    all flights read; a row is written to rows every `log` ticks.
    """

    def __init__(self, loop: ClosedLoop, parameters: Any, start: Any, shared: list[bool], double: bool, width: int):
        self.loop = loop
        element = ir.DoubleType() if double else ir.FloatType()
        self.module = ir.Module("flight")
        kinds = [INDEX] * len(COUNTERS) + [element, INDEX.as_pointer()] + [element.as_pointer()] * len(BUFFERS)
        self.function = ir.Function(self.module, ir.FunctionType(ir.VoidType(), kinds), "fly")
        self.argument = dict(zip((*COUNTERS, "step", "every", *BUFFERS), self.function.args, strict=True))
        for name in BUFFERS:
            self.argument[name].add_attribute("noalias")
        self.blocks: dict[str, ir.Block] = {}
        self.builder = ir.IRBuilder(self.block("entry"))
        self.emitter = Emitter(self.builder, element, width)
        self.align = 8 if double else 4

        self.parameters = self._parameters(parameters, shared)
        self.shape = loop.start(start, parameters)
        self.cycle = [self._slot("cycle", place) for place in range(len(flatten(self.shape)))]
        self.code, self.ended = self._slot("outcome", 0), self._slot("outcome", 1)
        self.tick = self.builder.alloca(INDEX)
        self.builder.store(self.argument["first"], self.tick)
        self.step = self.spread(self.argument["step"])
        places = [self.builder.gep(self.argument["every"], [INDEX(place)]) for place in range(len(loop.tasks))]
        self.every = [self.builder.load(place) for place in places]
        self.periods = [self.spread(self._times_step(every)) for every in self.every]
        self._loop()

    # The loop: head -> each task? -> logging? -> moving? -> head

    def _loop(self) -> None:
        self.goto("head")
        tick = self.builder.load(self.tick)
        time, count = self.spread(self._times_step(tick)), self.spread(self.builder.uitofp(tick, self.emitter.element))
        self.branch(self.builder.icmp_unsigned("<", tick, self.argument["past"]), "running", "done")
        self.enter("running")
        for task, every, period in zip(self.loop.tasks, self.every, self.periods, strict=True):
            clock = Clock(time, count, period)
            self.when(self._due(tick, every), task.name, lambda: self._run(task, clock, count))  # noqa: B023 (used at once)
        self.when(self._due(tick, self.argument["log"]), "logging", lambda: self._log(tick, time))
        still = self.builder.icmp_unsigned("<", tick, self.argument["final"])
        self.when(still, "moving", lambda: self._move(Clock(time, count, self.step)))
        self.builder.store(self.builder.add(tick, INDEX(1)), self.tick)
        self.builder.branch(self.block("head"))
        self.enter("done")
        for name, slots in (("cycle", self.cycle), ("outcome", [self.code, self.ended])):
            for place, slot in enumerate(slots):
                self.builder.store(self.builder.load(slot), self._address(name, INDEX(place)), align=self.align)
        self.builder.ret_void()

    def _run(self, task: Task, clock: Clock, tick: Lane) -> None:
        before = self.current()
        after, code = task.run(before, self.parameters, clock)
        living = self._living()
        if not isinstance(code, Lane):  # a task that never ends a flight
            self.keep(before, after, living)
            return
        failed, survivors = living & (code != 0.0), living & (code == 0.0)
        self.store([code, tick], [self.code, self.ended], failed)
        self.keep(before, after, survivors)
        width = ir.IntType(self.emitter.width)
        anyone = self.builder.icmp_unsigned("!=", self.builder.bitcast(survivors.value, width), width(0))
        self.branch(anyone, f"{task.name}: someone flies", "done")
        self.enter(f"{task.name}: someone flies")

    def _log(self, tick: ir.Value, time: Any) -> None:
        row = self.builder.mul(self.builder.udiv(tick, self.argument["log"]), INDEX(len(self.loop.columns)))
        for place, number in enumerate(self.loop.row(self.current(), self.parameters, time)):
            address = self._address("rows", self.builder.add(row, INDEX(place)))
            self.builder.store(self.lane(number).value, address, align=self.align)

    def _move(self, clock: Clock) -> None:
        before = self.current()
        self.keep(before, self.loop.advance(before, self.parameters, clock), self._living())

    # Numbers in and out of memory

    def _parameters(self, parameters: Any, shared: list[bool]) -> Any:
        leaves: list[Any] = []
        places = {"shared": 0, "varying": 0, "tables": 0}
        for leaf, common in zip(flatten(parameters), shared, strict=True):
            name = "tables" if isinstance(leaf, Table) else "shared" if common else "varying"
            start = INDEX(places[name])
            if isinstance(leaf, Table):
                leaves.append(LaneTable(self.emitter, self.builder.gep(self.argument[name], [start]), leaf.size))
            elif common:
                leaves.append(self.spread(self.builder.load(self.builder.gep(self.argument[name], [start]))))
            else:
                leaves.append(Lane(self.emitter, self.builder.load(self._address(name, start), align=self.align)))
            places[name] += leaf.size if isinstance(leaf, Table) else 1
        return rebuild(parameters, iter(leaves))

    def current(self) -> Any:
        """The cycle as lanes."""
        return rebuild(self.shape, (Lane(self.emitter, self.builder.load(slot)) for slot in self.cycle))

    def keep(self, before: Any, after: Any, living: Any) -> None:
        """Store what has changed in the cycle where the condition holds."""
        pairs = zip(flatten(after), flatten(before), self.cycle, strict=True)
        changed = [(new, slot) for new, old, slot in pairs if not (isinstance(new, Lane) and new.value is old.value)]
        self.store([new for new, _ in changed], [slot for _, slot in changed], living)

    def store(self, numbers: list[Any], slots: list[ir.Value], living: Any) -> None:
        """Store numbers where the condition holds."""
        for number, slot in zip(numbers, slots, strict=True):
            held = Lane(self.emitter, self.builder.load(slot))
            self.builder.store(Lanes.where(living, self.lane(number), held).value, slot)

    def lane(self, number: Any) -> Lane:
        """A number, which may have folded to a constant, as a lane."""
        return number if isinstance(number, Lane) else Lane(self.emitter, self.emitter.constant(number))

    def spread(self, scalar: ir.Value) -> Any:
        """The same scalar in every lane."""
        nothing = ir.Constant(self.emitter.vector, ir.Undefined)
        one = self.builder.insert_element(nothing, scalar, ir.IntType(32)(0))
        zeros = ir.Constant(ir.VectorType(ir.IntType(32), self.emitter.width), [0] * self.emitter.width)
        return Lane(self.emitter, self.builder.shuffle_vector(one, nothing, zeros))

    def _living(self) -> Any:
        return Lane(self.emitter, self.builder.load(self.code)) == 0.0

    def _times_step(self, count: ir.Value) -> ir.Value:
        return self.builder.fmul(self.builder.uitofp(count, self.emitter.element), self.argument["step"])

    def _due(self, tick: ir.Value, every: ir.Value) -> ir.Value:
        return self.builder.icmp_unsigned("==", self.builder.urem(tick, every), INDEX(0))

    def _address(self, buffer: str, place: ir.Value) -> ir.Value:
        offset = self.builder.mul(place, INDEX(self.emitter.width))
        return self.builder.bitcast(self.builder.gep(self.argument[buffer], [offset]), self.emitter.vector.as_pointer())

    def _slot(self, buffer: str, place: int) -> ir.Value:
        """A variable of the loop, loaded from a buffer."""
        slot = self.builder.alloca(self.emitter.vector)
        self.builder.store(self.builder.load(self._address(buffer, INDEX(place)), align=self.align), slot)
        return slot

    # Blocks

    def block(self, name: str) -> ir.Block:
        """The block of this name, made when first asked for."""
        if name not in self.blocks:
            self.blocks[name] = self.function.append_basic_block(name)
        return self.blocks[name]

    def enter(self, name: str) -> None:
        """Write into a block from here on."""
        self.emitter.enter(self.block(name))

    def goto(self, name: str) -> None:
        """Branch to a block and write into it."""
        self.builder.branch(self.block(name))
        self.enter(name)

    def branch(self, condition: ir.Value, yes: str, no: str) -> None:
        """Branch on one bit."""
        self.builder.cbranch(condition, self.block(yes), self.block(no))

    def when(self, condition: ir.Value, name: str, body: Callable[[], None]) -> None:
        """Run `body` where the bit is set, then go on."""
        self.branch(condition, name, f"{name} over")
        self.enter(name)
        body()
        self.goto(f"{name} over")

"""The closed loop written as LLVM instructions: every law is called once with lanes, the loop around them is built here."""

from collections.abc import Callable
from typing import Any

from llvmlite import ir

from quadstep.flight.log import COLUMNS, log_row
from quadstep.flight.loop import Cycle, Loop, Parameters
from quadstep.numbers import Table, flatten, rebuild
from quadstep.numbers.lane import Emitter, Lane, LaneTable
from quadstep.numbers.lane_functions import LaneFunctions
from quadstep.vehicle.state import State

INDEX = ir.IntType(64)
COUNTERS = ("first", "past", "final", "control", "log")
BUFFERS = ("cycle", "shared", "varying", "tables", "rows", "outcome")

Lanes = LaneFunctions()


class Trace:
    """One module with one function,

    fly(first, past, final, control, log, step, cycle*, shared*, varying*, tables*, rows*, outcome*),

    which flies one block of `width` flights through the ticks from `first` up to `past`, stepping the vehicle before tick
    `final` only. cycle, varying and outcome (code, tick) are arrays of vectors, one entry a flight, the first and last
    updated; shared and tables hold what all flights read; a row is written to rows every `log` ticks.
    """

    def __init__(self, loop: Loop, parameters: Parameters, start: State, shared: list[bool], double: bool, width: int):
        self.loop = loop
        element = ir.DoubleType() if double else ir.FloatType()
        self.module = ir.Module("flight")
        kinds = [INDEX] * len(COUNTERS) + [element] + [element.as_pointer()] * len(BUFFERS)
        self.function = ir.Function(self.module, ir.FunctionType(ir.VoidType(), kinds), "fly")
        self.argument = dict(zip((*COUNTERS, "step", *BUFFERS), self.function.args, strict=True))
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
        self.period = self.spread(self._times_step(self.argument["control"]))
        self._loop()

    # The loop: head -> sampling? -> logging? -> moving? -> head

    def _loop(self) -> None:
        self.goto("head")
        tick = self.builder.load(self.tick)
        time = self.spread(self._times_step(tick))
        self.branch(self.builder.icmp_unsigned("<", tick, self.argument["past"]), "running", "done")
        self.enter("running")
        self.when(self._due(tick, "control"), "sampling", lambda: self._sample(tick, time))
        self.when(self._due(tick, "log"), "logging", lambda: self._log(tick, time))
        self.when(self.builder.icmp_unsigned("<", tick, self.argument["final"]), "moving", self._move)
        self.builder.store(self.builder.add(tick, INDEX(1)), self.tick)
        self.builder.branch(self.block("head"))
        self.enter("done")
        for name, slots in (("cycle", self.cycle), ("outcome", [self.code, self.ended])):
            for place, slot in enumerate(slots):
                self.builder.store(self.builder.load(slot), self._address(name, INDEX(place)), align=self.align)
        self.builder.ret_void()

    def _sample(self, tick: ir.Value, time: Any) -> None:
        cycle, living = self.current(), self._living()
        command, memory, code = self.loop.sample(cycle, self.parameters, time, self.period)
        failed = living & (self.lane(code) != 0.0)
        survivors = living & (self.lane(code) == 0.0)
        self.keep([code], [self.code], failed)
        self.keep([self.spread(self.builder.uitofp(tick, self.emitter.element))], [self.ended], failed)
        self.keep(flatten(Cycle(cycle.state, memory, command)), self.cycle, survivors)
        width = ir.IntType(self.emitter.width)
        anyone = self.builder.icmp_unsigned("!=", self.builder.bitcast(survivors.value, width), width(0))
        self.branch(anyone, "someone flies", "done")
        self.enter("someone flies")

    def _log(self, tick: ir.Value, time: Any) -> None:
        row = self.builder.mul(self.builder.udiv(tick, self.argument["log"]), INDEX(len(COLUMNS)))
        for place, number in enumerate(log_row(self.loop, self.parameters, self.current(), time)):
            address = self._address("rows", self.builder.add(row, INDEX(place)))
            self.builder.store(self.lane(number).value, address, align=self.align)

    def _move(self) -> None:
        cycle = self.current()
        moved = cycle._replace(state=self.loop.advance(cycle, self.parameters, self.step))
        self.keep(flatten(moved), self.cycle, self._living())

    # Numbers in and out of memory

    def _parameters(self, parameters: Parameters, shared: list[bool]) -> Parameters:
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

    def current(self) -> Cycle:
        """The cycle as lanes."""
        return rebuild(self.shape, (Lane(self.emitter, self.builder.load(slot)) for slot in self.cycle))

    def keep(self, numbers: list[Any], slots: list[ir.Value], living: Any) -> None:
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

    def _due(self, tick: ir.Value, every: str) -> ir.Value:
        return self.builder.icmp_unsigned("==", self.builder.urem(tick, self.argument[every]), INDEX(0))

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

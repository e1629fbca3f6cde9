"""The closed loop as LLVM instructions: every law is called once with lanes, and the loop around them is built here."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence, Set
from typing import TypeVar, cast

from llvmlite import ir

from quadstep.interfaces.closed_loop import Clock, ClosedLoop, Task
from quadstep.numbers import Number, Table, flatten, rebuild
from quadstep.program.emitter import Emitter
from quadstep.program.instructions import LoadedFrom
from quadstep.program.recorded import RECORDED, Operand, RecordedCondition, RecordedNumber, RecordedTable

INDEX = ir.IntType(64)
CACHE_LINE = 64

S = TypeVar("S")


def clock(time: RecordedNumber, tick: RecordedNumber, period: RecordedNumber) -> Clock:
    """The clock that a law sees, as lanes."""
    return Clock(*cast(tuple[Number, Number, Number], (time, tick, period)))


class Ticking(ABC):
    """A module with one function that flies `width` flights at once, tick by tick. Subclasses determine what it writes.

    hold: for each number of the cycle, whether it keeps its value from the moment its flight ends; the others go on with
    whatever the laws compute, which is cheaper. shown: the places of those that only the last task reads. They are stored, and
    so computed, where it runs before they change again.
    """

    loop: ClosedLoop
    parameters: object
    shape: object
    hold: Sequence[bool]
    shown: Set[int] = frozenset()
    first: ir.Value
    past: ir.Value
    final: ir.Value

    def __init__(self, name: str, double: bool, width: int, arguments: dict[str, ir.Type | None]) -> None:
        """arguments: name and type of each of the function's arguments; None stands for a buffer of numbers of its own."""
        element = ir.DoubleType() if double else ir.FloatType()
        self.module = ir.Module("flight")
        kinds = [kind or element.as_pointer() for kind in arguments.values()]
        self.function = ir.Function(self.module, ir.FunctionType(ir.VoidType(), kinds), name)
        if width > 1:  # align the stack to cache lines, so that a vector kept there is read in one go
            self.function.attributes.add("nounwind")  # without one of these attributes llvmlite does not write the other
            self.function.attributes.alignstack = CACHE_LINE
        self.argument = dict(zip(arguments, self.function.args, strict=True))
        for argument, kind in arguments.items():
            if kind is None:
                self.argument[argument].add_attribute("noalias")
        self.blocks: dict[str, ir.Block] = {}
        self.builder = ir.IRBuilder(self.block("entry"))
        self.emitter = Emitter(self.builder, element, width)
        self.align = 8 if double else 4

    @abstractmethod
    def address(self, buffer: str, place: ir.Value) -> ir.Value:
        """The address in a buffer of the number of this place, for all lanes consecutively."""

    # The loop: head -> each task? -> (others) -> moving? -> head; done

    def fly(self, step: ir.Value, every: ir.Value, others: Callable[[ir.Value, RecordedNumber], None] | None = None) -> None:
        """The ticks from `first` up to `past`, the vehicle moved before tick `final` only; ends in the block "done".

        every: an array, the ticks from one run of each task to the next. others: further code to emit in a tick.
        """
        builder, tasks = self.builder, self.loop.tasks
        self.step, length = step, self.wide(step)
        counter = self.variable(self.first)
        pauses = [builder.load(builder.gep(every, [INDEX(place)])) for place in range(len(tasks))]
        periods = [self.wide(self._times_step(pause)) for pause in pauses]
        dues = [self.variable(self._next_due(pause)) for pause in pauses]
        self.goto("head")
        tick = builder.load(counter)
        time, count = self.wide(self._times_step(tick)), self.wide(builder.sitofp(tick, self.emitter.element))
        self.branch(builder.icmp_unsigned("<", tick, self.past), "running", "done")
        self.enter("running")
        for place, task in enumerate(tasks):

            def run(task: Task = task, place: int = place) -> None:
                next_run = builder.add(tick, pauses[place])
                builder.store(next_run, dues[place])
                soon = builder.icmp_unsigned("<", builder.load(dues[-1]), next_run) if self.shown else None
                self._run(task, clock(time, count, periods[place]), count, soon)

            self.when(builder.icmp_unsigned("==", tick, builder.load(dues[place])), task.name, run)
        if others is not None:
            others(tick, time)
        moves = builder.icmp_unsigned("<", tick, self.final)
        self.when(moves, "moving", lambda: self._move(clock(time, count, length)))
        builder.store(builder.add(tick, INDEX(1)), counter)
        builder.branch(self.block("head"))
        self.enter("done")

    def _run(self, task: Task, clock: Clock, tick: RecordedNumber, soon: ir.Value | None) -> None:
        before = self.current()
        after, number = task.run(before, self.parameters, clock)
        code = cast(Operand, number)
        living = self._living()
        if not isinstance(code, RecordedNumber):  # a task that never ends a flight
            self.keep(before, after, living, soon)
            return
        failed, survivors = living & (code != 0.0), living & (code == 0.0)
        self.store([code, tick], [self.code, self.ended], failed)
        self.keep(before, after, survivors, soon)
        width = ir.IntType(self.emitter.width)
        anyone = self.builder.icmp_unsigned("!=", self.builder.bitcast(self.emitter.value(survivors), width), width(0))
        self.branch(anyone, f"{task.name}: someone flies", "done")
        self.enter(f"{task.name}: someone flies")

    def _move(self, clock: Clock) -> None:
        before = self.current()
        self.keep(before, self.loop.advance(before, self.parameters, clock), self._living())

    # Numbers in and out of memory

    def leaves(self, structure: S, homes: Sequence[str]) -> S:
        """A structure of lanes, each read from the buffer that `homes` names for it.

        A buffer called "varying" holds a number for each flight, any other one for all; tables are stored consecutively.
        """
        leaves: list[RecordedNumber | RecordedTable] = []
        places = dict.fromkeys(homes, 0)
        bases = {home: self.common(home, INDEX(0)) for home in places if home != "varying"}
        for leaf, home in zip(flatten(structure), homes, strict=True):
            place = INDEX(places[home])
            if home == "varying":
                leaves.append(RecordedNumber(self.emitter, self.builder.load(self.address(home, place), align=self.align)))
            else:
                pointer = self.common(home, place)
                if isinstance(leaf, Table):
                    leaves.append(RecordedTable(self.emitter, pointer, leaf.size))
                else:
                    leaves.append(self.wide(self.builder.load(pointer)))
                    self.emitter.stored[id(leaves[-1].place)] = LoadedFrom(bases[home], places[home], scalar=True)
            places[home] += leaf.size if isinstance(leaf, Table) else 1
        return rebuild(structure, iter(leaves))

    def common(self, buffer: str, place: ir.Value) -> ir.Value:
        """The address of a number that all flights read."""
        return self.builder.gep(self.argument[buffer], [place])

    def variable(self, value: ir.Value) -> ir.Value:
        """A variable of the loop that starts with this value."""
        with self.builder.goto_entry_block():
            slot = self.builder.alloca(value.type)
        self.builder.store(value, slot)
        return slot

    def live(self, shape: object, cycle: Sequence[ir.Value], outcome: Sequence[ir.Value]) -> None:
        """Set the cycle that the loop starts with, shaped as `shape`, and how its flights have ended so far: code, tick."""
        self.shape = shape
        self.cycle = [self.variable(number) for number in cycle]
        self.code, self.ended = (self.variable(number) for number in outcome)

    def current(self) -> object:
        return rebuild(self.shape, (RecordedNumber(self.emitter, self.builder.load(slot)) for slot in self.cycle))

    def keep(self, before: object, after: object, living: RecordedCondition, soon: ir.Value | None = None) -> None:
        """Store changed numbers of the cycle; those to be held, only for flights still alive.

        soon: whether the last task runs before they are changed again; else those that are shown need not be known.
        """
        shown: list[tuple[Operand, ir.Value, bool]] = []
        others: list[tuple[Operand, ir.Value, bool]] = []
        leaves = zip(flatten(after), flatten(before), self.cycle, self.hold, strict=True)
        for place, (new, old, slot, held) in enumerate(leaves):
            if not (isinstance(new, RecordedNumber) and new.place is old.place):
                (others if soon is None or place not in self.shown else shown).append((new, slot, held))
        self._put(others, living)
        if soon is not None and shown:
            self.when(soon, f"shown {len(self.blocks)}", lambda: self._put(shown, living))

    def _put(self, changed: Sequence[tuple[Operand, ir.Value, bool]], living: RecordedCondition) -> None:
        """Store numbers in their slots; those to be held, only for flights still alive."""
        for number, slot, held in changed:
            if held:
                self.store([number], [slot], living)
            else:
                self.builder.store(self.emitter.value(number), slot)

    def store(self, numbers: list[Operand], slots: list[ir.Value], living: RecordedCondition) -> None:
        """Store numbers where the condition holds."""
        for number, slot in zip(numbers, slots, strict=True):
            held = RecordedNumber(self.emitter, self.builder.load(slot))
            self.builder.store(self.emitter.value(RECORDED.where(living, self.lane(number), held)), slot)

    def save(self, buffer: str, slots: Sequence[ir.Value]) -> None:
        """Write variables into a buffer, consecutively."""
        for place, slot in enumerate(slots):
            self.builder.store(self.builder.load(slot), self.address(buffer, INDEX(place)), align=self.align)

    def lane(self, number: Operand) -> RecordedNumber:
        """A number, possibly folded to a constant, as a lane."""
        return number if isinstance(number, RecordedNumber) else RecordedNumber(self.emitter, self.emitter.constant(number))

    def wide(self, scalar: ir.Value) -> RecordedNumber:
        return RecordedNumber(self.emitter, self.emitter.spread(scalar))

    def vector_at(self, buffer: str, offset: ir.Value) -> ir.Value:
        """The address of one number per lane, `offset` numbers into a buffer."""
        return self.builder.bitcast(self.builder.gep(self.argument[buffer], [offset]), self.emitter.vector.as_pointer())

    def _living(self) -> RecordedCondition:
        return RecordedNumber(self.emitter, self.builder.load(self.code)) == 0.0

    def _times_step(self, count: ir.Value) -> ir.Value:
        return self.builder.fmul(self.builder.sitofp(count, self.emitter.element), self.step)

    def _next_due(self, every: ir.Value) -> ir.Value:
        """The first tick from `first` on that is a multiple of `every`."""
        builder, one = self.builder, INDEX(1)
        return builder.mul(builder.udiv(builder.add(self.first, builder.sub(every, one)), every), every)

    # Blocks

    def block(self, name: str) -> ir.Block:
        """The block of this name, created on first use."""
        if name not in self.blocks:
            self.blocks[name] = self.function.append_basic_block(name)
        return self.blocks[name]

    def enter(self, name: str) -> None:
        """Emit into a block from here on."""
        self.emitter.enter(self.block(name))

    def goto(self, name: str) -> None:
        """Branch to a block and emit into it."""
        self.builder.branch(self.block(name))
        self.enter(name)

    def branch(self, condition: ir.Value, yes: str, no: str) -> None:
        self.builder.cbranch(condition, self.block(yes), self.block(no))

    def when(self, condition: ir.Value, name: str, body: Callable[[], None]) -> None:
        """Run `body` if the bit is set, then continue."""
        self.branch(condition, name, f"{name} over")
        self.enter(name)
        body()
        self.goto(f"{name} over")

"""LLVM instructions with everything that a law may contain: loops, functions within, and calls of Python.

Compiled code passes the inputs of an opaque function to Python on its stack and finds the outputs there. Run such code outside
the main thread, as the engines do: Python delivers Ctrl-C to the main thread, where one that arrives while compiled code is
just calling would be reported and lost.

A scan is an LLVM loop around a step that is traced once. The carry and all rows are in memory, one vector per number. Loaded
numbers are remembered with their place, so that a matrix that is already in memory is scanned where it is: the output of
another scan, or a matrix of the flight's parameters.

A function within is a law written once and called wherever it is needed. Caller and function communicate through a frame in
memory: the law's arguments, its results, and captured values.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any, Generic, TypeVar, cast

import numpy as np
from llvmlite import binding as llvm
from llvmlite import ir

from quadstep.numbers.kinds import Number
from quadstep.numbers.scan import C, Rows, Step, answer, matrices, same_shape, shaped
from quadstep.numbers.structure import flatten, rebuild
from quadstep.numbers.vectors import Matrix, Vector
from quadstep.program.instructions import Instructions, LoadedFrom
from quadstep.program.recorded import Operand, Recorded, RecordedNumber

PLACE = ir.IntType(64)

S = TypeVar("S")
T = TypeVar("T")


class Subroutine(Generic[S, T]):
    """One law as a function from an S to a T. given: the places of its leaves; the frame holds one vector per place."""

    def __init__(self, emitter: Instructions, law: Callable[[S], T], structure: S) -> None:
        self.emitter = emitter
        module, vector = emitter.builder.module, emitter.vector
        kind = ir.FunctionType(ir.VoidType(), [vector.as_pointer()])
        self.function = ir.Function(module, kind, module.get_unique_name("law"))
        self.function.linkage = "internal"
        self.function.attributes.add("noinline")
        self.function.args[0].add_attribute("noalias")
        self.taken: dict[int, tuple[ir.Value, int, ir.Value]] = {}
        self.size = len(flatten(structure))
        with self:
            given = rebuild(structure, iter([RecordedNumber(emitter, self._load(place)) for place in range(self.size)]))
            self.given = {id(emitter.value(leaf)): place for place, leaf in enumerate(flatten(given))}
            self.result = law(given)
            self.places = [self._place(leaf) for leaf in flatten(self.result)]
            emitter.builder.ret_void()
        block = emitter.builder.block
        emitter.builder.position_at_start(block.function.entry_basic_block)  # before any value that has to be passed
        self.frame = emitter.builder.alloca(vector, size=self.size)
        emitter.builder.position_at_end(block)
        for value, place, _ in self.taken.values():
            self._hand_over(value, place)

    def __enter__(self) -> None:
        """From here on lanes write into the function."""
        emitter = self.emitter
        self.before = emitter.builder.block, emitter.known
        emitter.builder.position_at_end(self.function.append_basic_block("entry"))
        emitter.known, emitter.subroutine = {}, self

    def __exit__(self, *_: object) -> None:
        emitter = self.emitter
        block, emitter.known = self.before
        emitter.builder.position_at_end(block)
        emitter.subroutine = None

    def call(self, structure: S) -> T:
        builder, given = self.emitter.builder, flatten(structure)
        for at, number in enumerate(given):
            builder.store(self.emitter.value(number), builder.gep(self.frame, [PLACE(at)]))
        builder.call(self.function, [self.frame])
        leaves: list[object] = []
        for place, leaf in zip(self.places, flatten(self.result), strict=True):
            if place is None:
                leaves.append(leaf)
            elif place < len(given):
                leaves.append(given[place])
            else:
                leaves.append(RecordedNumber(self.emitter, builder.load(builder.gep(self.frame, [PLACE(place)]))))
        return rebuild(self.result, iter(leaves))

    def local(self, value: ir.Value) -> ir.Value:
        """A value of the caller as the function sees it, read from the frame."""
        if isinstance(value, ir.Constant) or home(value) is self.function:
            return value
        if id(value) not in self.taken:
            with self.emitter.builder.goto_entry_block():
                self.taken[id(value)] = (value, self.size, self._load(self.size, value.type))
            self.size += 1
        return self.taken[id(value)][2]

    def _place(self, number: object) -> int | None:
        """The place where the function stores a number of its result; None if it is a constant."""
        if not isinstance(number, RecordedNumber):
            return None
        if id(self.emitter.value(number)) in self.given:
            return self.given[id(self.emitter.value(number))]
        builder = self.emitter.builder
        builder.store(self.emitter.value(number), builder.gep(self.function.args[0], [PLACE(self.size)]))
        self.size += 1
        return self.size - 1

    def _load(self, place: int, kind: ir.Type | None = None) -> ir.Value:
        builder = self.emitter.builder
        address = builder.gep(self.function.args[0], [PLACE(place)])
        if kind is None or kind == self.emitter.vector:
            return builder.load(address)
        if kind == self.emitter.many(ir.IntType(1)):
            whole = builder.load(builder.bitcast(address, self.emitter.wholes.as_pointer()))
            return builder.trunc(whole, kind)
        return builder.load(builder.bitcast(address, kind.as_pointer()))

    def _hand_over(self, value: ir.Value, place: int) -> None:
        """Write a value of the caller into the frame as soon as it is known."""
        builder = self.emitter.builder
        block = builder.block
        if isinstance(value, ir.Instruction):
            builder.position_after(value)
        else:
            builder.position_after(self.frame)
        address = builder.gep(self.frame, [PLACE(place)])
        if value.type == self.emitter.many(ir.IntType(1)):
            value = builder.sext(value, self.emitter.wholes)
        if value.type != self.emitter.vector:
            address = builder.bitcast(address, value.type.as_pointer())
        builder.store(value, address)
        builder.position_at_end(block)


def home(value: ir.Value) -> ir.Function:
    return value.parent if isinstance(value, ir.Argument) else value.parent.function


def room(emitter: Instructions, size: int) -> ir.Value:
    """Memory for this many numbers, allocated once for the whole function."""
    with emitter.builder.goto_entry_block():
        memory: ir.Value = emitter.builder.alloca(emitter.vector, size=max(size, 1))
    return memory


def store(emitter: Instructions, numbers: Sequence[Operand], memory: ir.Value, place: ir.Value) -> None:
    """Write numbers consecutively, the first to this place."""
    builder = emitter.builder
    address = builder.gep(memory, [place])
    for offset, number in enumerate(numbers):
        builder.store(emitter.value(number), builder.gep(address, [PLACE(offset)]))


def loaded(emitter: Instructions, memory: ir.Value, size: int) -> list[RecordedNumber]:
    """All numbers of a piece of memory, each remembered with its place."""
    lanes = []
    for place in range(size):
        value = emitter.builder.load(emitter.builder.gep(memory, [PLACE(place)]))
        emitter.stored[id(value)] = LoadedFrom(memory, place)
        lanes.append(RecordedNumber(emitter, value))
    return lanes


def matrix(emitter: Instructions, memory: ir.Value, count: int, columns: int) -> Matrix:
    lanes = cast(list[Number], loaded(emitter, memory, count * columns))
    return Matrix(Vector(lanes[place * columns : (place + 1) * columns]) for place in range(count))


def row(emitter: Instructions, source: LoadedFrom, place: ir.Value, columns: int) -> Vector:
    builder = emitter.builder
    address = builder.gep(source.memory, [builder.add(builder.mul(place, PLACE(columns)), PLACE(source.place))])
    entries: list[RecordedNumber] = []
    for column in range(columns):
        value = builder.load(builder.gep(address, [PLACE(column)]))
        entries.append(RecordedNumber(emitter, emitter.spread(value) if source.scalar else value))
    return Vector(cast(list[Number], entries))


def in_memory(emitter: Instructions, rows: Matrix) -> LoadedFrom:
    """The memory that holds a matrix row by row: its origin, else a copy."""
    entries = flatten(rows)
    places = [emitter.stored.get(id(emitter.value(number))) for number in entries]
    first = places[0]
    if first is not None and all(one == first._replace(place=first.place + i) for i, one in enumerate(places)):
        return first
    memory = room(emitter, len(entries))
    store(emitter, entries, memory, PLACE(0))
    return LoadedFrom(memory, 0)


SYMBOL = "quadstep_call"
COUNT = ir.IntType(64)
BYTES = ir.IntType(8).as_pointer()


def dispatch(source: int, target: int, inputs: int, outputs: int, width: int, size: int) -> None:
    """Call a function for each of `width` lanes of numbers of `size` bytes.

    source: the address of a vector of handles and of `inputs` vectors after it. target: of `outputs` vectors, to be filled.
    """
    cell, kind = (ctypes.c_double, np.float64) if size == 8 else (ctypes.c_float, np.float32)
    given: Any = (cell * ((1 + inputs) * width)).from_address(source)
    lanes = np.frombuffer(given, kind).reshape(1 + inputs, width).T.astype(np.float64, order="C")
    taken = (cell * (outputs * width)).from_address(target)
    for lane in range(width):
        taken[lane::width] = answer(float(lanes[lane, 0]), lanes[lane, 1:], outputs)


DISPATCH = ctypes.CFUNCTYPE(None, *[ctypes.c_size_t] * 2, *[ctypes.c_int64] * 4)(dispatch)


@lru_cache(maxsize=1)
def link() -> None:
    """Let compiled code find `dispatch`. Needed once in each process that loads such code; tracing it does so."""
    llvm.add_symbol(SYMBOL, ctypes.cast(DISPATCH, ctypes.c_void_p).value)


class Emitter(Instructions):
    """Where lanes put their instructions."""

    def scan(self, step: Step[C], carry: C, rows: Rows[Matrix], count: int, backwards: bool) -> tuple[C, Rows[Matrix]]:
        """See `quadstep.numbers.scan`."""
        builder = self.builder
        given = flatten(carry)
        sources = [(in_memory(self, one), len(one.rows[0])) for one in matrices(rows)]
        slots = room(self, len(given))
        store(self, given, slots, PLACE(0))
        with builder.goto_entry_block():
            counter = builder.alloca(PLACE)
        builder.store(PLACE(count - 1 if backwards else 0), counter)
        known = dict(self.known)
        body, over = (builder.function.append_basic_block(name) for name in ("turn", "turned"))
        builder.branch(body)
        builder.position_at_end(body)  # values known before the loop are known in each turn

        place = builder.load(counter)
        now = rebuild(carry, iter(loaded(self, slots, len(given))))
        taken = [row(self, source, place, columns) for source, columns in sources]
        after, made = step(now, shaped(rows, iter(taken)))
        same_shape(after, len(given))
        kept = [(room(self, count * len(one)), len(one)) for one in matrices(made)]
        for one, (memory, columns) in zip(matrices(made), kept, strict=True):
            store(self, cast(list[Operand], list(one)), memory, builder.mul(place, PLACE(columns)))
        store(self, flatten(after), slots, PLACE(0))
        builder.store(builder.add(place, PLACE(-1 if backwards else 1)), counter)
        builder.cbranch(builder.icmp_unsigned("==", place, PLACE(0 if backwards else count - 1)), over, body)

        builder.position_at_end(over)
        self.known = known
        last = rebuild(carry, iter(loaded(self, slots, len(given))))
        return last, shaped(made, iter([matrix(self, memory, count, columns) for memory, columns in kept]))

    def call(self, memory: dict[str, object], law: Callable[[S], T], structure: S) -> T:
        """The result of `law`, whose code is written on the first call and kept in `memory`."""
        if self.width == 1 or self.subroutine is not None:  # a graphics processor; a law within a law
            return law(structure)
        if "law" not in memory:
            memory["law"] = Subroutine(self, law, structure)
        return cast("Subroutine[S, T]", memory["law"]).call(structure)

    def shortcut(self, quick: Callable[[S], tuple[object, T]], law: Callable[[S], T], structure: S) -> T:
        """See `quadstep.numbers.scan`: results are in memory, the law's in place of the other's where any lane needs it."""
        if self.width == 1:
            return law(structure)
        builder, lanes = self.builder, ir.IntType(self.width)
        holds, plain = quick(structure)
        if not isinstance(holds, Recorded):  # known while the law is recorded
            return plain if holds else law(structure)
        leaves = flatten(plain)
        slots = room(self, len(leaves))
        store(self, leaves, slots, PLACE(0))
        needed, over = (builder.function.append_basic_block(name) for name in ("needed", "over"))
        everywhere = builder.icmp_unsigned("==", builder.bitcast(self.value(holds), lanes), lanes((1 << self.width) - 1))
        known = dict(self.known)
        builder.cbranch(everywhere, over, needed)
        builder.position_at_end(needed)  # values known before the branch are known in it
        store(self, flatten(law(structure)), slots, PLACE(0))
        builder.branch(over)
        builder.position_at_end(over)
        self.known = known
        return rebuild(plain, iter(loaded(self, slots, len(leaves))))

    def opaque(self, handle: Number, inputs: Sequence[Number], outputs: int) -> list[Number]:
        """See `quadstep.numbers.scan`. The code names the function only by its handle, so that it can be kept between runs."""
        given: list[Operand] = [handle, *inputs]
        link()
        builder = self.builder
        with builder.goto_entry_block():  # on the stack once, not once per turn of the loop
            source, target = (builder.alloca(self.vector, size=size) for size in (len(given), outputs))
        for place, number in enumerate(given):
            builder.store(self.value(number), builder.gep(source, [COUNT(place)]))
        places = [builder.gep(target, [COUNT(place)]) for place in range(outputs)]
        for place in places:
            builder.store(self.constant(math.nan), place)  # stays if the call is aborted
        function = builder.module.globals.get(SYMBOL)
        if function is None:
            kind = ir.FunctionType(ir.VoidType(), [BYTES] * 2 + [COUNT] * 4)
            function = ir.Function(builder.module, kind, SYMBOL)
        sizes = [len(inputs), outputs, self.width, 8 if self.precise else 4]
        builder.call(function, [builder.bitcast(source, BYTES), builder.bitcast(target, BYTES), *map(COUNT, sizes)])
        return [RecordedNumber(self, builder.load(place)) for place in places]  # type: ignore[misc]

"""Functions within compiled code: a law written once and called wherever it is needed.

Caller and function communicate through a frame in memory: the law's arguments, its results, and captured values.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, TypeVar, cast

from llvmlite import ir

from quadstep.numbers.structure import flatten, rebuild
from quadstep.program.instructions import Instructions
from quadstep.program.recorded import RecordedNumber

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
        """Call the law with this structure."""
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
    """The function that a value belongs to."""
    return value.parent if isinstance(value, ir.Argument) else value.parent.function


def call(emitter: Instructions, memory: dict[str, object], law: Callable[[S], T], structure: S) -> T:
    """The result of `law`, whose code is written on the first call and kept in `memory`."""
    if emitter.width == 1 or emitter.subroutine is not None:  # a graphics processor; a law within a law
        return law(structure)
    if "law" not in memory:
        memory["law"] = Subroutine(emitter, law, structure)
    return cast("Subroutine[S, T]", memory["law"]).call(structure)

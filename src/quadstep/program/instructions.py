"""Recorded laws as LLVM vector instructions, one flight per lane.

Whatever has been computed in a block is not computed again, so matrix notation costs nothing once compiled. Every operation
is rounded by itself, in the order of the law: nothing is fused or reassociated, so lanes on any processor agree with Python
floats.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, Protocol, cast

from llvmlite import ir

from quadstep.program.operations import FORMS, WORDS
from quadstep.program.recorded import Operand, Recorded, Recording

WHOLE = ir.IntType(32)
"""A word of bits, whatever the kind of the lanes' numbers."""


class LoadedFrom(NamedTuple):
    """Where a number was loaded from. memory: its first address. scalar: whether one number there serves all lanes."""

    memory: ir.Value
    place: int
    scalar: bool = False


class CurrentSubroutine(Protocol):
    """The function being written, if not the whole: a `Subroutine`."""

    def local(self, value: ir.Value) -> ir.Value:
        """A value of the surrounding code as the function sees it."""


class Instructions(Recording):
    """Where lanes put their instructions: a builder, the vector type, and what the current block already holds.

    One lane (width 1) means plain scalars, for a processor without vectors: a graphics processor.
    """

    def __init__(self, builder: ir.IRBuilder, element: ir.Type, width: int) -> None:
        self.builder = builder
        self.element = element
        self.width = width
        self.vector = self.many(element)
        self.precise = isinstance(element, ir.DoubleType)
        self.whole = ir.IntType(64 if self.precise else 32)
        self.wholes, self.words = self.many(self.whole), self.many(WHOLE)
        self.known: dict[tuple[str | int, ...], ir.Value] = {}
        self.subroutine: CurrentSubroutine | None = None
        self.constants: dict[tuple[ir.Type, str], ir.Constant] = {}
        self.stored: dict[int, LoadedFrom] = {}  # by identity of what was loaded

    def many(self, element: ir.Type) -> ir.Type:
        """The type that holds one `element` per lane."""
        return element if self.width == 1 else ir.VectorType(element, self.width)

    def enter(self, block: ir.Block) -> None:
        """Continue at the end of `block`."""
        self.builder.position_at_end(block)
        self.known.clear()

    def constant(self, value: float) -> ir.Constant:
        return self.splat(self.vector, self.element, float(value))

    def whole_constant(self, value: int) -> ir.Constant:
        """The same integer in every lane."""
        return self.splat(self.wholes, self.whole, value)

    def splat(self, kind: ir.Type, element: ir.Type, value: float) -> ir.Constant:
        """A constant of this type, which holds one `element` per lane."""
        key = (kind, repr(value))  # as text, 0.0 and -0.0 differ
        if key not in self.constants:
            one = ir.Constant(element, value)
            self.constants[key] = one if self.width == 1 else ir.Constant(kind, [one] * self.width)
        return self.constants[key]

    def spread(self, scalar: ir.Value) -> ir.Value:
        if self.width == 1:
            return scalar
        nothing = ir.Constant(self.many(scalar.type), ir.Undefined)
        one = self.builder.insert_element(nothing, scalar, ir.IntType(32)(0))
        return self.builder.shuffle_vector(one, nothing, ir.Constant(self.many(ir.IntType(32)), [0] * self.width))

    def value(self, number: Operand | Recorded) -> ir.Value:
        """The LLVM value of a lane or a Python number, as the function being written sees it."""
        if isinstance(number, Recorded):
            return number.place if self.subroutine is None else self.subroutine.local(number.place)
        return self.constant(number)

    def write(self, operation: str, *operands: Operand | Recorded) -> ir.Value:
        """The result of an operation, or its earlier result in this block."""
        if operation == "bit":
            values = [self.value(operands[0]), self.whole_constant(cast(int, operands[1]))]
        elif operation in WORDS and not isinstance(operands[1], Recorded):
            values = [self.value(operands[0]), self.splat(self.words, WHOLE, operands[1])]
        else:
            values = [self.value(one) for one in operands]
        name: tuple[str | int, ...] = (operation, *map(id, values))
        if name not in self.known:
            self.known[name] = FORMS[operation].llvm(self, *values)
        return self.known[name]

    def once(self, key: tuple[str | ir.Value, ...], emit: Callable[[], ir.Value]) -> ir.Value:
        """The result of `emit`, or its earlier result in this block for the same operation and operands."""
        name = tuple(part if isinstance(part, str) else id(part) for part in key)
        if name not in self.known:
            self.known[name] = emit()
        return self.known[name]

    def intrinsic(self, name: str, *values: ir.Value) -> ir.Value:
        """A call of an LLVM intrinsic on vectors."""
        full = f"llvm.{name}.{'' if self.width == 1 else f'v{self.width}'}f{64 if self.precise else 32}"
        module = self.builder.module
        function = module.globals.get(full)
        if function is None:
            function = ir.Function(module, ir.FunctionType(self.vector, [self.vector] * len(values)), full)
        return self.builder.call(function, values)

    def looked_up(self, table: ir.Value, index: ir.Value) -> ir.Value:
        """The entry of a table in memory at a whole index, a separate load for each lane."""
        builder = self.builder
        whole = self.once(("fptosi", index), lambda: builder.fptosi(index, self.wholes))
        if self.width == 1:
            return builder.load(builder.gep(table, [whole]))
        result = ir.Constant(self.vector, ir.Undefined)
        for lane in range(self.width):
            place = ir.Constant(ir.IntType(32), lane)
            address = builder.gep(table, [builder.extract_element(whole, place)])
            result = builder.insert_element(result, builder.load(address), place)
        return result

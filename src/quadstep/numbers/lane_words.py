"""32-bit integers in lanes, whatever the kind of the lanes' numbers, for the random generator."""

from __future__ import annotations

from collections.abc import Callable

from llvmlite import ir

from quadstep.numbers.lane import Emitter, Lane

EVERY_BIT = 0xFFFFFFFF
WHOLE = ir.IntType(32)


class LaneWord:
    """One word of 32 bits in many flights at once. Sums wrap around; `>>` shifts zeros in; a Python int is a constant."""

    __slots__ = ("emitter", "given")

    def __init__(self, emitter: Emitter, value: ir.Value) -> None:
        self.emitter, self.given = emitter, value

    @property
    def value(self) -> ir.Value:
        """The LLVM value."""
        return self.emitter.here(self.given)

    @classmethod
    def of(cls, x: Lane) -> LaneWord:
        """The bits of a whole number in [0, 2^31); beyond that and for NaN they are meaningless."""
        emitter = x.emitter
        kind = emitter.many(WHOLE)
        bits = emitter.once(("word", x.value), lambda: emitter.builder.fptosi(x.value, kind))
        return cls(emitter, bits)

    def number(self) -> Lane:
        """The whole number in [0, 2^31) that has these bits, rounded to the lanes' kind."""
        emitter = self.emitter
        value = emitter.once(("number", self.value), lambda: emitter.builder.sitofp(self.value, emitter.vector))
        return Lane(emitter, value)

    @property
    def functions(self) -> object:
        """The functions of lanes."""
        return Lane.functions

    def _with(self, operation: str, build: Callable[[ir.Value, ir.Value], ir.Value], other: LaneWord | int) -> LaneWord:
        emitter = self.emitter
        kind = self.value.type
        value = other.value if isinstance(other, LaneWord) else emitter.splat(kind, WHOLE, other)
        return LaneWord(emitter, emitter.once((operation, self.value, value), lambda: build(self.value, value)))

    def __add__(self, other: LaneWord | int) -> LaneWord:
        return self._with("add", self.emitter.builder.add, other)

    def __and__(self, other: LaneWord | int) -> LaneWord:
        return self if other == EVERY_BIT else self._with("and", self.emitter.builder.and_, other)

    def __or__(self, other: LaneWord | int) -> LaneWord:
        return self._with("or", self.emitter.builder.or_, other)

    def __xor__(self, other: LaneWord | int) -> LaneWord:
        return self._with("xor", self.emitter.builder.xor, other)

    __radd__, __rand__, __ror__, __rxor__ = __add__, __and__, __or__, __xor__

    def __lshift__(self, bits: int) -> LaneWord:
        return self._with("shl", self.emitter.builder.shl, bits)

    def __rshift__(self, bits: int) -> LaneWord:
        return self._with("lshr", self.emitter.builder.lshr, bits)

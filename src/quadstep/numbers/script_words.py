"""32-bit integers in scripts, for the random generator. JavaScript's bit operations work on exactly these."""

from __future__ import annotations

from quadstep.numbers.script import Record, ScriptNumber

EVERY_BIT = 0xFFFFFFFF


class ScriptWord:
    """One word of 32 bits. Sums wrap around; `>>` shifts zeros in; a Python int is a constant."""

    __slots__ = ("place", "record")

    def __init__(self, record: Record, place: int) -> None:
        self.record, self.place = record, place

    @classmethod
    def of(cls, x: ScriptNumber) -> ScriptWord:
        """The bits of a whole number in [0, 2^31)."""
        return cls(x.record, x.record.place("word", x.place))

    def number(self) -> ScriptNumber:
        """The whole number in [0, 2^31) that has these bits."""
        return ScriptNumber(self.record, self.record.place("number", self.place))

    @property
    def functions(self) -> object:
        """The functions of script numbers."""
        return ScriptNumber.functions

    def _with(self, operation: str, other: ScriptWord | int) -> ScriptWord:
        place = other.place if isinstance(other, ScriptWord) else self.record.at(signed(other))
        return ScriptWord(self.record, self.record.place(operation, self.place, place))

    def __add__(self, other: ScriptWord | int) -> ScriptWord:
        return self._with("word +", other)

    def __and__(self, other: ScriptWord | int) -> ScriptWord:
        return self if other == EVERY_BIT else self._with("word &", other)

    def __or__(self, other: ScriptWord | int) -> ScriptWord:
        return self._with("word |", other)

    def __xor__(self, other: ScriptWord | int) -> ScriptWord:
        return self._with("word ^", other)

    __radd__, __rand__, __ror__, __rxor__ = __add__, __and__, __or__, __xor__

    def __lshift__(self, bits: int) -> ScriptWord:
        return self._with("word <<", bits)

    def __rshift__(self, bits: int) -> ScriptWord:
        return self._with("word >>", bits)


def signed(bits: int) -> int:
    """The same 32 bits as a number of JavaScript's bit operations, in [-2^31, 2^31)."""
    return ((bits & EVERY_BIT) ^ 0x80000000) - 0x80000000

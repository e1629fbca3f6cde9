"""A recorded law as a list of assignments, each once, to be written as JavaScript or C. No external text enters."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, cast

from quadstep.program.operations import COMMUTATIVE, WORDS
from quadstep.program.recorded import EVERY_BIT, Operand, Recorded, RecordedNumber, RecordedTable, Recording


class Node(NamedTuple):
    """One assignment. operands: earlier places in the record. text: of an input; of a constant, as Python writes it."""

    operation: str
    operands: tuple[int, ...] = ()
    text: str = ""


CONSTANT, INPUT = "constant", "input"


class Record(Recording):
    """The assignments so far, operands before their users. inline: to write elementary functions themselves."""

    def __init__(self, inline: bool = False, precise: bool = True) -> None:
        self.inline, self.precise = inline, precise
        self.nodes: list[Node] = []
        self.known: dict[Node, int] = {}

    def place(self, operation: str, *operands: int, text: str = "") -> int:
        """The place of this assignment, new or as recorded before."""
        node = Node(operation, operands, text)
        if node not in self.known:
            self.known[node] = len(self.nodes)
            self.nodes.append(node)
        return self.known[node]

    def write(self, operation: str, *operands: Operand | Recorded) -> int:
        """The place of an operation on numbers."""
        if operation in WORDS and not isinstance(operands[1], Recorded):
            operands = operands[0], signed(cast(int, operands[1]))
        places = [one.place if isinstance(one, Recorded) else self.at(one) for one in operands]
        if operation in COMMUTATIVE:
            places.sort()
        elif operation == "negative" and self.nodes[places[0]].operation == "negative":
            return self.nodes[places[0]].operands[0]
        return self.place(operation, *places)

    def same(self, one: Operand, other: Operand) -> bool:
        """Whether they are one assignment."""
        return self.at(one) == self.at(other)

    def input(self, text: str) -> RecordedNumber:
        """A number that is found under this name."""
        return RecordedNumber(self, self.place(INPUT, text=text))

    def table(self, text: str, size: int) -> RecordedTable:
        """A table that is found, as an array, under this name."""
        return RecordedTable(self, self.place(INPUT, text=text), size)

    def at(self, number: Operand | Recorded) -> int:
        """The place of a number, which may be a Python one."""
        return number.place if isinstance(number, Recorded) else self.place(CONSTANT, text=repr(float(number)))


class LoopRecord(Record):
    """A record with loops. turning: for each place the loops, by counter, in whose turns it is another number."""

    def __init__(self, inline: bool = False, precise: bool = True) -> None:
        super().__init__(inline, precise)
        self.turning: list[frozenset[str]] = []

    def place(self, operation: str, *operands: int, text: str = "", turning: frozenset[str] = frozenset()) -> int:
        """As in any record. turning: of this number besides its operands'."""
        place = super().place(operation, *operands, text=text)
        if place == len(self.turning):
            for operand in operands:
                turning |= self.turning[operand]
            self.turning.append(turning)
        return place

    def around(self, counter: str, results: Sequence[int]) -> tuple[set[int], frozenset[str]]:
        """The values that a loop captures to compute these results, and the other loops on which its turns depend."""
        taken: set[int] = set()
        seen: set[int] = set()
        waiting, turning = list(results), set[str]()
        while waiting:
            place = waiting.pop()
            if place in seen:
                continue
            seen.add(place)
            turning |= self.turning[place]
            if counter in self.turning[place]:
                waiting += self.nodes[place].operands
            else:
                taken.add(place)
        return taken, frozenset(turning - {counter})


def signed(bits: int) -> int:
    """The same 32 bits as a number of JavaScript's bit operations, in [-2^31, 2^31)."""
    return ((bits & EVERY_BIT) ^ 0x80000000) - 0x80000000

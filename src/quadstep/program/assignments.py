"""A recorded law as a list of assignments, each once, to be written as JavaScript or C. No external text enters.

Of a scan in JavaScript, one node of the record represents a loop, whose step is recorded once. Carry and rows are kept in
arrays of their own, `L0`, `L1` and so on; rows that are already consecutive in an array, like parameters and the output of
another scan, are read there.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple, cast

from quadstep.numbers.kinds import Number
from quadstep.numbers.scan import C, Rows, Step, matrices, same_shape, shaped
from quadstep.numbers.structure import flatten, rebuild
from quadstep.numbers.vectors import Matrix, Vector
from quadstep.program.operations import COMMUTATIVE, WORDS
from quadstep.program.recorded import EVERY_BIT, Operand, Recorded, RecordedNumber, RecordedTable, Recording


class Node(NamedTuple):
    """One assignment. operands: earlier places in the record. text: of an input; of a constant, as Python writes it."""

    operation: str
    operands: tuple[int, ...] = ()
    text: str = ""


CONSTANT, INPUT = "constant", "input"


class Record(Recording):
    """The assignments so far, operands before their users. inline: to write elementary functions themselves.

    turning: for each place the loops, by counter, in whose turns it is another number.
    """

    def __init__(self, inline: bool = False, precise: bool = True) -> None:
        self.inline, self.precise = inline, precise
        self.nodes: list[Node] = []
        self.known: dict[Node, int] = {}
        self.turning: list[frozenset[str]] = []

    def place(self, operation: str, *operands: int, text: str = "", turning: frozenset[str] = frozenset()) -> int:
        """The place of this assignment, new or as recorded before. turning: of this number besides its operands'."""
        node = Node(operation, operands, text)
        if node not in self.known:
            self.known[node] = len(self.nodes)
            self.nodes.append(node)
            self.turning.append(turning.union(*(self.turning[operand] for operand in operands)))
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


ARRAY, LOOP, ITEM = "array", "loop", "item"
"""Operations: an array filled with numbers; a loop; a number read from an array."""

STATEMENTS = frozenset((ARRAY, LOOP))


class LoopAssignment(NamedTuple):
    """counter: the variable that counts its turns. state: the array of the carry. begin: places of the carry before the first
    turn. results: of the last assignments of a turn, each with the text of its target.
    """

    counter: str
    turns: int
    backwards: bool
    state: str
    begin: tuple[int, ...]
    results: tuple[tuple[str, int], ...]


class ScriptRecord(Record):
    """A record that may hold scans."""

    def __init__(self) -> None:
        super().__init__()
        self.loops: dict[int, LoopAssignment] = {}
        self.arrays: dict[str, int] = {}

    def array(self, size: int) -> str:
        name = f"L{len(self.arrays)}"
        self.arrays[name] = size
        return name

    def item(self, text: str, source: tuple[int, ...], turning: frozenset[str] = frozenset()) -> RecordedNumber:
        """A number read from an array. source: what has to be computed first."""
        return RecordedNumber(self, self.place(ITEM, *source, text=text, turning=turning))

    def source(self, rows: Matrix) -> tuple[str, int, tuple[int, ...], frozenset[str]]:
        """The array that holds a matrix row by row, the first entry's index, what fills it, and what it turns with."""
        places = [self.at(entry) for entry in flatten(rows)]
        nodes = [self.nodes[place] for place in places]
        found = [re.fullmatch(r"(\w+)\[(\d+)\]", node.text) if node.operation in (INPUT, ITEM) else None for node in nodes]
        first = found[0]
        turning = frozenset[str]().union(*(self.turning[place] for place in places))
        if first and all(
            one and one[1] == first[1] and int(one[2]) == int(first[2]) + i and node.operands == nodes[0].operands
            for i, (one, node) in enumerate(zip(found, nodes, strict=True))
        ):
            return first[1], int(first[2]), nodes[0].operands, turning
        name = self.array(len(places))
        return name, 0, (self.place(ARRAY, *places, text=name),), turning

    def scan(self, step: Step[C], carry: C, rows: Rows[Matrix], count: int, backwards: bool) -> tuple[C, Rows[Matrix]]:
        index = f"i{len(self.arrays)}"
        begin = tuple(self.at(number) for number in flatten(carry))
        sources = [(*self.source(one), len(one.rows[0])) for one in matrices(rows)]
        state, own = self.array(len(begin)), frozenset((index,))
        now = [self.item(f"{state}[{i}]", (), own) for i in range(len(begin))]
        taken = [
            Vector(
                cast(Number, self.item(f"{name}[{index}*{columns}+{first + column}]", source, own | turning))
                for column in range(columns)
            )
            for name, first, source, turning, columns in sources
        ]
        after, made = step(rebuild(carry, iter(now)), shaped(rows, iter(taken)))
        same_shape(after, len(begin))
        kept = [(self.array(count * len(one)), list(one)) for one in matrices(made)]
        results = [
            (f"{name}[{index}*{len(row)}+{column}]", self.at(cast(Operand, number)))
            for name, row in kept
            for column, number in enumerate(row)
        ]
        results += [(f"{state}[{i}]", self.at(number)) for i, number in enumerate(flatten(after))]
        around, turning = self.around(index, [place for _, place in results])
        filled = {place for _, _, source, _, _ in sources for place in source}
        loop = self.place(LOOP, *sorted(around | filled | set(begin)), text=index, turning=turning)
        self.loops[loop] = LoopAssignment(index, count, backwards, state, begin, tuple(results))

        def read(name: str, size: int) -> list[RecordedNumber]:
            return [self.item(f"{name}[{i}]", (loop,)) for i in range(size)]

        columns = [
            Matrix(Vector(line) for line in zip(*[iter(read(name, count * len(row)))] * len(row), strict=True))
            for name, row in kept
        ]
        return rebuild(carry, iter(read(state, len(begin)))), shaped(made, iter(columns))

"""Scans in C: one node of the record represents a loop, whose step is recorded once.

A scan has its own struct, named after its step: the carry, and the rows that it makes. Its input rows are read
where they are stored; numbers that are not stored yet are written into an array first.
"""

from collections import namedtuple
from typing import NamedTuple, cast

from quadstep.export.c.structs import Stored, as_given, as_struct, fields_of, found, placed, stored
from quadstep.numbers import Matrix, Structure, Vector, flatten
from quadstep.numbers.scan import C, Rows, Step, matrices, same_shape, shaped
from quadstep.program.rows import TURN, RowMatrix, RowRecord

FILLED, SCAN = "filled", "scan"
"""Operations: an array of numbers, entry by entry; a loop whose turns depend on one another."""


class Scan(NamedTuple):
    """counter: names its turns and its memory. step: the name of the law's function. memory: the contents of its struct, any
    numbers. begin: values stored there before the first turn; turn: values that each turn stores.
    """

    counter: str
    step: str
    turns: int
    backwards: bool
    memory: Structure
    begin: Stored
    turn: Stored


class ScanRecord(RowRecord):
    """A record with loops over rows and scans."""

    def __init__(self, inline: bool = False, precise: bool = True) -> None:
        super().__init__(inline, precise)
        self.scans: dict[int, Scan] = {}

    def in_memory(self, rows: Matrix) -> RowMatrix:
        """A matrix as an array: the one in which it is stored, or one filled with its numbers."""
        if isinstance(rows, RowMatrix):
            return rows
        shape = len(rows), len(rows.rows[0])
        places = [self.at(entry) for entry in flatten(rows)]
        return RowMatrix.found(self, shape, self.place(FILLED, *places, text=f"[{shape[0]}][{shape[1]}]"))

    def scan(self, step: Step[C], carry: C, rows: Rows[Matrix], count: int, backwards: bool) -> tuple[C, Rows[Matrix]]:
        """A scan as one node."""
        counter = self.index(TURN)
        begin = as_struct(carry, "carry")
        given = shaped(rows, iter([self.in_memory(one).row(counter) for one in matrices(rows)]))
        after, made = step(cast(C, as_given(found(self, begin, f"{counter}."), carry)), given)
        same_shape(after, len(flatten(begin)))
        lines = {f"made_{k}": line for k, line in enumerate(matrices(made))}
        memory = {**fields_of(begin), **{name: Matrix([line] * count) for name, line in lines.items()}}
        whole = namedtuple("Memory", memory)(**memory)
        first = stored(self, [(f"{counter}.", begin)])
        rows_left = [(f"{counter}.{name}[{counter}]", Vector(line)) for name, line in lines.items()]
        turn = stored(self, [*rows_left, (f"{counter}.", as_struct(after, "carry"))])
        taken, _ = self.around(counter, [one.place for one in (*turn.numbers, *turn.arrays)])
        node = self.place(SCAN, *sorted(taken.union(one.place for one in (*first.numbers, *first.arrays))), text=counter)
        self.scans[node] = Scan(counter, getattr(step, "__name__", "turn"), count, backwards, whole, first, turn)
        columns = [
            RowMatrix.found(self, (count, len(line)), placed(self, f"{counter}.{name}", (node,)))
            for name, line in lines.items()
        ]
        last = as_given(found(self, begin, f"{counter}.", (node,)), carry)
        return cast(C, last), shaped(made, iter(columns))

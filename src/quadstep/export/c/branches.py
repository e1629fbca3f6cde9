"""Branches and loops in C: which numbers a function computes together, and which only in one branch of a choice.

Of a scan one node of the record represents a loop, whose step is recorded once. It has its own struct, named after its step:
the carry, and the rows that it makes. Its input rows are read where they are stored; numbers that are not stored yet are
written into an array first.
"""

from collections import namedtuple
from collections.abc import Mapping, Sequence
from heapq import heappop, heappush
from typing import NamedTuple, cast

from quadstep.export.c.structs import (
    StoredStructures,
    as_struct,
    fields_of,
    from_struct,
    place_in_memory,
    stored,
    structure_in_memory,
)
from quadstep.io.grouping import by_first
from quadstep.numbers import Matrix, Structure, Vector, flatten
from quadstep.numbers.operation import OPERATIONS
from quadstep.numbers.scan import C, Rows, Step, matrices, same_shape, shaped
from quadstep.program.assignments import Node
from quadstep.program.rows import LEFT, TURN, RowMatrix, RowRecord

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
    begin: StoredStructures
    turn: StoredStructures


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
        return RowMatrix.in_memory(self, shape, self.place(FILLED, *places, text=f"[{shape[0]}][{shape[1]}]"))

    def scan(self, step: Step[C], carry: C, rows: Rows[Matrix], count: int, backwards: bool) -> tuple[C, Rows[Matrix]]:
        counter = self.index(TURN)
        begin = as_struct(carry, "carry")
        given = shaped(rows, iter([self.in_memory(one).row(counter) for one in matrices(rows)]))
        after, made = step(cast(C, from_struct(structure_in_memory(self, begin, f"{counter}."), carry)), given)
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
            RowMatrix.in_memory(self, (count, len(line)), place_in_memory(self, f"{counter}.{name}", (node,)))
            for name, line in lines.items()
        ]
        last = from_struct(structure_in_memory(self, begin, f"{counter}.", (node,)), carry)
        return cast(C, last), shaped(made, iter(columns))


HALVES = {"sin": "sine", "cos": "cosine"}
"""Functions that are members of what `qs_sincos` returns: both cost little more than one."""

MANY = 4
"""As many choices by one condition are worth one too."""

FIXED = frozenset(("loop", SCAN, FILLED, "sum", LEFT, "item"))
"""Operations that stay where they are: they are about memory."""


def pairs(nodes: Sequence[Node], needed: Sequence[int]) -> dict[int, int]:
    """Sines and cosines of the same angle, by the one that comes first."""
    found: dict[tuple[int, ...], int] = {}
    both = {}
    for place in needed:
        operation, angle, _ = nodes[place]
        if operation in HALVES:
            if angle in found:
                both[found[angle]] = place
            found[angle] = place
    return both


class Branches(NamedTuple):
    """Choices by one condition that become one `if`. sides: what only its first and only its second branch needs, in order."""

    choices: list[int]
    sides: tuple[list[int], list[int]]


class Uses:
    """Which numbers use which. wanted: results. joined: by a number, the later one that is computed with it."""

    def __init__(self, nodes: Sequence[Node], needed: Sequence[int], wanted: set[int], joined: Mapping[int, int]) -> None:
        self.nodes, self.wanted = nodes, wanted
        self.joined, self.earlier = joined, {other: one for one, other in joined.items()}
        self.users: dict[int, set[int]] = {place: set() for place in needed}
        for place in needed:
            for operand in nodes[place].operands:
                if operand in self.users:
                    self.users[operand].add(place)
        for one, other in joined.items():
            self.users[one] = self.users[other] = self.users[one] | self.users[other]

    def only(self, choices: Sequence[int], side: int) -> set[int]:
        """The numbers that nothing but this operand of some choices needs."""
        others = {self.nodes[choice].operands[one] for choice in choices for one in (0, 3 - side)}
        found: set[int] = set()
        waiting: list[int] = []

        def ask(place: int) -> None:
            heappush(waiting, -self.earlier.get(place, place))

        for choice in choices:
            ask(self.nodes[choice].operands[side])
        while waiting:
            place = -heappop(waiting)  # users before what they use
            together = {place, self.joined.get(place, place)}
            if place in found or place not in self.users or together & self.wanted or together & others:
                continue
            if self.nodes[place].operation not in FIXED and self.users[place] <= found.union(choices):
                found |= together
                for operand in self.nodes[place].operands:
                    ask(operand)
        return found


def branches(nodes: Sequence[Node], needed: Sequence[int], wanted: set[int], joined: Mapping[int, int]) -> dict[int, Branches]:
    """The choices worth an `if`, by the last of each: outer ones first, so that a number ends in the innermost."""
    uses = Uses(nodes, needed, wanted, joined)
    choosing = by_first((nodes[place].operands[0], place) for place in needed if nodes[place].operation == "where")
    found: dict[int, list[int]] = {}
    owners: dict[int, tuple[int, int]] = {}
    taken: set[int] = set()
    for last in sorted((place for places in choosing.values() for place in places), reverse=True):
        if last in taken:
            continue
        alike = [one for one in choosing[nodes[last].operands[0]] if one <= last and owners.get(one) == owners.get(last)]
        choices = [one for one in alike if one not in taken and all(user > last for user in uses.users[one])]
        sides = uses.only(choices, 1), uses.only(choices, 2)
        if len(choices) >= MANY or any(nodes[place].operation in OPERATIONS for side in sides for place in side):
            taken.update(choices)
            found[last] = choices
            owners |= {place: (last, number) for number, side in enumerate(sides) for place in side}
    result = {last: Branches(choices, ([], [])) for last, choices in found.items()}
    for place in sorted(owners):
        last, number = owners[place]
        result[last].sides[number].append(place)
    return result

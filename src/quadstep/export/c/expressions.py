"""Recorded numbers in C99: as expressions, the name of each and what it reads; as statements, among them sines with cosines,
and choices with what only one of their branches needs.
"""

import re
from collections import Counter
from typing import NamedTuple

from quadstep.export.c.branches import HALVES, Branches, ScanRecord
from quadstep.export.c.structs import INDENT, literal, unbracketed
from quadstep.program.assignments import CONSTANT, INPUT
from quadstep.program.operations import CONDITIONS, in_c
from quadstep.program.rows import LEFT

LONGEST = 84
"""Longest expression that is written inside another one [characters]."""

INDICES = "ijkl"
"""Loop counters, from the outermost inwards."""

MEMORY = re.compile(r"^(s\d+)\.|\[([is]\d+)\]")
"""Placeholders in a text for loops: the memory of a scan, a row."""


class Naming(NamedTuple):
    """The law's names for its numbers, and the lines that compute them; by place."""

    names: dict[int, str]
    origins: dict[int, str]


class CStatement(NamedTuple):
    """A statement. reads: targets whose old value it uses. origin: line of the law. makes: results of a loop."""

    text: list[str]
    reads: frozenset[str]
    origin: str
    makes: tuple[str, ...] = ()


class Statements:
    """The numbers of one record as expressions and statements. given: names that are taken. memories: of scans; indices: of
    loops, by counter. halves: sines and cosines that are members of one local; pairs: sines and cosines of one angle;
    branches: choices; by place. with_last: choices that are made with the last one by the same condition.
    """

    def __init__(self, record: ScanRecord, precise: bool, naming: Naming, taken: frozenset[str] = frozenset()) -> None:
        self.record, self.nodes, self.precise, self.naming = record, record.nodes, precise, naming
        self.given = set(taken)
        self.names: dict[int, str] = {}
        self.memories: dict[str, str] = {}
        self.indices: dict[str, str] = {}
        self.halves: dict[int, str] = {}
        self.pairs: dict[int, int] = {}
        self.branches: dict[int, Branches] = {}
        self.with_last: set[int] = set()
        self.uses: Counter[int] = Counter()
        self.reads: frozenset[str] = frozenset()
        self.all_reads: set[str] = set()
        self.depth = 0

    def leaf(self, place: int) -> bool:
        """Whether a number exists without being computed."""
        return self.nodes[place].operation in (CONSTANT, INPUT)

    def kind(self, place: int) -> str:
        operation = self.nodes[place].operation
        return "bool" if operation in CONDITIONS else "uint32_t" if operation.startswith("word") else "real"

    def name(self, place: int, usual: str = "v") -> str:
        """A unique name: the law's, shortened to the length that C distinguishes."""
        wanted = re.sub(r"\W", "", self.naming.names.get(place, ""), flags=re.ASCII)[:26].strip("_") or usual
        wanted = wanted if not wanted[0].isdigit() else f"v{wanted}"
        name, number = wanted, 1
        while name in self.given:
            number += 1
            name = f"{wanted}_{number}"
        self.given.add(name)
        return name

    def scoped(self, text: str) -> str:
        """A text with the names of loops' memory and counters."""
        return MEMORY.sub(lambda one: f"{self.memories[one[1]]}." if one[1] else f"[{self.indices[one[2]]}]", text)

    def reads_since(self) -> frozenset[str]:
        """The targets that expressions written since the last call have read."""
        reads, self.reads = self.reads, frozenset()
        return reads

    def text(self, place: int) -> str:
        if place in self.names:
            return self.names[place]
        node = self.nodes[place]
        if node.operation == CONSTANT:
            return literal(float(node.text), self.precise)
        if node.operation in (INPUT, LEFT):
            text = self.scoped(node.text)
            self.reads |= {text}
            self.all_reads.add(text)
            return text
        return self.expression(place)

    def expression(self, place: int) -> str:
        if place in self.halves:
            return self.halves[place]
        node = self.nodes[place]
        if node.operation == "item":
            return self.text(node.operands[0]) + self.scoped(node.text)
        if node.operation == "bit":
            x, mask = node.operands
            return in_c("bit", (self.text(x), f"{int(float(self.nodes[mask].text))}u"))
        word = node.operation.startswith("word ")
        texts = [self._bits(operand) if word else self.text(operand) for operand in node.operands]
        called = in_c(node.operation, texts).startswith("qs_")
        return in_c(node.operation, list(map(unbracketed, texts)) if called else texts)

    def _bits(self, place: int) -> str:
        """An operand of an operation on words: a constant is one too."""
        node = self.nodes[place]
        return f"{int(float(node.text)) & 0xFFFFFFFF}u" if node.operation == CONSTANT else self.text(place)

    def long(self, place: int) -> bool:
        """Whether its expression is too long to stand in another one."""
        reads = self.reads
        long = len(self.expression(place)) > LONGEST
        self.reads = reads
        return long

    def _number(self, place: int, wanted: bool = False) -> list[CStatement]:
        """The statements for a number: none if it can stand where it is used."""
        lines = [self._sine_cosine(place, self.pairs[place])] if place in self.pairs else []
        if place in self.branches:
            return lines + self._branched(place)
        wanted = wanted or self.uses[place] > 1 or place in self.naming.names or self.nodes[place].operation == "item"
        return [*lines, self._local(place)] if wanted or self.long(place) else lines

    def _branched(self, place: int) -> list[CStatement]:
        """Choices by one condition, with what only one of its branches needs."""
        choices, own = self.branches[place]
        sides = [[line for one in side if one not in self.with_last for line in self._number(one)] for side in own]
        if len(choices) == 1 and not any(sides):
            return [self._local(place)]
        text, origin = unbracketed(self.text(self.nodes[place].operands[0])), self._origin(choices[0])
        values = [[unbracketed(self.text(self.nodes[one].operands[number])) for one in choices] for number in (1, 2)]
        names = [self.name(one) for one in choices]
        self.names |= dict(zip(choices, names, strict=True))
        blocks = [
            braced([*commented(side, origin), *(f"{name} = {value};" for name, value in zip(names, found, strict=True))])
            for side, found in zip(sides, values, strict=True)
        ]
        reads = self.reads_since().union(*(line.reads for side in sides for line in side))
        lines = [*(f"real {name};" for name in names), f"if ({text})", *blocks[0], "else", *blocks[1]]
        return [CStatement(lines, reads, origin)]

    def _origin(self, place: int) -> str:
        """The line of the law that a number is from."""
        return self.naming.origins.get(place, "")

    def _local(self, place: int) -> CStatement:
        text = unbracketed(self.expression(place))
        name = self.name(place)
        self.names[place] = name
        return CStatement([f"const {self.kind(place)} {name} = {text};"], self.reads_since(), self._origin(place))

    def _sine_cosine(self, *pair: int) -> CStatement:
        (angle,) = self.nodes[pair[0]].operands
        text = unbracketed(self.text(angle))
        name = self.name(-1, "turn")
        self.halves |= {place: f"{name}.{HALVES[self.nodes[place].operation]}" for place in pair}
        return CStatement(
            [f"const qs_sine_cosine {name} = qs_sincos({text});"], self.reads_since(), self._origin(pair[0]), (name,)
        )


def commented(lines: list[CStatement], origin: str = "") -> list[str]:
    """Statements, each under the line of the law that it is from. origin: of the one before them."""
    written: list[str] = []
    for line in lines:
        if line.origin and line.origin != origin:
            origin = line.origin
            written.append(f"/* {origin} */")
        written += line.text
    return written


def braced(lines: list[str]) -> list[str]:
    return ["{", *(INDENT + line for line in lines), "}"]

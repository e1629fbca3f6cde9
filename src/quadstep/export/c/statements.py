"""Recorded numbers as statements of C99: locals, sines with cosines, choices with what only one of their branches needs."""

from typing import NamedTuple

from quadstep.export.c.branches import HALVES, Branches
from quadstep.export.c.expressions import Expressions, Naming
from quadstep.export.c.literals import bare
from quadstep.export.c.scans import ScanRecord
from quadstep.export.c.structs import INDENT


class Line(NamedTuple):
    """A statement. reads: targets whose old value it uses. origin: line of the law. makes: results of a loop."""

    text: list[str]
    reads: frozenset[str]
    origin: str
    makes: tuple[str, ...] = ()


class Statements(Expressions):
    """The numbers of one record as statements. pairs: sines and cosines of one angle; branches: choices; by place."""

    def __init__(self, record: ScanRecord, precise: bool, naming: Naming, taken: frozenset[str] = frozenset()) -> None:
        super().__init__(record, precise, naming, taken)
        self.pairs: dict[int, int] = {}
        self.branches: dict[int, Branches] = {}

    def _number(self, place: int, wanted: bool = False) -> list[Line]:
        """The statements for a number: none if it can stand where it is used."""
        lines = [self._sine_cosine(place, self.pairs[place])] if place in self.pairs else []
        if place in self.branches:
            return lines + self._branched(place)
        return [*lines, self._local(place)] if wanted or self.kept(place) or self.long(place) else lines

    def _branched(self, place: int) -> list[Line]:
        """Choices by one condition, with what only one of its branches needs."""
        choices, own = self.branches[place]
        sides = [[line for one in side for line in self._number(one)] for side in own]
        if len(choices) == 1 and not any(sides):
            return [self._local(place)]
        text, origin = bare(self.text(self.nodes[place].operands[0])), self._origin(choices[0])
        values = [[bare(self.text(self.nodes[one].operands[number])) for one in choices] for number in (1, 2)]
        names = [self.name(one) for one in choices]
        self.names |= dict(zip(choices, names, strict=True))
        blocks = [
            braced([*commented(side, origin), *(f"{name} = {value};" for name, value in zip(names, found, strict=True))])
            for side, found in zip(sides, values, strict=True)
        ]
        reads = self.taken_reads().union(*(line.reads for side in sides for line in side))
        lines = [*(f"real {name};" for name in names), f"if ({text})", *blocks[0], "else", *blocks[1]]
        return [Line(lines, reads, origin)]

    def _origin(self, place: int) -> str:
        """The line of the law that a number is from."""
        return self.naming.origins.get(place, "")

    def _local(self, place: int) -> Line:
        """A local for a number."""
        text = bare(self.expression(place))
        name = self.name(place)
        self.names[place] = name
        return Line([f"const {self.kind(place)} {name} = {text};"], self.taken_reads(), self._origin(place))

    def _sine_cosine(self, *pair: int) -> Line:
        """One local with both."""
        (angle,) = self.nodes[pair[0]].operands
        text = bare(self.text(angle))
        name = self.name(-1, "turn")
        self.halves |= {place: f"{name}.{HALVES[self.nodes[place].operation]}" for place in pair}
        return Line([f"const qs_sine_cosine {name} = qs_sincos({text});"], self.taken_reads(), self._origin(pair[0]), (name,))


def commented(lines: list[Line], origin: str = "") -> list[str]:
    """Statements, each under the line of the law that it is from. origin: of the one before them."""
    written: list[str] = []
    for line in lines:
        if line.origin and line.origin != origin:
            origin = line.origin
            written.append(f"/* {origin} */")
        written += line.text
    return written


def braced(lines: list[str]) -> list[str]:
    """A block."""
    return ["{", *(INDENT + line for line in lines), "}"]

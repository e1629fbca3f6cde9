"""Recorded numbers as statements of C99.

A number that a law gives a name to, or that is used again, becomes a local; what is used once is written into its user. A
result is stored as soon as nothing reads any more what it replaces, so that few numbers wait at a time. What the rows of an
array become is computed where it is to stay, if nothing reads its former rows later.
"""

import re
from collections import Counter
from typing import NamedTuple

from quadstep.numbers.c_text import C_TEXT, literal
from quadstep.numbers.rows import Body, RowRecord
from quadstep.numbers.script import CONDITIONS, CONSTANT, INPUT

LONGEST = 84
"""Characters of an expression that is written into another one."""

INDENT = "    "


class Output(NamedTuple):
    """target: what the result is assigned to, as text. place: of the number, or of the loop that makes an array."""

    target: str
    place: int


class Line(NamedTuple):
    """A statement. reads: targets whose former value it takes. origin: line of the law."""

    text: list[str]
    reads: frozenset[str]
    origin: str


class Naming(NamedTuple):
    """What the law calls its numbers, and where it computes them; by place."""

    names: dict[int, str]
    origins: dict[int, str]


class Writer:
    """Writes the numbers of one record as the body of one function."""

    def __init__(self, record: RowRecord, precise: bool, naming: Naming, taken: frozenset[str] = frozenset()) -> None:
        self.record, self.nodes, self.precise, self.naming = record, record.nodes, precise, naming
        self.given = set(taken)
        self.names: dict[int, str] = {}
        self.uses: Counter[int] = Counter()
        self.reads: frozenset[str] = frozenset()

    def body(self, outputs: list[Output], arrays: list[Output]) -> list[str]:
        """The statements that give numbers and arrays to their targets."""
        results = {one.place for one in (*outputs, *arrays) if not self.leaf(one.place)}
        needed = self._count(results)
        storage = self._storage(needed, arrays)
        joined = self._joined(needed)
        later = {place for places in joined.values() for place in places}
        lines: list[Line] = []
        for place in needed:
            node = self.nodes[place]
            if self.leaf(place):
                continue
            if node.operation == "loop":
                if place not in later:
                    lines += self._loop([place, *joined.get(place, ())], storage)
            elif node.operation == "sum":
                continue
            elif place in results or self._kept(place) or self._long(place):
                lines.append(self._local(place))
        return self._with_stores(lines, outputs)

    def leaf(self, place: int) -> bool:
        """Whether a number is there without computing."""
        return self.nodes[place].operation in (CONSTANT, INPUT)

    # What is needed, and where it stays

    def _count(self, results: set[int]) -> list[int]:
        needed = set(results)
        for place in range(max(results, default=-1), -1, -1):
            if place not in needed:
                continue
            node = self.nodes[place]
            weight = 2 if node.operation == "loop" else 1  # a loop takes a number again and again
            for operand in node.operands:
                self.uses[operand] += weight
            needed.update(node.operands)
        return sorted(needed)

    def _storage(self, needed: list[int], arrays: list[Output]) -> dict[int, str]:
        """Where arrays are made: those that are results at their target, and what these are made from there too if it may."""
        storage = {one.place: one.target for one in arrays}
        for one in arrays:
            readers = [place for place in needed if self._reads_array(place, one.target)]
            for source in self.nodes[one.place].operands:
                body = self.record.loops.get(source)
                if body is None or not body.stored or source in storage:
                    continue
                same = body.rows == self.record.loops[one.place].rows
                width = len(body.stored) == len(self.record.loops[one.place].stored)
                if same and width and all(place <= source for place in readers):
                    storage[source] = one.target
        return storage

    def _joined(self, needed: list[int]) -> dict[int, list[int]]:
        """By loop, those that only add up what its rows become and arrays from before: they take the same turns."""
        joined: dict[int, list[int]] = {}
        for place in needed:
            body = self.record.loops.get(place)
            if body is None or body.stored:
                continue
            makers = [one for one in self.nodes[place].operands if one in self.record.loops]
            others = [one for one in self.nodes[place].operands if one not in makers]
            if len(makers) == 1 and self.record.loops[makers[0]].rows == body.rows and all(map(self.leaf, others)):
                joined.setdefault(makers[0], []).append(place)
        return joined

    def _reads_array(self, place: int, target: str) -> bool:
        """Whether an assignment takes entries of the array of this name."""
        node = self.nodes[place]
        if node.operation not in ("item", "loop"):
            return False
        return any(self.nodes[operand].text == target for operand in node.operands)

    # Statements

    def _kept(self, place: int) -> bool:
        """Whether a number has a local of its own."""
        return self.uses[place] > 1 or place in self.naming.names or self.nodes[place].operation == "item"

    def _name(self, place: int, usual: str = "v") -> str:
        """A name of its own: the law's, shortened to what C tells apart."""
        wanted = re.sub(r"\W", "", self.naming.names.get(place, ""), flags=re.ASCII)[:26].strip("_") or usual
        wanted = wanted if not wanted[0].isdigit() else f"v{wanted}"
        name, number = wanted, 1
        while name in self.given:
            number += 1
            name = f"{wanted}_{number}"
        self.given.add(name)
        return name

    def _local(self, place: int) -> Line:
        kind = "bool" if self.nodes[place].operation in CONDITIONS else "real"
        text = bare(self._expression(place))
        name = self._name(place)
        self.names[place] = name
        return Line([f"const {kind} {name} = {text};"], self._taken_reads(), self.naming.origins.get(place, ""))

    def _taken_reads(self) -> frozenset[str]:
        """What expressions written since the last call have read."""
        reads, self.reads = self.reads, frozenset()
        return reads

    def text(self, place: int) -> str:
        """A number where it is used."""
        if place in self.names:
            return self.names[place]
        node = self.nodes[place]
        if node.operation == CONSTANT:
            return literal(float(node.text), self.precise)
        if node.operation == INPUT:
            self.reads |= {node.text}
            return node.text
        return self._expression(place)

    def _expression(self, place: int) -> str:
        node = self.nodes[place]
        if node.operation == "item":
            array = self.text(node.operands[0])
            return array + re.sub(r"^\[i\d+\]", "[i]", node.text)
        if node.operation == "bit":
            x, mask = node.operands
            return C_TEXT["bit"].format(self.text(x), f"{int(float(self.nodes[mask].text))}u")
        if node.operation not in C_TEXT:
            raise TypeError(f"the operation {node.operation!r} cannot be written in C")
        texts = [self.text(operand) for operand in node.operands]
        called = C_TEXT[node.operation].startswith("qs_")
        return C_TEXT[node.operation].format(*(map(bare, texts) if called else texts))

    def _loop(self, places: list[int], storage: dict[int, str]) -> list[Line]:
        """Loops over the same rows as one, with what they need before it."""
        before: list[Line] = []
        inner: list[str] = []
        origin = self.naming.origins.get(places[0], "")
        for place in places:
            body = self.record.loops[place]
            before += self._before(place)
            if body.stored and place not in storage:
                storage[place] = self._name(place, "rows")
                width = f"[{len(body.stored)}]" if self._wide(place) else ""
                before.append(Line([f"real {storage[place]}[{body.rows}]{width};"], frozenset(), origin))
            if body.stored:
                self.names[place] = storage[place]
            sums = self._sums(place, len(body.added))
            before += [Line([f"real {name} = {literal(0.0, self.precise)};"], frozenset(), origin) for name in sums]
            inner += self._turn(body, storage.get(place), sums, self._wide(place))
        rows = self.record.loops[places[0]].rows
        text = [f"for (int32_t i = 0; i < {rows}; ++i)", "{", *(INDENT + line for line in inner), "}"]
        return [*before, Line(text, self._taken_reads(), origin)]

    def _before(self, place: int) -> list[Line]:
        """Locals for the numbers in memory that a loop takes."""
        return [
            self._hoisted(operand)
            for operand in self.nodes[place].operands
            if self.nodes[operand].operation == INPUT and operand not in self.names and self._is_number(operand)
        ]

    def _is_number(self, operand: int) -> bool:
        """Whether an input that a loop takes is a number, not an array."""
        return not any(node.operation == "item" and node.operands[0] == operand for node in self.nodes)

    def _hoisted(self, place: int) -> Line:
        """A local for an input, so that a loop need not read it from memory each time."""
        source = self.nodes[place].text
        name = self._name(place, re.split(r"->|\.", source)[-1].replace("[", "_").replace("]", ""))
        self.names[place] = name
        return Line([f"const real {name} = {source};"], frozenset((source,)), "")

    def _wide(self, place: int) -> bool:
        """Whether a loop makes a matrix."""
        items = (node.text for node in self.nodes if node.operation == "item" and node.operands[0] == place)
        return len(self.record.loops[place].stored) > 1 or any(text.count("[") > 1 for text in items)

    def _sums(self, place: int, count: int) -> list[str]:
        """Names of a loop's running sums."""
        found = {self.nodes[at].text: at for at in range(place, len(self.nodes)) if self.nodes[at][:2] == ("sum", (place,))}
        names = []
        for number in range(count):
            at = found.get(str(number), -1)
            names.append(self._name(at, "sum"))
            if at >= 0:
                self.names[at] = names[-1]
        return names

    def _turn(self, body: Body, target: str | None, sums: list[str], wide: bool) -> list[str]:
        """One turn of a loop."""
        results = [*body.stored, *(place for terms in body.added for place in terms)]
        uses: Counter[int] = Counter(results)
        inside = set(results)
        for place in range(max(results), -1, -1):
            if place in inside and body.counter in self.record.turning[place]:
                uses.update(self.nodes[place].operands)
                inside.update(self.nodes[place].operands)
        outside = set(self.given)
        lines = []
        for place in sorted(inside):
            once = uses[place] == 1 and place not in self.naming.names
            if body.counter not in self.record.turning[place] or (once and not self._long(place)):
                continue
            if self.nodes[place].operation == "item" and uses[place] == 1:
                continue
            text, kind = bare(self._expression(place)), "bool" if self.nodes[place].operation in CONDITIONS else "real"
            self.names[place] = self._name(place)
            lines.append(f"const {kind} {self.names[place]} = {text};")
        for column, place in enumerate(body.stored):
            at = f"[i][{column}]" if wide else "[i]"
            lines.append(f"{target}{at} = {bare(self.text(place))};")
        for name, terms in zip(sums, body.added, strict=True):
            lines += [f"{name} = {name} + {self.text(place)};" for place in terms]
        self.given = outside
        return lines

    def _long(self, place: int) -> bool:
        reads = self.reads
        long = len(self._expression(place)) > LONGEST
        self.reads = reads
        return long

    def _with_stores(self, lines: list[Line], outputs: list[Output]) -> list[str]:
        """The statements, with what is stored as early as it may be."""
        waiting: dict[int, list[str]] = {}
        targets = {one.target for one in outputs}
        made = {name: number for number, line in enumerate(lines) for name in declared(line.text)}
        for target, place in outputs:
            source = self.text(place)
            read = self._taken_reads()
            if source == target:
                continue
            last = max((number for number, line in enumerate(lines) if target in line.reads), default=-1)
            last = max(last, made.get(source, -1))
            if read & targets:  # another target's former value: it goes before that is stored
                waiting.setdefault(-1, []).append(f"const real {self._name(-1, 'before')} = {source};")
                source = waiting[-1][-1].split()[2]
            waiting.setdefault(last, []).append(f"{target} = {bare(source)};")
        written: list[str] = [*(text for text in waiting.get(-1, []) if text.startswith("const"))]
        written += [text for text in waiting.get(-1, []) if not text.startswith("const")]
        origin = ""
        for number, line in enumerate(lines):
            if line.origin and line.origin != origin:
                origin = line.origin
                written.append(f"/* {origin} */")
            written += line.text
            written += waiting.get(number, [])
        return written


def bare(text: str) -> str:
    """An expression without the brackets around the whole of it."""
    if not text.startswith("("):
        return text
    depth = 0
    for place, sign in enumerate(text):
        depth += (sign == "(") - (sign == ")")
        if depth == 0:
            return text[1:-1] if place == len(text) - 1 else text
    return text


def declared(lines: list[str]) -> list[str]:
    """Locals that a statement declares."""
    return [found[1] for line in lines if (found := re.match(r"(?:const )?(?:real|bool) (\w+)", line))]

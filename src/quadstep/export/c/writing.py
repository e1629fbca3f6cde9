"""Recorded numbers as statements of C99.

A number that a law names, or that is used more than once, becomes a local; one used once is written inline. A
result is stored as soon as nothing reads the value that it replaces, so that few numbers are alive at a time. New rows of an
array are computed in place if nothing reads its old rows later.
"""

import re
from collections import Counter

from quadstep.export.c.branches import FILLED, SCAN, branches, pairs
from quadstep.export.c.expressions import INDICES, CStatement, Statements, braced, commented
from quadstep.export.c.structs import StoredStructures, StructOutput, has_numbers, literal, members, unbracketed
from quadstep.program.assignments import INPUT
from quadstep.program.rows import LEFT, LoopBody


class CWriter(Statements):
    """Writes the numbers of one record as the body of one function."""

    def body(self, results: StoredStructures) -> list[str]:
        """The statements that assign numbers and arrays to their targets."""
        return self._with_stores(self._block(results, ""), results.numbers)

    def _block(self, results: StoredStructures, counter: str) -> list[CStatement]:
        """The statements of a function, or of one turn of a scan."""
        wanted = {one.place for one in (*results.numbers, *results.arrays) if not self.leaf(one.place)}
        self.uses = Counter()
        needed = self._count(wanted, counter)
        arrays = list(results.arrays)
        lines: list[CStatement] = []
        for place in needed:
            if place in self.record.scans:
                lines += self._memory(place)
                arrays += self.record.scans[place].begin.arrays
        storage = self._storage(needed, arrays)
        joined = self._joined(needed)
        later = {place for places in joined.values() for place in places}
        both = pairs(self.nodes, needed)
        choices = branches(self.nodes, needed, wanted, both)
        with_last = {one for found in choices.values() for one in found.choices[:-1]}
        inner = with_last.union(*(side for found in choices.values() for side in found.sides))
        self.pairs |= both
        self.branches |= choices
        self.with_last |= with_last
        for place in needed:
            operation = self.nodes[place].operation
            if operation == "loop":
                if place not in later:
                    lines += self._loop([place, *joined.get(place, ())], storage)
            elif operation == SCAN:
                lines.append(self._scan(place))
            elif operation == FILLED:
                lines += self._filled(place)
            elif operation not in ("sum", LEFT) and place not in inner:
                lines += self._number(place, place in wanted)
        return lines

    # What is needed, and where it is stored

    def _count(self, wanted: set[int], counter: str) -> list[int]:
        """The numbers to be computed here, in order; counts how often each is used."""
        inside = {place for place in wanted if not counter or counter in self.record.turning[place]}
        for place in range(max(wanted, default=-1), -1, -1):
            if place not in inside:
                continue
            node = self.nodes[place]
            weight = 2 if node.operation in ("loop", SCAN) else 1  # a loop uses a number repeatedly
            for operand in node.operands:
                self.uses[operand] += weight
                if (not counter or counter in self.record.turning[operand]) and not self.leaf(operand):
                    inside.add(operand)
        return sorted(inside)

    def _storage(self, needed: list[int], arrays: list[StructOutput]) -> dict[int, str]:
        """Where arrays are made: results at their target, and the arrays that they are made from there too, if possible."""
        storage = {one.place: one.target for one in arrays}
        waiting = list(storage)
        while waiting:
            place = waiting.pop()
            made = self.record.loops[place]
            readers = [one for one in needed if self._reads_array(one, storage[place])]
            for source in self.nodes[place].operands:
                body = self.record.loops.get(source)
                if body is None or source in storage or source not in needed or len(body.stored) != len(made.stored):
                    continue
                if body.stored and body.rows == made.rows and all(one <= source for one in readers):
                    storage[source] = storage[place]
                    waiting.append(source)
        return storage

    def _joined(self, needed: list[int]) -> dict[int, list[int]]:
        """By loop, the loops that only sum over its new rows and older arrays: they share its turns."""
        joined: dict[int, list[int]] = {}
        for place in needed:
            body = self.record.loops.get(place)
            if body is None or body.stored:
                continue
            makers = [one for one in self.nodes[place].operands if one in self.record.loops]
            others = [one for one in self.nodes[place].operands if one not in makers]
            if len(makers) != 1 or makers[0] not in needed or not all(map(self.leaf, others)):
                continue
            if self.record.loops[makers[0]].rows == body.rows:
                joined.setdefault(makers[0], []).append(place)
        return joined

    def _reads_array(self, place: int, target: str) -> bool:
        """Whether an assignment uses entries of the array of this name."""
        node = self.nodes[place]
        if node.operation not in ("item", "loop", SCAN):
            return False
        return any(self.nodes[operand].text == target for operand in node.operands)

    # Statements

    def _filled(self, place: int) -> list[CStatement]:
        """An array whose entries are assigned one by one."""
        node = self.nodes[place]
        name = self.names[place] = self.name(place, "rows")
        columns = int(node.text.rpartition("[")[2][:-1])
        entries = [
            f"{name}[{at // columns}][{at % columns}] = {unbracketed(self.text(one))};" for at, one in enumerate(node.operands)
        ]
        return [CStatement([f"real {name}{node.text};", *entries], self.reads_since(), self._origin(place))]

    def _memory(self, place: int) -> list[CStatement]:
        scan = self.record.scans[place]
        name = self.memories[scan.counter] = self.name(-1, re.sub(r"\W", "", scan.step, flags=re.ASCII).strip("_") or "turn")
        if not has_numbers(scan.memory):
            return []
        lines = ["struct", "{", *members(scan.memory, lambda _: ""), f"}} {name};"]
        return [CStatement(lines, frozenset(), self._origin(place))]

    def _scan(self, place: int) -> CStatement:
        """A loop around the statements of its step."""
        scan, last = self.record.scans[place], self.record.scans[place].turns - 1
        index = self.indices[scan.counter] = INDICES[self.depth]
        around, self.all_reads = self.all_reads, set()
        begin = [f"{self.scoped(target)} = {unbracketed(self.text(one))};" for target, one in scan.begin.numbers]
        names, given, uses = dict(self.names), set(self.given), self.uses
        self.depth += 1
        turn = self._with_stores(self._block(scan.turn, scan.counter), scan.turn.numbers)
        self.depth -= 1
        self.reads_since()
        self.names, self.given, self.uses = names, given, uses
        reads, self.all_reads = frozenset(self.all_reads), around | self.all_reads
        head = f"{last}; {index} >= 0; --{index}" if scan.backwards else f"0; {index} < {scan.turns}; ++{index}"
        lines = [*begin, f"for (int32_t {index} = {head})", *braced(turn)]
        return CStatement(lines, reads, self._origin(place), (self.memories[scan.counter],))

    def _loop(self, places: list[int], storage: dict[int, str]) -> list[CStatement]:
        """Loops over the same rows merged into one, with the statements that they need first."""
        before: list[CStatement] = []
        inner: list[str] = []
        origin = self._origin(places[0])
        index = INDICES[self.depth]
        made: list[str] = []
        inside: set[str] = set()
        sums_of = {place: self._sums(place, len(self.record.loops[place].added)) for place in places}  # not a name of a turn
        for place in places:
            body = self.record.loops[place]
            self.indices[body.counter] = index
            if self._stays(place, storage):
                self.names[place] = self.scoped(storage[place])
                continue
            before += self._before(place)
            if body.stored and place not in storage:
                storage[place] = self.name(place, "rows")
                width = f"[{len(body.stored)}]" if self._wide(place) else ""
                before.append(CStatement([f"real {storage[place]}[{body.rows}]{width};"], frozenset(), origin))
            if body.stored:
                self.names[place] = self.scoped(storage[place])
            sums = sums_of[place]
            before += [CStatement([f"real {name} = {literal(0.0, self.precise)};"], frozenset(), origin) for name in sums]
            made += sums
            outside = set(self.given)
            inner += self._turn(body, self.names.get(place), sums, self._wide(place))
            inside |= self.given - outside
        self.given -= inside
        if not inner:
            return before
        rows = self.record.loops[places[0]].rows
        text = [f"for (int32_t {index} = 0; {index} < {rows}; ++{index})", *braced(inner)]
        return [*before, CStatement(text, self.reads_since(), origin, tuple(made))]

    def _stays(self, place: int, storage: dict[int, str]) -> bool:
        """Whether a loop would copy an array onto itself."""
        body, nodes = self.record.loops[place], [self.nodes[one] for one in self.record.loops[place].stored]
        sources = {node.operands for node in nodes}
        if len(sources) != 1 or any(node.operation != "item" for node in nodes):
            return False
        (source,) = sources.pop()
        columns = [f"[{body.counter}]"] if len(nodes) == 1 else []
        rows = [f"[{body.counter}][{column}]" for column in range(len(nodes))]
        return source in storage and storage[source] == storage.get(place) and [one.text for one in nodes] in (columns, rows)

    def _before(self, place: int) -> list[CStatement]:
        """Locals for the numbers in memory that a loop uses."""
        return [
            self._hoisted(operand)
            for operand in self.nodes[place].operands
            if self.nodes[operand].operation == INPUT and operand not in self.names
            if not any(node.operation == "item" and node.operands[0] == operand for node in self.nodes)  # an array
        ]

    def _hoisted(self, place: int) -> CStatement:
        """A local for an input, so that a loop need not read it from memory each time."""
        source = self.scoped(self.nodes[place].text)
        name = self.name(place, re.split(r"->|\.", source)[-1].replace("[", "_").replace("]", ""))
        self.names[place] = name
        return CStatement([f"const real {name} = {source};"], frozenset((source,)), "")

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
            names.append(self.name(at, "sum"))
            if at >= 0:
                self.names[at] = names[-1]
        return names

    def _turn(self, body: LoopBody, target: str | None, sums: list[str], wide: bool) -> list[str]:
        results = [*body.stored, *(place for terms in body.added for place in terms)]
        uses: Counter[int] = Counter(results)
        inside = set(results)
        for place in range(max(results), -1, -1):
            if place in inside and body.counter in self.record.turning[place]:
                uses.update(self.nodes[place].operands)
                inside.update(self.nodes[place].operands)
        lines = []
        for place in sorted(inside):
            once = uses[place] == 1 and place not in self.naming.names
            if body.counter not in self.record.turning[place] or (once and not self.long(place)):
                continue
            if self.nodes[place].operation == "item" and uses[place] == 1:
                continue
            text = unbracketed(self.expression(place))
            self.names[place] = self.name(place)
            lines.append(f"const {self.kind(place)} {self.names[place]} = {text};")
        for column, place in enumerate(body.stored):
            at = f"[{self.indices[body.counter]}]" + (f"[{column}]" if wide else "")
            lines.append(f"{target}{at} = {unbracketed(self.text(place))};")
        for name, terms in zip(sums, body.added, strict=True):
            lines += [f"{name} = {name} + {self.text(place)};" for place in terms]
        return lines

    def _with_stores(self, lines: list[CStatement], outputs: list[StructOutput]) -> list[str]:
        """The statements, with results stored as early as possible."""
        waiting: dict[int, list[str]] = {}
        placed = [(self.scoped(target), place) for target, place in outputs]
        targets = {target for target, _ in placed}
        made = {name: number for number, line in enumerate(lines) for name in (*declared(line.text), *line.makes)}
        for target, place in placed:
            source = self.text(place)
            read = self.reads_since()
            if source == target:
                continue
            last = max((number for number, line in enumerate(lines) if touched(target, line.reads)), default=-1)
            last = max(last, made.get(re.split(r"[.[]", source)[0], -1))
            if any(touched(one, read) for one in targets):  # another target's former value: it goes before that is stored
                waiting.setdefault(-1, []).append(f"const real {self.name(-1, 'before')} = {source};")
                source = waiting[-1][-1].split()[2]
            waiting.setdefault(last, []).append(f"{target} = {unbracketed(source)};")
        first = waiting.pop(-1, [])
        first.sort(key=lambda text: not text.startswith("const"))
        return first + commented(
            [line._replace(text=line.text + waiting.get(number, [])) for number, line in enumerate(lines)]
        )


def touched(target: str, reads: frozenset[str]) -> bool:
    """Whether a target, or the array that it is an entry of, is among what is read."""
    return target in reads or any(target.startswith(f"{one}[") for one in reads)


def declared(lines: list[str]) -> list[str]:
    return [found[1] for line in lines if (found := re.match(r"(?:const )?(?:real|bool) (\w+)", line))]

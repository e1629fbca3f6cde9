"""Recorded assignments as JavaScript statements, in functions of a size that a browser's compiler takes.

A result that is used once is written into its user; one that is used again becomes a local, or, from one function to a later
one, a place in an array. What depends on the parameters alone is computed once per flight.
"""

from collections import Counter
from collections.abc import Iterable
from typing import NamedTuple

from quadstep.program.assignments import ARRAY, CONSTANT, INPUT, ITEM, LOOP, STATEMENTS, LoopAssignment, Record
from quadstep.program.operations import CONDITIONS, constant_text, in_javascript

DEEPEST = 40
"""Operations within each other before a local is made."""

LONGEST = 600
"""Operations in one function."""


class Output(NamedTuple):
    """target: what the result is assigned to, as text. place: of the number in the record."""

    target: str
    place: int


class Layout(NamedTuple):
    """chunks: the locals of each function, in order. carried: where those wait that a later function takes."""

    chunks: list[list[int]]
    carried: dict[int, str]


class Writer:
    """Writes the numbers of one record.

    fixed: names of inputs that stay the same during a flight. X and K are the arrays for numbers on their way from function to
    function, and for what is computed once a flight.
    """

    def __init__(self, record: Record, fixed: Iterable[str]) -> None:
        self.nodes = record.nodes
        self.loops: dict[int, LoopAssignment] = getattr(record, "loops", {})
        self.arrays: dict[str, int] = getattr(record, "arrays", {})
        self.steady = self._steady(set(fixed))
        self.kept: dict[int, int] = {}
        self.carried = 0

    def _steady(self, fixed: set[str]) -> list[bool]:
        steady: list[bool] = []
        for node in self.nodes:
            known = node.text in fixed if node.operation == INPUT else all(steady[place] for place in node.operands)
            steady.append(known and node.operation not in STATEMENTS and node.operation != ITEM)
        return steady

    def declarations(self) -> str:
        return "".join(f"const {name}=new Float64Array({max(size, 1)});" for name, size in self.arrays.items())

    def leaf(self, place: int) -> bool:
        """Whether a number is there without computing: an input, a constant, or computed once a flight."""
        return self.nodes[place].operation in (CONSTANT, INPUT) or place in self.kept

    def keep_steady(self, outputs: Iterable[Output]) -> None:
        """From now on take what can be computed once a flight, as far as these results need it, from its array."""
        seen: set[int] = set()
        waiting = [output.place for output in outputs]
        while waiting:
            place = waiting.pop()
            if place in seen or self.leaf(place):
                continue
            seen.add(place)
            if self.steady[place] and self.nodes[place].operation not in CONDITIONS:
                self.kept[place] = len(self.kept)
            else:
                waiting += self.nodes[place].operands

    def preparation(self) -> list[str]:
        """Functions' statements that compute what is the same for a whole flight."""
        kept, self.kept = self.kept, {}
        functions = self.functions([Output(f"K[{place}]", number) for number, place in kept.items()])
        self.kept = kept
        return functions

    def functions(self, outputs: list[Output]) -> list[str]:
        """Statements of one function after the other; the last one assigns the outputs, after everything is computed."""
        layout = self._layout(outputs)
        self.carried = max(self.carried, len(layout.carried))
        made: set[int] = set()
        texts = []
        for number, chunk in enumerate(layout.chunks):
            final = outputs if number == len(layout.chunks) - 1 else []
            texts.append(self._text(chunk, final, layout, made))
            made.update(chunk)
        return texts

    def _layout(self, outputs: list[Output]) -> Layout:
        results = {output.place for output in outputs if not self.leaf(output.place)}
        locals_ = self._locals(results, set())
        known = set(locals_)
        taken = {place: self._operands(place, known) for place in locals_}
        chunks: list[list[int]] = [[]]
        size = 0
        for place in locals_:
            size += len(taken[place])
            if size > LONGEST and chunks[-1]:
                chunks.append([])
                size = len(taken[place])
            chunks[-1].append(place)
        home = {place: number for number, chunk in enumerate(chunks) for place in chunk}
        crossing = {operand for place in locals_ for operand in taken[place] if home.get(operand, len(chunks)) < home[place]}
        crossing |= {place for place in results if home[place] < len(chunks) - 1}
        crossing = {place for place in crossing if self.nodes[place].operation not in STATEMENTS}
        return Layout(chunks, {place: f"X[{i}]" for i, place in enumerate(sorted(crossing))})

    def _locals(self, results: set[int], given: set[int]) -> list[int]:
        """The numbers that get a name, and statements, in order. given: what has a name already."""
        uses, needed = self._uses(results, given)
        named = {operand for place in needed if self.nodes[place].operation == LOOP for operand in self.nodes[place].operands}
        locals_: list[int] = []
        depth: dict[int, int] = {}
        for place in needed:
            depth[place] = 1 + max((depth.get(operand, 0) for operand in self.nodes[place].operands), default=0)
            stands = place in results or place in named or self.nodes[place].operation in STATEMENTS
            if uses[place] > 1 or stands or depth[place] > DEEPEST:
                locals_.append(place)
                depth[place] = 0
        return locals_

    def _uses(self, results: set[int], given: set[int]) -> tuple[Counter[int], list[int]]:
        """How often each number is used, and those to be computed, in order."""
        uses: Counter[int] = Counter()
        needed = set(results)
        for place in range(max(results, default=-1), -1, -1):
            if place in needed:
                operands = self.nodes[place].operands
                uses.update(operands)
                needed.update(operand for operand in operands if not self.leaf(operand) and operand not in given)
        return uses, sorted(needed)

    def _operands(self, place: int, known: set[int]) -> list[int]:
        """The locals and leaves that the text of a local takes, one entry each time."""
        taken, waiting = [], list(self.nodes[place].operands)
        while waiting:
            operand = waiting.pop()
            if self.leaf(operand) or operand in known:
                taken.append(operand)
            else:
                waiting += self.nodes[operand].operands
        return taken

    def _text(self, chunk: list[int], final: list[Output], layout: Layout, made: set[int]) -> str:
        own = set(chunk)
        known = own | made
        wanted = Counter(place for local in chunk for place in self._operands(local, known))
        assigned = {output.place for output in final}  # an output may stand where another one comes from
        wanted.update(assigned)
        names: dict[int, str] = {}
        lines = []
        for place, count in sorted(wanted.items()):
            if place in own or self.nodes[place].operation in STATEMENTS:
                continue
            text = layout.carried.get(place) or self._leaf_text(place)
            if "[" in text and (count > 1 or place in assigned):
                lines.append(f"const v{place}={text};")
                text = f"v{place}"
            names[place] = text
        for place in chunk:
            lines.append(self._statement(place, names))
            if place in layout.carried:
                sign = "+" if self.nodes[place].operation in CONDITIONS else ""
                lines.append(f"{layout.carried[place]}={sign}v{place};")
        return "".join([*lines, *(f"{output.target}={names[output.place]};" for output in final)])

    def _statement(self, place: int, names: dict[int, str]) -> str:
        """What computes a local, which has its name from then on."""
        node = self.nodes[place]
        names[place] = ""
        if node.operation == ARRAY:
            return "".join(f"{node.text}[{i}]={self._named(one, names)};" for i, one in enumerate(node.operands))
        if node.operation == LOOP:
            return self._loop(self.loops[place], names)
        text = f"const v{place}={self._written(place, names)};"
        names[place] = f"v{place}"
        return text

    def _loop(self, loop: LoopAssignment, names: dict[int, str]) -> str:
        """A loop around the statements of its step; all that a turn leaves is computed before any of it is written down."""
        inside = dict(names)
        results = {place for _, place in loop.results if not self.leaf(place) and place not in names}
        lines = [f"{loop.state}[{i}]={self._named(place, names)};" for i, place in enumerate(loop.begin)]
        turns = "{0}={1};{0}>=0;{0}--" if loop.backwards else "{0}=0;{0}<{1};{0}++"
        lines.append(f"for(let {turns.format(loop.counter, loop.turns - loop.backwards)}){{")
        lines += [self._statement(place, inside) for place in self._locals(results, set(names))]
        lines += [f"{target}={self._named(place, inside)};" for target, place in loop.results]
        return "".join([*lines, "}"])

    def _named(self, place: int, names: dict[int, str]) -> str:
        """A number by its name, or written out."""
        return names.get(place) or (self._leaf_text(place) if self.leaf(place) else self._written(place, names))

    def _leaf_text(self, place: int) -> str:
        if place in self.kept:
            return f"K[{self.kept[place]}]"
        node = self.nodes[place]
        return constant_text(float(node.text)) if node.operation == CONSTANT else node.text

    def _written(self, place: int, names: dict[int, str]) -> str:
        """The operation of a number around its operands, those without a name written out in turn."""
        node = self.nodes[place]
        if node.operation == ITEM:
            return node.text
        return in_javascript(node.operation, [self._named(operand, names) for operand in node.operands])

"""Recorded assignments as JavaScript statements, in functions of a size that a browser's compiler takes.

A result that is used once is written into its user; one that is used again becomes a local, or, from one function to a later
one, a place in an array. What depends on the parameters alone is computed once per flight.
"""

from collections import Counter
from collections.abc import Iterable
from typing import NamedTuple

from quadstep.numbers.script import CONDITIONS, CONSTANT, INPUT, Record, constant_text
from quadstep.numbers.script_functions import JAVASCRIPT

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

    fixed: names of inputs that stay the same during a flight. carry, constants: names of the arrays for numbers on their way
    from function to function, and for what is computed once a flight.
    """

    def __init__(self, record: Record, fixed: Iterable[str], carry: str = "X", constants: str = "K") -> None:
        self.nodes, self.carry, self.constants = record.nodes, carry, constants
        self.steady = self._steady(set(fixed))
        self.kept: dict[int, int] = {}
        self.carried = 0

    def _steady(self, fixed: set[str]) -> list[bool]:
        steady: list[bool] = []
        for node in self.nodes:
            steady.append(node.text in fixed if node.operation == INPUT else all(steady[place] for place in node.operands))
        return steady

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
        functions = self.functions([Output(f"{self.constants}[{place}]", number) for number, place in kept.items()])
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
        uses, needed = self._uses(results)
        locals_: list[int] = []
        depth: dict[int, int] = {}
        for place in needed:
            depth[place] = 1 + max((depth.get(operand, 0) for operand in self.nodes[place].operands), default=0)
            if uses[place] > 1 or place in results or depth[place] > DEEPEST:
                locals_.append(place)
                depth[place] = 0
        known = set(locals_)
        taken = {place: self._taken(place, known) for place in locals_}
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
        return Layout(chunks, {place: f"{self.carry}[{i}]" for i, place in enumerate(sorted(crossing))})

    def _uses(self, results: set[int]) -> tuple[Counter[int], list[int]]:
        """How often each number is used, and those to be computed, in order."""
        uses: Counter[int] = Counter()
        needed = set(results)
        for place in range(max(results, default=-1), -1, -1):
            if place in needed:
                operands = self.nodes[place].operands
                uses.update(operands)
                needed.update(operand for operand in operands if not self.leaf(operand))
        return uses, sorted(needed)

    def _taken(self, place: int, known: set[int]) -> list[int]:
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
        """The statements of one function."""
        own = set(chunk)
        known = own | made
        wanted = Counter(place for local in chunk for place in self._taken(local, known))
        assigned = {output.place for output in final}  # an output may stand where another one comes from
        wanted.update(assigned)
        names: dict[int, str] = {}
        lines = []
        for place, count in sorted(wanted.items()):
            if place in own:
                continue
            text = layout.carried.get(place) or self._leaf_text(place)
            if "[" in text and (count > 1 or place in assigned):
                lines.append(f"const v{place}={text};")
                text = f"v{place}"
            names[place] = text
        for place in chunk:
            lines.append(f"const v{place}={self._written(place, names)};")
            names[place] = f"v{place}"
            if place in layout.carried:
                sign = "+" if self.nodes[place].operation in CONDITIONS else ""
                lines.append(f"{layout.carried[place]}={sign}v{place};")
        return "".join([*lines, *(f"{output.target}={names[output.place]};" for output in final)])

    def _leaf_text(self, place: int) -> str:
        if place in self.kept:
            return f"{self.constants}[{self.kept[place]}]"
        node = self.nodes[place]
        return constant_text(float(node.text)) if node.operation == CONSTANT else node.text

    def _written(self, place: int, names: dict[int, str]) -> str:
        """The operation of a number around its operands, those without a name written out in turn."""
        node = self.nodes[place]
        operands = (names[operand] if operand in names else self._written(operand, names) for operand in node.operands)
        return JAVASCRIPT[node.operation].format(*operands)

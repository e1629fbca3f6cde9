"""Script numbers: pass them to a law, and the result is a list of assignments, to be written as JavaScript or C.

Constants fold (x * 0, x * 1, x + 0) and nothing is computed twice, as in lanes. Nothing is reassociated or
contracted: each assignment is one operation, so on doubles a script agrees with Python floats to the bit. NaN and
infinity keep their meaning. No external text enters: names are made from places in arrays.
"""

from __future__ import annotations

from typing import Any, ClassVar, NamedTuple, TypeAlias, cast

from quadstep.numbers.functions import entry
from quadstep.numbers.kinds import Number
from quadstep.numbers.python_operators import CHOOSE, PythonOperators


class Node(NamedTuple):
    """One assignment. operands: earlier places in the record. text: of an input; of a constant, as Python writes it."""

    operation: str
    operands: tuple[int, ...] = ()
    text: str = ""


CONSTANT, INPUT = "constant", "input"
CONDITIONS = frozenset(("<", "<=", ">", ">=", "==", "!=", "and", "or", "not", "bit"))
COMMUTATIVE = frozenset("+*")


class Record:
    """The assignments so far, each once, operands before their users."""

    def __init__(self) -> None:
        self.nodes: list[Node] = []
        self.known: dict[Node, int] = {}

    def place(self, operation: str, *operands: int, text: str = "") -> int:
        """The place of this assignment, new or as recorded before."""
        node = Node(operation, operands, text)
        if node not in self.known:
            self.known[node] = len(self.nodes)
            self.nodes.append(node)
        return self.known[node]

    def input(self, text: str) -> ScriptNumber:
        """A number that the script finds under this name."""
        return ScriptNumber(self, self.place(INPUT, text=text))

    def at(self, number: Operand) -> int:
        """The place of a number, which may be a Python one."""
        return number.place if isinstance(number, ScriptNumber) else self.place(CONSTANT, text=repr(float(number)))


def constant_text(value: float) -> str:
    """A Python float as a JavaScript literal; the same double."""
    if value != value:  # noqa: PLR0124 (NaN)
        return "NaN"
    text = repr(value).replace("inf", "Infinity").removesuffix(".0")
    return f"({text})" if text.startswith("-") else text


class ScriptCondition:
    """The result of comparing script numbers."""

    __slots__ = ("place", "record")

    def __init__(self, record: Record, place: int) -> None:
        self.record, self.place = record, place

    @property
    def functions(self) -> object:
        """The functions of script numbers (used by `where`)."""
        return ScriptNumber.functions

    def __and__(self, other: ScriptCondition) -> ScriptCondition:
        return ScriptCondition(self.record, self.record.place("and", self.place, other.place))

    def __or__(self, other: ScriptCondition) -> ScriptCondition:
        return ScriptCondition(self.record, self.record.place("or", self.place, other.place))

    def __invert__(self) -> ScriptCondition:
        return ScriptCondition(self.record, self.record.place("not", self.place))

    def __bool__(self) -> bool:
        raise TypeError(f"a script number cannot decide a branch: {CHOOSE}")


class ScriptNumber(PythonOperators):
    """A number that the script will compute."""

    __slots__ = ("place", "record")
    functions: ClassVar[object] = None  # set by quadstep.numbers.script_functions

    def __init__(self, record: Record, place: int) -> None:
        self.record, self.place = record, place

    def _write(self, operation: str, a: Operand, b: Operand) -> ScriptNumber:
        places = self.record.at(a), self.record.at(b)
        if operation in COMMUTATIVE:
            places = min(places), max(places)
        return ScriptNumber(self.record, self.record.place(operation, *places))

    def __add__(self, other: Operand) -> Operand:
        if not isinstance(other, OPERANDS):
            return NotImplemented
        return self if is_constant(other, 0) else self._write("+", self, other)

    __radd__ = __add__

    def __sub__(self, other: Operand) -> Operand:
        if not isinstance(other, OPERANDS):
            return NotImplemented
        return self if is_constant(other, 0) else self._write("-", self, other)

    def __rsub__(self, other: Operand) -> Operand:
        return -self if is_constant(other, 0) else self._write("-", other, self)

    def __mul__(self, other: Operand) -> Operand:
        if not isinstance(other, OPERANDS):
            return NotImplemented
        for value, result in ((0, 0.0), (1, self)):
            if is_constant(other, value):
                return result
        return -self if is_constant(other, -1) else self._write("*", self, other)

    __rmul__ = __mul__

    def __truediv__(self, other: Operand) -> Operand:
        return self if is_constant(other, 1) else self._write("/", self, other)

    def __rtruediv__(self, other: Operand) -> Operand:
        return 0.0 if is_constant(other, 0) else self._write("/", other, self)

    def __neg__(self) -> ScriptNumber:
        before = self.record.nodes[self.place]
        inner = before.operands[0] if before.operation == "negative" else self.record.place("negative", self.place)
        return ScriptNumber(self.record, inner)

    def __abs__(self) -> ScriptNumber:
        return ScriptNumber(self.record, self.record.place("magnitude", self.place))

    def _compare(self, operation: str, other: Operand) -> ScriptCondition:
        return ScriptCondition(self.record, self.record.place(operation, self.place, self.record.at(other)))

    def __lt__(self, other: Operand) -> ScriptCondition:
        return self._compare("<", other)

    def __le__(self, other: Operand) -> ScriptCondition:
        return self._compare("<=", other)

    def __gt__(self, other: Operand) -> ScriptCondition:
        return self._compare(">", other)

    def __ge__(self, other: Operand) -> ScriptCondition:
        return self._compare(">=", other)

    def __eq__(self, other: object) -> Any:
        return self._compare("==", cast(Operand, other))

    def __ne__(self, other: object) -> Any:
        return self._compare("!=", cast(Operand, other))

    __hash__ = None  # type: ignore[assignment]

    def __bool__(self) -> bool:
        raise TypeError(f"a script number has no truth value: {CHOOSE}")


OPERANDS = (ScriptNumber, float, int)
Operand: TypeAlias = ScriptNumber | float


def is_constant(other: object, value: int) -> bool:
    """Whether an operand is this Python number (a script number is never one)."""
    return isinstance(other, float | int) and other == value


class ScriptTable:
    """A table that the script finds, as a typed array, under this name."""

    def __init__(self, record: Record, name: str, size: int) -> None:
        self.record, self.size = record, size
        self.place = record.place(INPUT, text=name)

    def at(self, index: Number) -> ScriptNumber:
        """The entry at a whole index; see `entry`."""
        place = self.record.at(entry(index, self.size))
        return ScriptNumber(self.record, self.record.place("entry", self.place, place))

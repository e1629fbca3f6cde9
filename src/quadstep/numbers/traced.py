"""Traced numbers: each is a text that stands for a number in a Python function which is being written (`python_code.py`)."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, ClassVar, TypeAlias, cast

from quadstep.numbers.functions import entry
from quadstep.numbers.kinds import Number
from quadstep.numbers.linear import Matrix, Vector
from quadstep.numbers.operation import Elementary
from quadstep.numbers.python_operators import CHOOSE, PythonOperators
from quadstep.numbers.scan import C, Rows, Step, scan
from quadstep.numbers.structure import flatten

if TYPE_CHECKING:
    from quadstep.numbers.python_code import Code


class Traced(PythonOperators):
    """A number, by the text that stands for it."""

    __slots__ = ("code", "text")
    functions: ClassVar[TracedFunctions]

    def __init__(self, code: Code, text: str) -> None:
        self.code, self.text = code, text

    def __add__(self, other: Operand) -> Traced:
        return self.code.number("{} + {}", self, other) if isinstance(other, OPERANDS) else NotImplemented

    def __radd__(self, other: float) -> Traced:
        return self.code.number("{} + {}", other, self)

    def __sub__(self, other: Operand) -> Traced:
        return self.code.number("{} - {}", self, other) if isinstance(other, OPERANDS) else NotImplemented

    def __rsub__(self, other: float) -> Traced:
        return self.code.number("{} - {}", other, self)

    def __mul__(self, other: Operand) -> Traced:
        return self.code.number("{} * {}", self, other) if isinstance(other, OPERANDS) else NotImplemented

    def __rmul__(self, other: float) -> Traced:
        return self.code.number("{} * {}", other, self)

    def __truediv__(self, other: Operand) -> Traced:
        return self.code.number("{} / {}", self, other)

    def __rtruediv__(self, other: float) -> Traced:
        return self.code.number("{} / {}", other, self)

    def __neg__(self) -> Traced:
        return self.code.number("-{}", self)

    def __abs__(self) -> Traced:
        return self.code.number("abs({})", self)

    def __lt__(self, other: Operand) -> TracedCondition:
        return self.code.condition("{} < {}", self, other)

    def __le__(self, other: Operand) -> TracedCondition:
        return self.code.condition("{} <= {}", self, other)

    def __gt__(self, other: Operand) -> TracedCondition:
        return self.code.condition("{} > {}", self, other)

    def __ge__(self, other: Operand) -> TracedCondition:
        return self.code.condition("{} >= {}", self, other)

    def __eq__(self, other: object) -> TracedCondition:  # type: ignore[override]
        return self.code.condition("{} == {}", self, cast(Operand, other))

    def __ne__(self, other: object) -> TracedCondition:  # type: ignore[override]
        return self.code.condition("{} != {}", self, cast(Operand, other))

    __hash__ = None  # type: ignore[assignment]

    def __bool__(self) -> bool:
        raise TypeError(f"a traced number has no truth value: {CHOOSE}")


OPERANDS = (Traced, float, int)
Operand: TypeAlias = Traced | float


class TracedCondition:
    """The result of a comparison, by the text that stands for it."""

    __slots__ = ("code", "text")
    functions: ClassVar[TracedFunctions]

    def __init__(self, code: Code, text: str) -> None:
        self.code, self.text = code, text

    def __and__(self, other: TracedCondition) -> TracedCondition:
        return self.code.condition("{} and {}", self, other)

    def __or__(self, other: TracedCondition) -> TracedCondition:
        return self.code.condition("{} or {}", self, other)

    def __invert__(self) -> TracedCondition:
        return self.code.condition("not {}", self)

    def __bool__(self) -> bool:
        raise TypeError(f"a traced number cannot decide a branch: {CHOOSE}")


class TracedWord:
    """Bits of a number as a Python integer, by the text that stands for it."""

    __slots__ = ("code", "text")
    functions: ClassVar[TracedFunctions]

    def __init__(self, code: Code, text: str) -> None:
        self.code, self.text = code, text

    def _with(self, sign: str, other: TracedWord | int) -> TracedWord:
        right = other.text if isinstance(other, TracedWord) else str(other)
        return TracedWord(self.code, self.code.write(f"{self.text} {sign} {right}"))

    def __add__(self, other: TracedWord | int) -> TracedWord:
        return self._with("+", other)

    def __and__(self, other: TracedWord | int) -> TracedWord:
        return self._with("&", other)

    def __or__(self, other: TracedWord | int) -> TracedWord:
        return self._with("|", other)

    def __xor__(self, other: TracedWord | int) -> TracedWord:
        return self._with("^", other)

    def __lshift__(self, bits: int) -> TracedWord:
        return self._with("<<", bits)

    def __rshift__(self, bits: int) -> TracedWord:
        return self._with(">>", bits)

    __radd__, __rand__, __ror__, __rxor__ = __add__, __and__, __or__, __xor__


class TracedTable:
    """A table, by the name of its list of floats."""

    def __init__(self, code: Code, text: str, size: int) -> None:
        self.code, self.text, self.size = code, text, size

    def at(self, index: Number) -> Traced:
        """The entry at a whole index; see `entry`."""
        place = self.code.text(cast(Operand, entry(index, self.size)))
        return self.code.number(f"real({self.text}[int({place})])")


class TracedMatrix(Matrix):
    """A matrix, by the text that stands for its rows: what is done to each of them is a loop."""

    __slots__ = ("code", "shape", "text")

    def __init__(self, code: Code, text: str, shape: tuple[int, int]) -> None:
        self.code, self.text, self.shape = code, text, shape

    @property
    def rows(self) -> tuple[Vector, ...]:  # type: ignore[override]
        """The entries one by one."""
        return tuple(self.row(place) for place in range(self.shape[0]))

    def row(self, place: int | str) -> Vector:
        """The row of this number, or of the counter of this name."""
        return Vector(cast(Number, Traced(self.code, f"{self.text}[{place}][{i}]")) for i in range(self.shape[1]))

    def __len__(self) -> int:
        return self.shape[0]

    def __matmul__(self, other: Vector | Matrix) -> Vector | Matrix:  # type: ignore[override]
        return self.map_rows(lambda row: row @ other) if isinstance(other, Vector) else super().__matmul__(other)

    def map_rows(self, function: Callable[[Vector], Number]) -> Vector:
        _, made = scan(lambda _, row: ((), Vector([function(row)])), (), self)
        return Vector(row[0] for row in made)


class TracedFunctions(Elementary):
    """The functions of `quadstep.numbers` for them."""

    def precise(self, x: Traced) -> bool:
        return x.code.precise

    def bit(self, x: Traced, place: int) -> TracedCondition:
        return x.code.condition(f"bit({{}}, {place})", x)

    def power(self, m: Traced) -> Traced:
        return m.code.number("power({})", m)

    def fraction(self, x: Traced) -> Traced:
        return x.code.number("fraction({})", x)

    def exponent(self, x: Traced) -> Traced:
        return x.code.number("exponent({})", x)

    def sqrt(self, x: Traced) -> Traced:
        return x.code.number("sqrt({})", x)

    def where(self, condition: TracedCondition | bool, yes: Operand, no: Operand) -> Operand:
        if not isinstance(condition, TracedCondition):
            return yes if condition else no
        return condition.code.number("{1} if {0} else {2}", condition, yes, no)

    def word(self, x: Traced) -> TracedWord:
        return TracedWord(x.code, x.code.write(f"word({x.text})"))

    def number(self, word: TracedWord) -> Traced:
        return Traced(word.code, word.code.write(f"real({word.text})"))

    def scan(self, step: Step[C], carry: C, rows: Rows[Matrix], count: int, backwards: bool) -> tuple[C, Rows[Matrix]]:
        """See `quadstep.numbers.scan`."""
        code = next(leaf.code for leaf in flatten((carry, rows)) if isinstance(leaf, Traced))
        return code.scan(step, carry, rows, count, backwards)


Traced.functions = TracedCondition.functions = TracedWord.functions = TracedFunctions()

"""Recorded numbers: pass them to a law, and what it computes is written into their record, operation by operation.

A record is a list of assignments (`assignments.py`), Python text (`python_code.py`) or LLVM instructions (`instructions.py`).
Nothing is reassociated or contracted, so that a recorded law agrees with Python floats to the bit, and NaN and infinity keep
their meaning. Where the record folds, x * 0 becomes 0, and x + 0, x * 1 and x / 1 become x: docs/decisions/0012-equal-bits.md.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import Any, ClassVar, NoReturn, Self, TypeAlias, TypeVar, cast

from quadstep.numbers.functions import entry
from quadstep.numbers.kinds import Number
from quadstep.numbers.operation import Kind, Operation, Rule
from quadstep.numbers.scan import C, Rows, Step, turn_by_turn
from quadstep.numbers.structure import flatten
from quadstep.numbers.vectors import Matrix

CHOOSE = "a law chooses with `where`, `maximum` and `minimum`, never with `if`, `and`, `or`, `max` or `min`"

INSTEAD = (
    "has no value while its law is recorded: take sin, cos, exp, log, sqrt, atan2, absolute, minimum and maximum "
    "from quadstep.numbers, not float(), int(), round(), math or numpy"
)


S = TypeVar("S")
T = TypeVar("T")

EVERY_BIT = 0xFFFFFFFF


class Recording(ABC):
    """Where recorded numbers write operations; `operations.py` has their names.

    precise: f64, not f32. folds: whether operations without effect are left out; words then have 32 bits. inline: whether
    elementary functions are written step by step, not called.
    """

    precise: bool = True
    folds: bool = True
    inline: bool = True

    @abstractmethod
    def write(self, operation: str, *operands: Operand | Recorded) -> Any:
        """What stands for the result of an operation. Of a word, and of a "bit", the last is an integer."""

    def same(self, one: Operand, other: Operand) -> bool:
        """Whether two numbers are known to be one."""
        return one is other

    def scan(self, step: Step[C], carry: C, rows: Rows[Matrix], count: int, backwards: bool) -> tuple[C, Rows[Matrix]]:
        """See `quadstep.numbers.scan`; without a loop, unless a record can hold one."""
        return turn_by_turn(step, carry, rows, count, backwards)

    def call(self, memory: dict[str, object], law: Callable[[S], T], structure: S) -> T:
        """See `quadstep.numbers.scan`; written again each time, unless a record can hold functions."""
        return law(structure)

    def shortcut(self, quick: Callable[[S], tuple[object, T]], law: Callable[[S], T], structure: S) -> T:
        """See `quadstep.numbers.scan`; not taken, unless a record can branch."""
        return law(structure)

    def opaque(self, handle: Number, inputs: Sequence[Number], outputs: int) -> list[Number]:
        """See `quadstep.numbers.scan`."""
        raise TypeError("an opaque function takes floats, arrays and lanes; it has no equations")


class Recorded:
    """place: what stands for it in its record."""

    __slots__ = ("place", "record")
    functions: ClassVar[RecordedFunctions]

    def __init__(self, record: Any, place: Any) -> None:
        self.record, self.place = record, place


def relation(operation: str) -> Callable[[Recorded, object], RecordedCondition]:
    return lambda one, other: RecordedCondition(one.record, one.record.write(operation, one, other))


class RecordedCondition(Recorded):
    """The result of comparing recorded numbers."""

    __slots__ = ()

    __and__, __or__ = relation("and"), relation("or")

    def __invert__(self) -> RecordedCondition:
        return RecordedCondition(self.record, self.record.write("not", self))

    def __bool__(self) -> NoReturn:
        raise TypeError(f"a recorded number cannot decide a branch: {CHOOSE}")


class RecordedNumber(Recorded):
    """A number that the recorded law will compute."""

    __slots__ = ()

    def _write(self, operation: str, a: Operand, b: Operand) -> RecordedNumber:
        return RecordedNumber(self.record, self.record.write(operation, a, b))

    def _folds(self, other: Operand, value: int) -> bool:
        """Whether an operand is this Python number, and operations with it are left out."""
        return other == value and bool(self.record.folds)

    def __add__(self, other: Operand) -> Operand:
        if not isinstance(other, RecordedNumber):
            if not isinstance(other, float | int):
                return NotImplemented
            if self._folds(other, 0):
                return self
        return self._write("+", self, other)

    __radd__ = __add__

    def __sub__(self, other: Operand) -> Operand:
        if not isinstance(other, RecordedNumber):
            if not isinstance(other, float | int):
                return NotImplemented
            if self._folds(other, 0):
                return self
        return self._write("-", self, other)

    def __rsub__(self, other: float) -> RecordedNumber:
        return -self if self._folds(other, 0) else self._write("-", other, self)

    def __mul__(self, other: Operand) -> Operand:
        if not isinstance(other, RecordedNumber):
            if not isinstance(other, float | int):
                return NotImplemented
            if self._folds(other, 0):
                return 0.0
            if self._folds(other, 1):
                return self
            if self._folds(other, -1):
                return -self
        return self._write("*", self, other)

    __rmul__ = __mul__

    def __truediv__(self, other: Operand) -> RecordedNumber:
        return self if not isinstance(other, RecordedNumber) and self._folds(other, 1) else self._write("/", self, other)

    def __rtruediv__(self, other: float) -> Operand:
        return 0.0 if self._folds(other, 0) else self._write("/", other, self)

    def __neg__(self) -> RecordedNumber:
        return RecordedNumber(self.record, self.record.write("negative", self))

    def __abs__(self) -> RecordedNumber:
        return RecordedNumber(self.record, self.record.write("magnitude", self))

    __lt__, __le__, __gt__, __ge__ = relation("<"), relation("<="), relation(">"), relation(">=")
    __eq__, __ne__ = relation("=="), relation("!=")  # type: ignore[assignment]
    __hash__ = None  # type: ignore[assignment]

    def __bool__(self) -> NoReturn:
        raise TypeError(f"a recorded number has no truth value: {CHOOSE}")

    def __pos__(self) -> Self:
        return self

    def __pow__(self, power: object) -> NoReturn:
        # Python's own power of a float is a library's, in its last bit not always the product.
        raise TypeError("a law cannot use powers: write x * x, sqrt(x), or exp(p * log(x))")

    def __float__(self) -> NoReturn:
        raise TypeError(f"a {type(self).__name__} {INSTEAD}")

    __int__ = __index__ = __round__ = __trunc__ = __floor__ = __ceil__ = __float__

    def __mod__(self, other: object) -> NoReturn:
        raise TypeError("a law cannot use remainders: % and // are discontinuous, and its numbers have no such operation")

    __rmod__ = __floordiv__ = __rfloordiv__ = __divmod__ = __rdivmod__ = __mod__

    # What numpy.sin(x) and the like call on an object that is no array.
    sin = cos = tan = exp = log = sqrt = fabs = tanh = arcsin = arccos = arctan = sinh = cosh = __float__


Operand: TypeAlias = RecordedNumber | float


def of_words(operation: str) -> Callable[[RecordedWord, RecordedWord | int], RecordedWord]:
    return lambda one, other: RecordedWord(one.record, one.record.write(operation, one, other))


class RecordedWord(Recorded):
    """The bits of a number, 32 where the record folds. Sums wrap around; `>>` shifts zeros in; a Python int is a constant."""

    __slots__ = ()
    __add__, __or__, __xor__, __lshift__, __rshift__ = map(of_words, ("word +", "word |", "word ^", "word <<", "word >>"))

    def __and__(self, other: RecordedWord | int) -> RecordedWord:
        if other == EVERY_BIT and self.record.folds:
            return self
        return RecordedWord(self.record, self.record.write("word &", self, other))

    __radd__, __rand__, __ror__, __rxor__ = __add__, __and__, __or__, __xor__


class RecordedTable(Recorded):
    """A table that the recorded law will find."""

    __slots__ = ("size",)

    def __init__(self, record: Recording, place: object, size: int) -> None:
        super().__init__(record, place)
        self.size = size

    def at(self, index: Number) -> RecordedNumber:
        """The entry at a whole index; see `entry`."""
        return RecordedNumber(self.record, self.record.write("entry", self, entry(index, self.size)))


def of_number(operation: str) -> Callable[[object, RecordedNumber], RecordedNumber]:
    return lambda _, x: RecordedNumber(x.record, x.record.write(operation, x))


class RecordedFunctions(Kind):
    """The functions of `quadstep.numbers` for them."""

    @staticmethod
    def rule(operation: Operation) -> Rule:
        """A call of the function, or its steps."""

        def function(kind: RecordedFunctions, *given: Operand) -> Operand:
            record = record_of(given)
            if record.inline:
                return cast(Operand, operation.steps(kind, *given))
            return RecordedNumber(record, record.write(operation.name, *given))

        return function

    def precise(self, x: RecordedNumber) -> bool:
        return x.record.precise

    def bit(self, x: RecordedNumber, place: int) -> RecordedCondition:
        return RecordedCondition(x.record, x.record.write("bit", x, 1 << place))

    power, fraction, exponent, sqrt = map(of_number, ("power", "fraction", "exponent", "sqrt"))

    def where(self, condition: RecordedCondition | bool, yes: Operand, no: Operand) -> Operand:
        if not isinstance(condition, RecordedCondition):
            return yes if condition else no
        record = condition.record
        return yes if record.same(yes, no) else RecordedNumber(record, record.write("where", condition, yes, no))

    def word(self, x: RecordedNumber) -> RecordedWord:
        return RecordedWord(x.record, x.record.write("word", x))

    def number(self, word: RecordedWord) -> RecordedNumber:
        return RecordedNumber(word.record, word.record.write("number", word))

    def scan(self, step: Step[C], carry: C, rows: Rows[Matrix], count: int, backwards: bool) -> tuple[C, Rows[Matrix]]:
        """See `quadstep.numbers.scan`."""
        return record_of(flatten((carry, rows))).scan(step, carry, rows, count, backwards)

    def call(self, memory: dict[str, object], law: Callable[[S], T], structure: S) -> T:
        """See `quadstep.numbers.scan`."""
        return record_of(flatten(structure)).call(memory, law, structure)

    def shortcut(self, quick: Callable[[S], tuple[object, T]], law: Callable[[S], T], structure: S) -> T:
        """See `quadstep.numbers.scan`."""
        return record_of(flatten(structure)).shortcut(quick, law, structure)

    def opaque(self, handle: Number, inputs: Sequence[Number], outputs: int) -> list[Number]:
        """See `quadstep.numbers.scan`."""
        return record_of((handle, *inputs)).opaque(handle, inputs, outputs)


def record_of(numbers: Sequence[object]) -> Recording:
    return next(one.record for one in numbers if isinstance(one, Recorded))


Recorded.functions = RECORDED = RecordedFunctions()

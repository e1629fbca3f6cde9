"""Vectors and matrices that stay in memory while a law is recorded: operations on their rows become loops.

They replace a `Vector` or a `Matrix` in a law. Sums, differences and scaling are deferred until a result is needed, row by
row; a norm, a product and `map_rows` record one loop over the rows, in the order in which `Vector` and `Matrix` add. Anything
else takes the entries one by one, as usual.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from operator import add, mul, sub, truediv
from typing import NamedTuple, TypeAlias, cast

from quadstep.numbers.functions import sqrt
from quadstep.numbers.kinds import Number
from quadstep.numbers.vectors import Matrix, Vector
from quadstep.program.assignments import Record
from quadstep.program.recorded import RecordedNumber

FEWEST_ROWS = 5
"""Fewest rows of a matrix, and fewest entries of a vector, that stays in memory: fewer are taken one by one."""

INDEX, TURN = "i", "s"
OWN = re.compile(rf"\[?([{INDEX}{TURN}]\d+)[\].]")
"""The loop whose row or memory a text names: `[i3][1]`; `[s4]` and `s4.velocity` for a scan."""


LEFT = "left"
"""Operation: a value that a scan has left in its memory."""


class LoopBody(NamedTuple):
    """One turn of a loop, as places in the record. counter: its row.

    stored: entries of the row that it makes; empty for none. added: the terms added to each running sum.
    """

    rows: int
    counter: str
    stored: tuple[int, ...] = ()
    added: tuple[tuple[int, ...], ...] = ()


class RowRecord(Record):
    """A record with loops over rows."""

    def __init__(self, inline: bool = False, precise: bool = True) -> None:
        super().__init__(inline, precise)
        self.loops: dict[int, LoopBody] = {}
        self._indices = 0

    def memory_place(self, operation: str, *operands: int, text: str) -> int:
        """The place of a number in memory, which may be of a loop's row or of a scan's memory."""
        named = OWN.match(text)
        return self.place(operation, *operands, text=text, turning=frozenset((named[1],)) if named else frozenset())

    def index(self, kind: str = INDEX) -> str:
        """A loop's unique name for its row. kind: `TURN` for a scan."""
        self._indices += 1
        return f"{kind}{self._indices}"

    def item(self, array: int, row: str, column: int | None = None) -> RecordedNumber:
        """An entry of an array in memory."""
        place = "" if column is None else f"[{column}]"
        return RecordedNumber(self, self.memory_place("item", array, text=f"[{row}]{place}"))

    def loop(self, body: LoopBody) -> int:
        """The place of a loop, after everything that it captures."""
        taken, _ = self.around(body.counter, [*body.stored, *(place for terms in body.added for place in terms)])
        if any(one.startswith(INDEX) for place in taken for one in self.turning[place]):
            raise TypeError(
                "a loop over rows within another one cannot be written down; take the products one after the other"
            )
        place = self.place("loop", *sorted(taken), text=body.counter)
        self.loops[place] = body
        return place

    def sums(self, loop: int) -> list[RecordedNumber]:
        """The running sums of a loop at its end."""
        return [
            RecordedNumber(self, self.place("sum", loop, text=str(number))) for number in range(len(self.loops[loop].added))
        ]


Operator: TypeAlias = "Callable[[RowVector, object], Vector]"


def by_row(plain: Callable[..., Vector], operation: Callable[[Number, Number], Number]) -> tuple[Operator, Operator]:
    """An operator of a long vector, with the vector at the left and at the right; `plain` where the other is a short one, of
    which Python asks the long one first also where that stands at the right.
    """

    def at_left(one: RowVector, other: object) -> Vector:
        if isinstance(other, RowVector):
            return RowVector(one.record, one.count, lambda row: operation(one.entry(row), other.entry(row)))
        if isinstance(other, Vector):
            return plain(one, other)
        return RowVector(one.record, one.count, lambda row: operation(one.entry(row), cast(Number, other)))

    def at_right(one: RowVector, other: object) -> Vector:
        if isinstance(other, Vector):
            return NotImplemented
        return RowVector(one.record, one.count, lambda row: operation(cast(Number, other), one.entry(row)))

    return at_left, at_right


class RowVector(Vector):
    """A long vector. entry(row) gives the number in the row of this name."""

    __slots__ = ("array", "count", "entry", "record")

    def __init__(self, record: RowRecord, count: int, entry: Callable[[str], Number], array: int | None = None) -> None:
        self.record, self.count, self.entry, self.array = record, count, entry, array

    @classmethod
    def in_memory(cls, record: RowRecord, count: int, array: int) -> RowVector:
        """One that is stored in memory."""
        return cls(record, count, lambda row: cast(Number, record.item(array, row)), array)

    @property
    def entries(self) -> tuple[Number, ...]:  # type: ignore[override]
        return tuple(self.entry(str(row)) for row in range(self.count))

    def __len__(self) -> int:
        return self.count

    def __getitem__(self, index: int) -> Number:
        return self.entry(str(range(self.count)[index]))

    __add__, __radd__ = by_row(Vector.__add__, add)
    __sub__, __rsub__ = by_row(Vector.__sub__, sub)
    __mul__, __rmul__ = by_row(Vector.__mul__, mul)
    __truediv__, _ = by_row(Vector.__truediv__, truediv)

    def __neg__(self) -> Vector:
        return RowVector(self.record, self.count, lambda row: -self.entry(row))

    def __matmul__(self, other: Vector) -> Number:
        if not isinstance(other, RowVector):
            return super().__matmul__(other)
        index = self.record.index()
        term = self.record.at(self.entry(index) * other.entry(index))
        return cast(Number, self.record.sums(self.record.loop(LoopBody(self.count, index, added=((term,),))))[0])

    def map(self, function: Callable[[Number], Number]) -> Vector:
        index = self.record.index()
        stored = self.record.at(function(self.entry(index)))
        return RowVector.in_memory(self.record, self.count, self.record.loop(LoopBody(self.count, index, (stored,))))

    def outer(self, other: Vector) -> Matrix:
        if isinstance(other, RowVector):
            return super().outer(other)
        return RowMatrix(self.record, (self.count, len(other)), lambda row: self.entry(row) * other)

    def norm(self) -> Number:
        return sqrt(self @ self)


class RowMatrix(Matrix):
    """A matrix of many rows. row(name) gives the row of this name."""

    __slots__ = ("array", "record", "row", "shape")

    def __init__(
        self, record: RowRecord, shape: tuple[int, int], row: Callable[[str], Vector], array: int | None = None
    ) -> None:
        self.record, self.shape, self.row, self.array = record, shape, row, array

    @classmethod
    def in_memory(cls, record: RowRecord, shape: tuple[int, int], array: int) -> RowMatrix:
        """One that is stored in memory."""
        return cls(record, shape, lambda row: Vector(cast(Number, record.item(array, row, i)) for i in range(shape[1])), array)

    @property
    def rows(self) -> tuple[Vector, ...]:  # type: ignore[override]
        return tuple(self.row(str(row)) for row in range(self.shape[0]))

    def __len__(self) -> int:
        return self.shape[0]

    def __getitem__(self, index: tuple[int, int]) -> Number:
        return self.row(str(range(self.shape[0])[index[0]]))[index[1]]

    @property
    def T(self) -> Matrix:  # noqa: N802 (as of a matrix)
        return TransposedRows(self)

    def __add__(self, other: Matrix) -> Matrix:
        if not isinstance(other, RowMatrix):
            return super().__add__(other)
        return RowMatrix(self.record, self.shape, lambda row: self.row(row) + other.row(row))

    def __sub__(self, other: Matrix) -> Matrix:
        if not isinstance(other, RowMatrix):
            return super().__sub__(other)
        return RowMatrix(self.record, self.shape, lambda row: self.row(row) - other.row(row))

    def __mul__(self, other: Number) -> Matrix:
        return RowMatrix(self.record, self.shape, lambda row: self.row(row) * other)

    def __rmul__(self, other: Number) -> Matrix:
        return RowMatrix(self.record, self.shape, lambda row: other * self.row(row))

    def __matmul__(self, other: Vector | Matrix) -> Vector | Matrix:  # type: ignore[override]
        return self.map_rows(lambda row: row @ other) if isinstance(other, Vector) else super().__matmul__(other)

    def map_rows(self, function: Callable[[Vector], Number]) -> Vector:
        index = self.record.index()
        stored = self.record.at(function(self.row(index)))
        return RowVector.in_memory(self.record, self.shape[0], self.record.loop(LoopBody(self.shape[0], index, (stored,))))

    def norm(self) -> Number:
        """As for a matrix; deferred operations are computed in the same loop, and kept."""
        index = self.record.index()
        row = self.row(index)
        stored = () if self.array is not None else tuple(map(self.record.at, row))
        squares = tuple(self.record.at(entry * entry) for entry in row)
        loop = self.record.loop(LoopBody(self.shape[0], index, stored, (squares,)))
        if stored:
            kept = RowMatrix.in_memory(self.record, self.shape, loop)
            self.row, self.array = kept.row, kept.array
        return sqrt(cast(Number, self.record.sums(loop)[0]))


class TransposedRows(Matrix):
    """The transpose of a matrix in memory."""

    __slots__ = ("of",)

    def __init__(self, of: RowMatrix) -> None:
        self.of = of

    @property
    def rows(self) -> tuple[Vector, ...]:  # type: ignore[override]
        return Matrix(self.of.rows).T.rows

    def __len__(self) -> int:
        return self.of.shape[1]

    @property
    def T(self) -> Matrix:  # noqa: N802 (as of a matrix)
        return self.of

    def __matmul__(self, other: Vector | Matrix) -> Vector | Matrix:  # type: ignore[override]
        """With a vector: a running sum for each column."""
        if not isinstance(other, RowVector):
            return super().__matmul__(other) if isinstance(other, Matrix) else Vector(row @ other for row in self.rows)
        record, index = self.of.record, self.of.record.index()
        factor = other.entry(index)
        added = tuple((record.at(entry * factor),) for entry in self.of.row(index))
        return Vector(cast(list[Number], record.sums(record.loop(LoopBody(self.of.shape[0], index, added=added)))))

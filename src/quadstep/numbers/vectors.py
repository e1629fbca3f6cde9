"""Vectors and matrices of numbers.

The same form everywhere: frozen containers whose entries are any kind of number. A diagonal matrix (a gain, the inertia) is
kept as the vector of its diagonal and acts by `*`, entry by entry; `@` is the inner, matrix-vector or matrix product.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import reduce
from itertools import repeat
from operator import add, mul, sub, truediv
from typing import TypeVar, overload

from quadstep.numbers.functions import length, where
from quadstep.numbers.kinds import Condition, Number, functions_of

Summand = TypeVar("Summand", float, "Vector", "Matrix")


def total(values: Iterable[Summand]) -> Summand:
    """Sum of numbers, vectors or matrices, without a leading zero, in the order given. Raises StopIteration for none.

    Python's `sum` adds floats differently from version 3.12 on, so laws use this function.

    >>> from quadstep.numbers import total, vector
    >>> total([vector(1.0, 2.0), vector(3.0, 4.0)])
    Vector([4.0, 6.0])
    """
    iterator = iter(values)
    result = next(iterator)
    for value in iterator:
        result = result + value
    return result


def entrywise(operate: Callable[[Number, Number], Number]) -> Callable[[Vector, Vector | Number], Vector]:
    """An operator of a vector and a vector or a scalar; a map in C takes half the time of a loop."""

    def operated(self: Vector, other: Vector | Number) -> Vector:
        return Vector(map(operate, self.entries, as_long(other, self) if isinstance(other, Vector) else repeat(other)))

    return operated


def mirrored(operate: Callable[[Number, Number], Number]) -> Callable[[Vector, Number], Vector]:
    """The same of a scalar and a vector."""
    return lambda self, other: Vector(map(operate, repeat(other), self.entries))


def as_long(one: Vector, other: Vector) -> tuple[Number, ...]:
    """The entries of one vector, which are as many as those of the other."""
    if len(one.entries) != len(other.entries):
        raise ValueError(f"vectors of {len(other.entries)} and {len(one.entries)} entries")
    return one.entries


class Vector:
    """A column of numbers; `+`, `-`, `*` and `/` act entry by entry or with a scalar, `@` is the inner product.

    It unpacks and can be indexed like a tuple. Raises ValueError if lengths differ.

    >>> from quadstep.numbers import Vector
    >>> v = Vector([3.0, 4.0])
    >>> 2.0 * v + v, v / v, v @ v, v.norm(), v[0]
    (Vector([9.0, 12.0]), Vector([1.0, 1.0]), 25.0, 5.0, 3.0)
    """

    __slots__ = ("entries",)
    __array_ufunc__ = None  # an array times a vector asks the vector, not NumPy

    def __init__(self, entries: Iterable[Number]) -> None:
        self.entries = tuple(entries)

    def __iter__(self) -> Iterator[Number]:
        return iter(self.entries)

    def __len__(self) -> int:
        return len(self.entries)

    def __getitem__(self, index: int) -> Number:
        return self.entries[index]

    def __repr__(self) -> str:
        return f"Vector({list(self.entries)!r})"

    __add__, __radd__ = entrywise(add), mirrored(add)
    __sub__, __rsub__ = entrywise(sub), mirrored(sub)
    __mul__, __rmul__ = entrywise(mul), mirrored(mul)
    __truediv__ = entrywise(truediv)

    def __neg__(self) -> Vector:
        return Vector([-a for a in self.entries])

    def __matmul__(self, other: Vector) -> Number:
        return reduce(add, map(mul, self.entries, as_long(other, self)))

    def map(self, function: Callable[[Number], Number]) -> Vector:
        """The vector of function(entry): a loop where code is written that keeps the vector in memory."""
        return Vector([function(entry) for entry in self.entries])

    def outer(self, other: Vector) -> Matrix:
        """The matrix self other^T."""
        return Matrix(entry * other for entry in self)

    def norm(self) -> Number:
        """Euclidean length."""
        return length(self @ self, self.entries)


class Matrix:
    """Rows of numbers; `+`, `-` and scalar `*` act entry by entry, `@` multiplies by a matrix or vector, `.T` transposes.

    >>> from quadstep.numbers import matrix, vector
    >>> m = matrix((1.0, 2.0), (3.0, 4.0))
    >>> m @ vector(1.0, 1.0), m.T[0, 1]
    (Vector([3.0, 7.0]), 3.0)
    """

    __slots__ = ("rows",)
    __array_ufunc__ = None

    def __init__(self, rows: Iterable[Vector]) -> None:
        self.rows = tuple(rows)

    def __iter__(self) -> Iterator[Vector]:
        return iter(self.rows)

    def __len__(self) -> int:
        return len(self.rows)

    def __getitem__(self, index: tuple[int, int]) -> Number:
        try:
            row, column = index
        except TypeError:
            raise TypeError("a matrix takes both indices at once: matrix[row, column]") from None
        return self.rows[row].entries[column]

    def __repr__(self) -> str:
        return f"Matrix({[list(row) for row in self.rows]!r})"

    @property
    def T(self) -> Matrix:  # noqa: N802 (the transpose is written so everywhere)
        return Matrix(Vector(column) for column in zip(*(row.entries for row in self.rows), strict=True))

    def __add__(self, other: Matrix) -> Matrix:
        return Matrix([a + b for a, b in zip(self.rows, other.rows, strict=True)])

    def __sub__(self, other: Matrix) -> Matrix:
        return Matrix([a - b for a, b in zip(self.rows, other.rows, strict=True)])

    def __mul__(self, other: Number) -> Matrix:
        return Matrix(row * other for row in self.rows)

    def __rmul__(self, other: Number) -> Matrix:
        return Matrix(other * row for row in self.rows)

    @overload
    def __matmul__(self, other: Vector) -> Vector: ...
    @overload
    def __matmul__(self, other: Matrix) -> Matrix: ...
    def __matmul__(self, other: Vector | Matrix) -> Vector | Matrix:
        if isinstance(other, Vector):
            return Vector([row @ other for row in self.rows])
        columns = other.T.rows
        return Matrix(Vector(row @ column for column in columns) for row in self.rows)

    def map_rows(self, function: Callable[[Vector], Number]) -> Vector:
        """The vector of function(row): a loop over the rows where code is written that keeps the matrix in memory.

        >>> from quadstep.numbers import matrix, vector
        >>> matrix((3.0, 4.0), (0.0, 2.0)).map_rows(lambda row: row.norm())
        Vector([5.0, 2.0])
        """
        return Vector([function(row) for row in self.rows])

    def norm(self) -> Number:
        """Frobenius norm."""
        entries = [entry for row in self.rows for entry in row]
        return length(total(entry * entry for entry in entries), entries)


def vector(*entries: Number) -> Vector:
    """The vector with these entries.

    >>> from quadstep.numbers import vector
    >>> vector(0.0, 0.0, 9.81)
    Vector([0.0, 0.0, 9.81])
    """
    return Vector(entries)


def matrix(*rows: Iterable[Number]) -> Matrix:
    """The matrix with these rows.

    >>> from quadstep.numbers import matrix
    >>> matrix((1.0, 2.0), (3.0, 4.0))
    Matrix([[1.0, 2.0], [3.0, 4.0]])
    """
    return Matrix(Vector(row) for row in rows)


def either(condition: Condition, yes: Vector, no: Vector) -> Vector:
    """`where` for vectors of one length, entry by entry.

    >>> from quadstep.numbers import either, vector
    >>> either(2.0 > 1.0, vector(1.0, 2.0), vector(3.0, 4.0))
    Vector([1.0, 2.0])
    """
    return Vector(where(condition, one, other) for one, other in zip(yes, no, strict=True))


def outer(a: Vector, b: Vector) -> Matrix:
    """a b^T, shape (len(a), len(b)).

    >>> from quadstep.numbers import outer, vector
    >>> outer(vector(1.0, 2.0), vector(3.0, 4.0))
    Matrix([[3.0, 4.0], [6.0, 8.0]])
    """
    return a.outer(b)


def solve_symmetric(m: Matrix, b: Vector) -> Vector:
    """x of M x = b for a symmetric 3x3 M, by cofactors. A singular M gives non-finite entries, as any number would.

    A kind of number may provide a better method.

    >>> from quadstep.numbers import matrix, solve_symmetric, vector
    >>> solve_symmetric(matrix((2.0, 0.0, 0.0), (0.0, 4.0, 0.0), (0.0, 0.0, 8.0)), vector(2.0, 2.0, 2.0))
    Vector([1.0, 0.5, 0.25])
    """
    own = getattr(functions_of(*m.rows[0], *m.rows[1], *m.rows[2], *b), "solve_symmetric", None)
    if own is not None:
        return own(m, b)
    m11, m12, m13 = m.rows[0]
    _, m22, m23 = m.rows[1]
    m33 = m[2, 2]
    a11, a12, a13 = m22 * m33 - m23 * m23, m13 * m23 - m12 * m33, m12 * m23 - m13 * m22
    a22, a23, a33 = m11 * m33 - m13 * m13, m12 * m13 - m11 * m23, m11 * m22 - m12 * m12
    determinant = m11 * a11 + m12 * a12 + m13 * a13
    adjugate = matrix((a11, a12, a13), (a12, a22, a23), (a13, a23, a33))
    return (adjugate @ b) * (1.0 / determinant)

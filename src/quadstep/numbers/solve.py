"""Small linear systems and algebraic Riccati equations, solved by +, -, *, / and square roots in a fixed order.

The numbers that set up a mission (shares of the rotors, gains of a regulator, pieces of a path, correlated draws) decide its
flight, which must be the same to the bit on every machine; the order in which LAPACK and BLAS add depends on the processor.
"""

from collections.abc import Sequence
from fractions import Fraction
from typing import TypeVar

from quadstep.numbers.functions import sqrt
from quadstep.numbers.vectors import Vector, total

Rows = Sequence[Sequence[float]]
Entry = TypeVar("Entry", float, Fraction)


def factored(rows: Rows) -> tuple[list[list[float]], list[float]]:
    """L and the diagonal of D with L D L^T a symmetric positive definite matrix; L without its diagonal of ones.

    rows: of the lower triangle, each from its first entry other than zero to the diagonal, as are those of L. Raises
    ValueError where the matrix is not positive definite.
    """
    lower: list[list[float]] = []
    pivots: list[float] = []
    for i, row in enumerate(rows):
        first = i - len(row) + 1
        products: list[float] = []  # of L and D
        for j in range(first, i):
            other, value = lower[j], row[j - first]
            start = j - len(other)
            for k in range(max(first, start), j):
                value -= products[k - first] * other[k - start]
            products.append(value)
        entries = [value / pivots[first + j] for j, value in enumerate(products)]
        pivot = row[-1]
        for value, entry in zip(products, entries, strict=True):
            pivot -= value * entry
        if not pivot > 0.0:
            raise ValueError("not positive definite")
        lower.append(entries)
        pivots.append(pivot)
    return lower, pivots


def solve_definite(rows: Rows, columns: Sequence[Sequence[float]]) -> list[list[float]]:
    """x of A x = b for each of some columns b. rows: of A as in `factored`. Raises ValueError."""
    lower, pivots = factored(rows)
    solved = []
    for column in columns:
        x = list(column)
        for i, entries in enumerate(lower):
            value, first = x[i], i - len(entries)
            for j, entry in enumerate(entries, start=first):
                value -= entry * x[j]
            x[i] = value
        x = [value / pivot for value, pivot in zip(x, pivots, strict=True)]
        for i in range(len(x) - 1, -1, -1):
            value, first = x[i], i - len(lower[i])
            for j, entry in enumerate(lower[i], start=first):
                x[j] -= entry * value
        solved.append(x)
    return solved


def cholesky(rows: Rows) -> list[list[float]]:
    """The lower triangle L, rows of full length, with L L^T the symmetric matrix of these rows. Raises ValueError."""
    lower, pivots = factored([row[: i + 1] for i, row in enumerate(rows)])
    roots = [sqrt(pivot) for pivot in pivots]
    return [
        [entry * root for entry, root in zip((*entries, 1.0), roots, strict=False)] + [0.0] * (len(rows) - 1 - i)
        for i, entries in enumerate(lower)
    ]


def solve_square(rows: Sequence[Sequence[Entry]], right: Sequence[Entry]) -> list[Entry]:
    """x of A x = b by elimination, the largest entry of each column first; exact of fractions. Raises ValueError where A is
    singular.
    """
    count = len(right)
    system = [list(rows[i]) + [right[i]] for i in range(count)]  # noqa: RUF005 (typed alike)
    for i in range(count):
        largest = max(range(i, count), key=lambda k: abs(system[k][i]))
        system[i], system[largest] = system[largest], system[i]
        if not abs(system[i][i]) > 0.0:
            raise ValueError("singular")
        for k in range(i + 1, count):
            share = system[k][i] / system[i][i]
            for j in range(i + 1, count + 1):
                system[k][j] -= share * system[i][j]
    x = list(right)
    for i in range(count - 1, -1, -1):
        value = system[i][count]
        for j in range(i + 1, count):
            value -= system[i][j] * x[j]
        x[i] = value / system[i][i]
    return x


def inverse(rows: Rows) -> list[list[float]]:
    """A^-1 by elimination, the largest entry of each column first. Raises ValueError where A is singular."""
    count = len(rows)
    system = [[*row, *(1.0 if i == j else 0.0 for j in range(count))] for i, row in enumerate(rows)]
    for i in range(count):
        largest = max(range(i, count), key=lambda k: abs(system[k][i]))
        system[i], system[largest] = system[largest], system[i]
        pivot = system[i][i]
        if not abs(pivot) > 0.0:
            raise ValueError("singular")
        row = system[i] = [value / pivot for value in system[i]]
        for k in range(count):
            share = system[k][i]
            if k != i and share != 0.0:
                system[k] = [value - share * other for value, other in zip(system[k], row, strict=True)]
    return [row[count:] for row in system]


def least_norm_inverse(rows: Sequence[Vector]) -> list[Vector]:
    """The pseudo-inverse of a matrix of full row rank, of any kind of numbers: for each column a vector, an entry a row.

    From rows = L Q, Q orthonormal, it is Q^T L^-1; Q by Gram and Schmidt, each row made orthogonal twice (Giraud, Langou and
    Rozloznik 2005: twice is enough).
    """
    across: list[Vector] = []  # rows of Q
    shares: list[Vector] = []  # rows of L^-1 up to the diagonal, each as what it takes of the given rows
    for i, row in enumerate(rows):
        rest, taken = row, Vector(float(k == i) for k in range(len(rows)))
        for _ in range(2):
            for unit, share in zip(across, shares, strict=True):
                part = rest @ unit
                rest, taken = rest - part * unit, taken - part * share
        length = rest.norm()
        across.append(rest / length)
        shares.append(taken / length)
    return [
        Vector(total(unit[column] * share[i] for unit, share in zip(across, shares, strict=True)) for i in range(len(rows)))
        for column in range(len(rows[0]))
    ]


def rank(rows: Sequence[Vector], tolerance: float) -> int:
    """How many rows are independent: taken one by one, the farthest first, while one is so far from the span of those taken.

    tolerance: on that distance, for rows scaled to length one; zero rows do not count.
    """
    left = [row / row.norm() for row in rows if row.norm() > 0.0]
    taken = 0
    while left:
        farthest = max(left, key=Vector.norm)
        if not farthest.norm() > tolerance:
            break
        unit = farthest / farthest.norm()
        left = [row - (row @ unit) * unit for row in left if row is not farthest]
        taken += 1
    return taken


MOST_STEPS, SMALL = 100, 1e-15
"""Most steps of Newton's method for the sign of a matrix, and the relative step at which it has converged."""


def product(a: Rows, b: Rows) -> list[list[float]]:
    columns = list(zip(*b, strict=True))
    return [[dot(row, column) for column in columns] for row in a]


def dot(a: Sequence[float], b: Sequence[float]) -> float:
    """The sum of products, first to last."""
    value = 0.0
    for x, y in zip(a, b, strict=True):
        value += x * y
    return value


def transposed(a: Rows) -> list[list[float]]:
    return [list(column) for column in zip(*a, strict=True)]


def riccati(a: Rows, s: Rows, q: Rows) -> list[list[float]]:
    """The stabilising X of A^T X + X A - X S X + Q = 0. Raises ValueError where there is none.

    From the sign of the Hamiltonian matrix (Roberts 1980), by Newton's method with the scaling of Higham (1986).
    """
    n = len(a)
    z = [[*a[i], *(-one for one in s[i])] for i in range(n)]
    z += [[*(-one for one in q[i]), *(-a[j][i] for j in range(n))] for i in range(n)]
    for _ in range(MOST_STEPS):
        over = inverse(z)
        scale = sqrt(size(over) / size(z))
        following = [
            [0.5 * (scale * one + other / scale) for one, other in zip(row, across, strict=True)]
            for row, across in zip(z, over, strict=True)
        ]
        step = size([[one - other for one, other in zip(*rows, strict=True)] for rows in zip(following, z, strict=True)])
        z = following
        if step <= SMALL * size(z):
            break
    right = [[-(z[i][j] + (1.0 if i == j else 0.0)) for j in range(n)] for i in range(n)]
    x = product(inverse([row[n:] for row in z[:n]]), right)
    x = [[0.5 * (x[i][j] + x[j][i]) for j in range(n)] for i in range(n)]
    if not left_over(a, s, q, x) < 1e-6 * (size(q) + size(product(x, product(s, x)))):
        raise ValueError("no stabilising solution")
    return x


def left_over(a: Rows, s: Rows, q: Rows, x: Rows) -> float:
    """The largest entry of the equation's residual for X."""
    forward, square = product(x, a), product(x, product(s, x))
    n = len(a)
    return size([[forward[j][i] + forward[i][j] - square[i][j] + q[i][j] for j in range(n)] for i in range(n)])


def size(a: Rows) -> float:
    return max(abs(one) for row in a for one in row)

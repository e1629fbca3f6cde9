"""Algebraic Riccati equations of a few states, in plain floats, so that gains are the same to the bit on every machine."""

from collections.abc import Sequence

from quadstep.numbers.functions import sqrt
from quadstep.numbers.solve import inverse

Square = Sequence[Sequence[float]]

MOST_STEPS, SMALL = 100, 1e-15
"""Most steps of Newton's method for the sign of a matrix, and the relative step at which it has converged."""


def product(a: Square, b: Square) -> list[list[float]]:
    """a b."""
    columns = list(zip(*b, strict=True))
    return [[dot(row, column) for column in columns] for row in a]


def dot(a: Sequence[float], b: Sequence[float]) -> float:
    """The sum of products, first to last."""
    value = 0.0
    for x, y in zip(a, b, strict=True):
        value += x * y
    return value


def transposed(a: Square) -> list[list[float]]:
    """a^T."""
    return [list(column) for column in zip(*a, strict=True)]


def riccati(a: Square, s: Square, q: Square) -> list[list[float]]:
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


def left_over(a: Square, s: Square, q: Square, x: Square) -> float:
    """The largest entry of the equation's residual for X."""
    forward, square = product(x, a), product(x, product(s, x))
    n = len(a)
    return size([[forward[j][i] + forward[i][j] - square[i][j] + q[i][j] for j in range(n)] for i in range(n)])


def size(a: Square) -> float:
    """The largest entry."""
    return max(abs(one) for row in a for one in row)

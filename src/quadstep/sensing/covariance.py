"""The covariance of a state, kept as its upper triangle, and the two things a Kalman filter does to it.

Only the triangle is computed, so it stays symmetric. Every change is elementary: a shear adds three states, times a matrix, to
three others; an observation measures one state alone. A sparse transition is a product of shears, and no matrix is inverted.
"""

from typing import TypeAlias

from quadstep.numbers import Matrix, Number, Vector, total

Triangle: TypeAlias = tuple[Vector, ...]
"""Row i holds the entries (i, i) ... (i, n - 1) of a symmetric matrix."""


def diagonal(variances: Vector) -> Triangle:
    """The covariance of independent states."""
    count = len(variances)
    return tuple(Vector((variance, *[0.0] * (count - 1 - place))) for place, variance in enumerate(variances))


def entry(p: Triangle, i: int, j: int) -> Number:
    """Entry (i, j), from whichever side of the diagonal."""
    return p[i][j - i] if i <= j else p[j][i - j]


def widened(p: Triangle, variances: Vector) -> Triangle:
    """After independent noise of these variances has been added to the states."""
    return tuple(Vector((row[0] + variance, *row.entries[1:])) for row, variance in zip(p, variances, strict=True))


def sheared(p: Triangle, target: int, source: int, g: Matrix) -> Triangle:
    """After x[target : target + 3] += g @ x[source : source + 3], two groups that do not overlap.

    With M_t = P_t + g P_s for the rows t, s of target and source: P'_tk = M_tk, and P'_tt = M_tt + M_ts g^T.
    """
    count = len(p)
    rows = [[entry(p, i, j) for j in range(count)] for i in range(count)]
    moved = [
        [rows[target + a][k] + total(g[a, b] * rows[source + b][k] for b in range(3)) for k in range(count)] for a in range(3)
    ]
    for a in range(3):
        for k in range(count):
            rows[target + a][k] = rows[k][target + a] = moved[a][k]
    for a in range(3):
        for c in range(a, 3):
            back = total(moved[a][source + b] * g[c, b] for b in range(3))
            rows[target + a][target + c] = moved[a][target + c] + back
    return tuple(Vector(row[place:]) for place, row in enumerate(rows))


def observed(p: Triangle, place: int, variance: Number) -> tuple[Vector, Triangle]:
    """After state `place` has been measured with an error of this positive variance: the gain, shape (n), and the covariance.

    P' = P - K P_place with K = P_place / (P_pp + r). The row of the state itself is P_place r / (P_pp + r), so that it stays
    positive however small the error is.
    """
    count = len(p)
    row = [entry(p, place, k) for k in range(count)]
    scale = 1.0 / (row[place] + variance)
    gain = [scale * value for value in row]
    kept = scale * variance

    def after(i: int, j: int) -> Number:
        return kept * entry(p, i, j) if place in {i, j} else entry(p, i, j) - gain[i] * row[j]

    return Vector(gain), tuple(Vector(after(i, j) for j in range(i, count)) for i in range(count))

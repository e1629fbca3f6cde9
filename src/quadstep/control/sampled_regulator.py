"""Discrete linear-quadratic regulators of one input, by +, -, *, / in an order that is written here (docs/decisions/0013)."""

from collections.abc import Sequence
from typing import NamedTuple

from quadstep.numbers import Matrix, Number, Vector, outer
from quadstep.numbers.solve import solve_square

HALVINGS, TERMS = 6, 12
"""Of the time step, and terms of the exponential's series at the end of them."""

MOST_DOUBLINGS, SMALL = 60, 1e-15


class Regulator(NamedTuple):
    """x+ = a x + b u with the cost x' diag(q) x + r u^2 a step.

    a, b: per sample. gain: K, u = -K x is best. inverse: (r + b' P b)^-1. closed: (a - b K)'.
    """

    a: Matrix
    b: Vector
    gain: Vector
    inverse: Number
    closed: Matrix


def identity(size: int) -> Matrix:
    return Matrix(Vector(float(i == j) for j in range(size)) for i in range(size))


def discretised(rate: Matrix, period: Number) -> tuple[Matrix, Vector]:
    """a, b of x+ = a x + b u over a period [s] with u held. rate: rows of [A B] of x' = A x + B u."""
    size = len(rate) + 1
    generator = Matrix([*rate, Vector([0.0] * size)]) * (period / 2.0**HALVINGS)
    power = result = identity(size)
    for term in range(1, TERMS + 1):
        power = (power @ generator) * (1.0 / term)
        result = result + power
    for _ in range(HALVINGS):
        result = result @ result
    rows = result.rows[:-1]
    return Matrix(Vector(row.entries[:-1]) for row in rows), Vector(row[size - 1] for row in rows)


def riccati(a: Matrix, b: Vector, weights: Sequence[Number], price: Number) -> Matrix:
    """P = diag(weights) + a' P (a - b K): by doubling the horizon (Chu, Fan, Lin 2005), which converges quadratically.

    Raises ValueError where no such P is found.
    """
    size = len(a)
    cost = Matrix(Vector(weight if i == j else 0.0 for j in range(size)) for i, weight in enumerate(weights))
    reach = outer(b, b) * (1.0 / price)
    one = identity(size)
    for _ in range(MOST_DOUBLINGS):
        rows = [list(row) for row in one + reach @ cost]
        between = Matrix(Vector(solve_square(rows, list(column))) for column in one).T  # (I + G H)^-1
        closed = between @ a
        step = a.T @ (cost @ closed)
        reach = reach + (a @ between) @ (reach @ a.T)
        a, cost = a @ closed, cost + step
        if step.norm() <= SMALL * cost.norm():
            return cost
    raise ValueError("no stabilising gains")


def regulator(a: Matrix, b: Vector, weights: Sequence[Number], price: Number) -> Regulator:
    """The best gains. Raises ValueError where there are none."""
    cost = riccati(a, b, weights, price)
    push = Vector(row @ b for row in cost.T)
    inverse = 1.0 / (price + b @ push)
    gain = inverse * Vector(push @ column for column in a.T)
    return Regulator(a, b, gain, inverse, (a - outer(b, gain)).T)

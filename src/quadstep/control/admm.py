"""Quadratic programs of predictive control by a fixed number of ADMM iterations: TinyMPC (Nguyen and others 2024).

The problem falls into chains of one input each. For each of them it is, over stages k = 0 to N - 1,

    least sum of x_k' Q x_k / 2 + R u_k^2 / 2 with x_(k+1) = a x_k + b u_k and bounds on every x_k and u_k,

and after the last stage goes on as the regulator would. The regulator's matrices contain the penalty: they are those of
Q + diag(rho_x) and R + rho_u. An iteration rolls the chain out, cuts what it finds at the bounds, and sweeps back.

The regulator is computed by +, -, *, / in an order that is written here (docs/decisions/0013).
"""

from collections.abc import Sequence
from typing import NamedTuple

from quadstep.numbers import Matrix, Number, Vector, clip, outer, scan
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


class BoundedChain(NamedTuple):
    """A chain of n states and one input. regulator: what it is without bounds. penalty: rho of its states, length n.
    input_penalty: rho of its input.
    """

    regulator: Regulator
    penalty: Vector
    input_penalty: float


class AdmmIterate(NamedTuple):
    """What an iteration leaves to the next, for all chains one after the other.

    pulls: d, what the input has beside -K x, a row a stage but the last. inputs: y, scaled duals of the inputs' bounds, as
    many rows. states: g, of the states' bounds, as many rows; last: of the last stage.
    """

    pulls: Matrix
    inputs: Matrix
    states: Matrix
    last: Vector


class StageBounds(NamedTuple):
    """Low and high bounds of inputs and states, a row a stage; of the states also at the last stage."""

    low: Matrix
    high: Matrix
    low_state: Matrix
    high_state: Matrix
    low_last: Vector
    high_last: Vector


def split(chains: Sequence[BoundedChain], states: Vector) -> list[Vector]:
    parts, place = [], 0
    for chain in chains:
        parts.append(Vector(states.entries[place : place + len(chain.penalty)]))
        place += len(chain.penalty)
    return parts


def joined(parts: Sequence[Vector]) -> Vector:
    return Vector([entry for part in parts for entry in part])


def within(values: Vector, low: Vector, high: Vector) -> Vector:
    return Vector([clip(*one) for one in zip(values, low, high, strict=True)])


def inputs_of(chains: Sequence[BoundedChain], states: Vector, pulls: Vector) -> Vector:
    """u = -K x - d of every chain."""
    parts = zip(chains, split(chains, states), pulls, strict=True)
    return Vector([-(chain.regulator.gain @ x) - pull for chain, x, pull in parts])


def moved(chains: Sequence[BoundedChain], states: Vector, inputs: Vector) -> Vector:
    """a x + b u of every chain."""
    parts = zip(chains, split(chains, states), inputs, strict=True)
    return joined([chain.regulator.a @ x + chain.regulator.b * u for chain, x, u in parts])


def idle(chains: Sequence[BoundedChain], stages: int) -> AdmmIterate:
    """Before the first iteration: no bound has been met."""
    inputs = Matrix([Vector([0.0] * len(chains))] * (stages - 1))
    none = Vector([0.0] * sum(len(chain.penalty) for chain in chains))
    return AdmmIterate(inputs, inputs, Matrix([none] * (stages - 1)), none)


def iterate(
    chains: Sequence[BoundedChain], begin: Vector, duals: AdmmIterate, bounds: StageBounds, iterations: int
) -> tuple[AdmmIterate, Matrix]:
    """The duals after some more iterations from the state `begin`, and the inputs found last, within their bounds."""
    penalties = Vector([chain.input_penalty for chain in chains])
    state_penalties = joined([chain.penalty for chain in chains])

    def forward(states: Vector, row: tuple[Vector, ...]) -> tuple[Vector, tuple[Vector, ...]]:
        pulls, y, g, low, high, low_state, high_state = row
        inputs = inputs_of(chains, states, pulls)
        z = within(inputs + y, low, high)
        v = within(states + g, low_state, high_state)
        y, g = y + inputs - z, g + states - v
        return moved(chains, states, inputs), (y, g, z, z - y, v - g)

    def backward(costs: Vector, row: tuple[Vector, Vector]) -> tuple[Vector, Vector]:
        toward, toward_state = row
        r, q = -(penalties * toward), -(state_penalties * toward_state)
        pulls, before = [], []
        for chain, p, price in zip(chains, split(chains, costs), r, strict=True):
            pulls.append(chain.regulator.inverse * (chain.regulator.b @ p + price))
            before.append(chain.regulator.closed @ p - price * chain.regulator.gain)
        return q + joined(before), Vector(pulls)

    def iteration(carry: tuple[AdmmIterate, Matrix], _: tuple[()]) -> tuple[tuple[AdmmIterate, Matrix], tuple[()]]:
        before, _inputs = carry
        rows = (before.pulls, before.inputs, before.states, *bounds[:4])
        final, (y, g, z, toward, toward_state) = scan(forward, begin, rows)
        v = within(final + before.last, bounds.low_last, bounds.high_last)
        last = before.last + final - v
        _costs, pulls = scan(backward, -(state_penalties * (v - last)), (toward, toward_state), backwards=True)
        return (AdmmIterate(pulls, y, g, last), z), ()

    (duals, inputs), _ = scan(iteration, (duals, duals.inputs), times=iterations)
    return duals, inputs

"""Paths made of quintic pieces: waypoints with times, and recorded positions.

The path of least jerk through waypoints, or near recorded points, is the paper's Eq. 72 for more than two points: quintic
between knots, unknown in value, rate and second rate at each knot. It minimises integral |jerk|^2 dt, subject to the
waypoints, or weighed against the squared distance from the recorded points.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement
from typing import NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from quadstep.interfaces.plant import Reference
from quadstep.numbers import Number, Table, Vector, maximum, total, where
from quadstep.numbers.functions import evenly_spaced
from quadstep.numbers.solve import solve_definite

__all__ = ["Piecewise", "PiecewiseParameters", "near_recording", "piecewise_parameters", "through_waypoints"]


class PiecewiseParameters(NamedTuple):
    """knots: start time of each piece [s], padded with infinity to a power of two.

    coefficients: for x, y, z [m] and psi [rad], the six tables of Taylor coefficients at each piece's start.
    """

    knots: Table
    coefficients: tuple[tuple[Table, ...], ...]


def piecewise_parameters(knots: NDArray[np.float64], nodes: NDArray[np.float64]) -> PiecewiseParameters:
    """Parameters of the path through nodes.

    knots: (n,) increasing times [s]. nodes: (n, 3, 4), value, rate and second rate of (x, y, z, psi) at each knot.
    After the last knot its value is held.
    """
    lengths = cast(Number, np.diff(knots)[:, None])
    pieces = np.zeros((len(knots), 6, 4))
    for power, coefficient in enumerate(quintic(lengths, *nodes[:-1].swapaxes(0, 1), *nodes[1:].swapaxes(0, 1))):
        pieces[:-1, power] = coefficient
    pieces[-1, 0] = nodes[-1, 0]  # held
    size = 1 << (len(knots) - 1).bit_length()
    padding = size - len(knots)
    padded = np.concatenate([pieces, np.zeros((padding, 6, 4))])
    return PiecewiseParameters(
        knots=Table(np.concatenate([knots, np.full(padding, np.inf)])),
        coefficients=tuple(tuple(Table(padded[:, power, axis]) for power in range(6)) for axis in range(4)),
    )


def quintic(
    h: Number, p0: Number, v0: Number, a0: Number, p1: Number, v1: Number, a1: Number
) -> tuple[Number, Number, Number, Number, Number, Number]:
    """Taylor coefficients of the quintic over [0, h] with these values, rates and second rates at its ends."""
    gained, first, last = p1 - p0, h * v0, h * v1
    bend_0, bend_1 = 0.5 * (h * (h * a0)), 0.5 * (h * (h * a1))
    cube = h * h * h
    third = 10.0 * gained - 6.0 * first - 4.0 * last - 3.0 * bend_0 + bend_1
    fourth = 8.0 * first + 7.0 * last + 3.0 * bend_0 - 2.0 * bend_1 - 15.0 * gained
    fifth = 6.0 * gained - 3.0 * first - 3.0 * last - bend_0 + bend_1
    return p0, v0, 0.5 * a0, third / cube, fourth / (cube * h), fifth / (cube * h * h)


@dataclass(frozen=True)
class Piecewise:
    """Quintic pieces over any knots; the piece is found by bisection without a branch.

    Its parameters come from `through_waypoints`, `near_recording`, or `piecewise_parameters`.
    """

    def reference(self, t: Number, parameters: PiecewiseParameters) -> Reference:
        """The wanted motion at time t [s]; before 0 and after the last knot it rests at the ends."""
        time = maximum(t, 0.0)
        index = 0.0 * time
        step = parameters.knots.size // 2
        while step:
            index = where(time >= parameters.knots.at(index + step), index + step, index)
            step //= 2
        s = time - parameters.knots.at(index)
        tables = [[table.at(index) for table in axis] for axis in parameters.coefficients]
        axes = [taylor(c, s) for c in tables]
        bends = [taylor_bend(c, s) for c in tables[:3]]
        yaw, yaw_rate, yaw_acceleration = axes[3]
        position, velocity, acceleration = (Vector(axis[order] for axis in axes[:3]) for order in range(3))
        begun = where(t < 0.0, 0.0, 1.0)
        jerk, snap = (Vector(begun * bend[order] for bend in bends) for order in range(2))
        return Reference(position, velocity, acceleration, yaw, yaw_rate, jerk, snap, yaw_acceleration)


def taylor(c: list[Number], s: Number) -> tuple[Number, Number, Number]:
    """Value, first and second derivative of a quintic with coefficients c_0 to c_5 at s."""
    value = c[0] + s * (c[1] + s * (c[2] + s * (c[3] + s * (c[4] + s * c[5]))))
    first = c[1] + s * (2.0 * c[2] + s * (3.0 * c[3] + s * (4.0 * c[4] + s * (5.0 * c[5]))))
    second = 2.0 * c[2] + s * (6.0 * c[3] + s * (12.0 * c[4] + s * (20.0 * c[5])))
    return value, first, second


def taylor_bend(c: list[Number], s: Number) -> tuple[Number, Number]:
    """Third and fourth derivative of the same quintic; they jump from piece to piece."""
    return 6.0 * c[3] + s * (24.0 * c[4] + s * (60.0 * c[5])), 24.0 * c[4] + s * (120.0 * c[5])


Array = NDArray[np.float64]

MOST_KNOTS = 1200

LEAST_SPAN = 0.1
"""Of a recording, in smoothing times. A shorter one is smoothed to a point: to a millionth of what moves in it."""

JERK = (
    (720.0, 360.0, 60.0, -720.0, 360.0, -60.0),
    (360.0, 192.0, 36.0, -360.0, 168.0, -24.0),
    (60.0, 36.0, 9.0, -60.0, 24.0, -3.0),
    (-720.0, -360.0, -60.0, 720.0, -360.0, 60.0),
    (360.0, 168.0, 24.0, -360.0, 192.0, -36.0),
    (-60.0, -24.0, -3.0, 60.0, -36.0, 9.0),
)
"""Q of one piece, 1 s long: integral jerk^2 dt = x^T Q x with x = (p0, v0, a0, p1, v1, a1)."""

Cost = list[list[float]]
"""A symmetric matrix over the values, rates and second rates at the knots, in this order: of its lower triangle each row, from
the value at the knot before to the diagonal."""


def through_waypoints(times: Array, points: Array) -> PiecewiseParameters:
    """Least jerk through `points` (n, 4) [m, m, m, rad] at `times` (n,) [s], at rest at both ends; n >= 2.

    times must increase. The paper's Eq. 72 for more than two points.

    >>> import numpy as np
    >>> from quadstep.world.pieces import Piecewise, through_waypoints
    >>> times = np.array([0.0, 2.0, 4.0])
    >>> path = through_waypoints(times, np.array([[0.0, 0.0, 1.0, 0.0], [1.0, 0.5, 1.5, 0.0], [2.0, 0.0, 1.0, 0.0]]))
    >>> Piecewise().reference(2.0, path).position
    Vector([1.0, 0.5, 1.5])
    """
    known = np.zeros((len(times), 3), dtype=bool)
    known[:, 0] = True
    known[[0, -1]] = True
    nodes = np.zeros((len(times), 3, 4))
    nodes[:, 0] = points - points[0]
    nodes = minimise(jerk_cost(np.diff(times).tolist()), np.zeros(nodes.shape), known, nodes)
    nodes[:, 0] = points
    return piecewise_parameters(times, nodes)


def near_recording(times: Array, points: Array, smoothing: float) -> PiecewiseParameters:
    """Least jerk near recorded `points` (n, 4) [m, m, m, rad] at uneven `times` (n,) [s], at rest at both ends; n >= 2.

    smoothing: time constant tau [s]; what is faster than 1/tau rad/s is taken for noise (gain 1 / (1 + (w tau)^6)). The
    recording lasts `LEAST_SPAN` of it or longer. Raises ValueError where its steps are too unlike for numbers to hold.

    >>> import numpy as np
    >>> from quadstep.world.pieces import Piecewise, near_recording
    >>> t = np.linspace(0.0, 4.0, 41)
    >>> path = near_recording(t, np.stack([t, 0.0 * t, 1.0 + 0.0 * t, 0.0 * t], axis=1), smoothing=0.1)
    >>> round(Piecewise().reference(2.0, path).position[0], 3)
    2.0
    """
    span = float(times[-1] - times[0])
    count = min(MOST_KNOTS, max(2, math.ceil(span / smoothing) + 1))
    length = span / (count - 1)  # the unit of time in what is solved
    even = np.array(evenly_spaced(float(times[0]), float(times[-1]), count))
    place = np.clip(np.searchsorted(even, times, side="right") - 1, 0, count - 2)
    shape = values_at((times - even[place]) / length)
    kept = np.union1d(place, place + 1)  # where nothing was recorded, one quintic is the least: knots in it add but round-off
    piece = np.searchsorted(kept, place)
    cube = (length / smoothing) * (length / smoothing) * (length / smoothing)
    weight = (count - 1) / len(times) * (cube * cube)
    middle = [total(column) / len(times) for column in points.T.tolist()]
    cost, linear = jerk_cost(np.diff(kept).astype(float).tolist()), np.zeros((len(kept), 3, 4))
    for i, one in enumerate(shape):
        for axis in range(4):
            gathered = np.bincount(piece, one * (points[:, axis] - middle[axis]), len(kept) - 1)
            linear[i // 3 : len(kept) - 1 + i // 3, i % 3, axis] += weight * gathered
        for j, other in enumerate(shape[: i + 1]):
            for k, value in enumerate(np.bincount(piece, one * other, len(kept) - 1).tolist()):
                add(cost, 3 * k + i, 3 * k + j, weight * value)
    known = np.zeros((len(kept), 3), dtype=bool)
    known[[0, -1], 1:] = True
    nodes = minimise(cost, linear, known, np.zeros((len(kept), 3, 4)))
    nodes[:, 0] += middle
    nodes[:, 1] /= length
    nodes[:, 2] /= length * length
    return piecewise_parameters(even[kept], nodes)


def values_at(u: Number) -> tuple[Number, ...]:
    """What (p0, v0, a0, p1, v1, a1) weigh in the value at time u of a quintic 1 s long."""
    cube = u * u * u
    bend_0, bend_1 = cube * (0.5 + u * (0.5 * u - 1.0)), cube * (1.5 + u * (0.5 * u - 1.5))
    rate_0, rate_1 = cube * (6.0 + u * (3.0 * u - 8.0)), cube * (u * (7.0 - 3.0 * u) - 4.0)
    value = cube * (10.0 + u * (6.0 * u - 15.0))
    return 1.0 - value, u - rate_0, 0.5 * (u * u) - bend_1, value, rate_1, bend_0


def jerk_cost(lengths: Sequence[float]) -> Cost:
    """Q with integral jerk^2 dt = x^T Q x over pieces of these lengths [s]."""
    cost: Cost = [[0.0] * (3 * min(knot, 1) + order + 1) for knot in range(len(lengths) + 1) for order in range(3)]
    for k, h in enumerate(lengths):
        powers = [h, h * h, h * h * h, (h * h) * (h * h), (h * h) * (h * h) * h]
        for j, i in combinations_with_replacement(range(6), 2):
            add(cost, 3 * k + i, 3 * k + j, JERK[i][j] / powers[4 - i % 3 - j % 3])
    return cost


def add(cost: Cost, row: int, column: int, value: float) -> None:
    """Add to an entry of the lower triangle."""
    cost[row][column - 3 * max(row // 3 - 1, 0)] += value


def minimise(cost: Cost, linear: Array, known: NDArray[np.bool_], nodes: Array) -> Array:
    """Nodes (n, 3, 4) that minimise x^T Q x - 2 x^T b with the `known` ones as given."""
    fixed = known.reshape(-1).tolist()
    given, right = (table.reshape(-1, 4).T.tolist() for table in (nodes, linear))
    rows = []
    for i, row in enumerate(cost):
        first = i - len(row) + 1
        for column, b in zip(given, right, strict=True):
            for j, entry in enumerate(row, start=first):
                if fixed[j] and not fixed[i]:
                    b[i] -= entry * column[j]
                elif fixed[i] and not fixed[j]:
                    b[j] -= entry * column[i]
        if not fixed[i]:
            rows.append([entry for j, entry in enumerate(row, start=first) if not fixed[j]])
    unknown = [i for i, one in enumerate(fixed) if not one]
    solved = solve_definite(rows, [[b[i] for i in unknown] for b in right])
    flat = nodes.reshape(-1, 4).copy()
    flat[unknown] = np.array(solved).T
    return flat.reshape(nodes.shape)

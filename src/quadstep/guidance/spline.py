"""The path of least jerk through waypoints, or near recorded points: the paper's Eq. 72 for more than two points.

The path is quintic between knots, unknown in value, rate and second rate at each knot. It minimises
integral |jerk|^2 dt, subject to the waypoints, or weighed against the squared distance from the recorded points.
"""

import numpy as np
from numpy.typing import NDArray

from quadstep.guidance.piecewise import PiecewiseParameters, hermite_to_taylor, piecewise_parameters

Array = NDArray[np.float64]

MOST_KNOTS = 1200
"""A dense system of three unknowns a knot is solved: at this size in about a second."""


def through_waypoints(times: Array, points: Array) -> PiecewiseParameters:
    """Least jerk through `points` (n, 4) [m, m, m, rad] at `times` (n,) [s], at rest at both ends; n >= 2."""
    known = np.zeros((len(times), 3), dtype=bool)
    known[:, 0] = True
    known[[0, -1]] = True
    nodes = np.zeros((len(times), 3, 4))
    nodes[:, 0] = points
    quadratic = jerk_cost(np.diff(times))
    return piecewise_parameters(times, minimise(quadratic, np.zeros((3 * len(times), 4)), known, nodes))


def near_recording(times: Array, points: Array, smoothing: float) -> PiecewiseParameters:
    """Least jerk near recorded `points` (n, 4) at uneven `times` (n,) [s], at rest at both ends; n >= 2.

    smoothing: time constant tau [s]; what is faster than 1/tau rad/s is taken for noise (gain 1 / (1 + (w tau)^6)).
    """
    span = times[-1] - times[0]
    count = min(MOST_KNOTS, max(2, int(np.ceil(span / smoothing)) + 1))
    knots = np.linspace(times[0], times[-1], count)
    weight = span / len(times) / smoothing**6
    piece = np.clip(np.searchsorted(knots, times, side="right") - 1, 0, count - 2)
    powers = (times - knots[piece])[:, None] ** np.arange(6)
    rows = np.einsum("np,npk->nk", powers, hermite_to_taylor(np.diff(knots))[piece])
    quadratic, linear = jerk_cost(np.diff(knots)), np.zeros((3 * count, 4))
    for row, start, point in zip(rows, 3 * piece, points, strict=True):
        quadratic[start : start + 6, start : start + 6] += weight * np.outer(row, row)
        linear[start : start + 6] += weight * np.outer(row, point)
    known = np.zeros((count, 3), dtype=bool)
    known[[0, -1], 1:] = True
    return piecewise_parameters(knots, minimise(quadratic, linear, known, np.zeros((count, 3, 4))))


def jerk_cost(lengths: Array) -> Array:
    """Matrix Q, shape (3 n, 3 n), with integral jerk^2 dt = nodes^T Q nodes over pieces of these lengths [s]."""
    count = len(lengths) + 1
    cost = np.zeros((3 * count, 3 * count))
    factor = np.array([6.0, 24.0, 60.0])  # jerk = 6 c3 + 24 c4 s + 60 c5 s^2
    order = np.arange(3)
    exponent = order[:, None] + order[None, :] + 1
    taylor = hermite_to_taylor(lengths)[:, 3:]
    for k, (h, c) in enumerate(zip(lengths, taylor, strict=True)):
        gram = np.outer(factor, factor) * h**exponent / exponent
        cost[3 * k : 3 * k + 6, 3 * k : 3 * k + 6] += c.T @ gram @ c
    return cost


def minimise(quadratic: Array, linear: Array, known: NDArray[np.bool_], nodes: Array) -> Array:
    """Nodes (n, 3, 4) that minimise x^T Q x - 2 x^T b with the `known` ones as given."""
    flat, fixed = nodes.reshape(-1, 4).copy(), known.reshape(-1)
    right = linear - quadratic[:, fixed] @ flat[fixed]
    flat[~fixed] = np.linalg.solve(quadratic[np.ix_(~fixed, ~fixed)], right[~fixed])
    return flat.reshape(nodes.shape)

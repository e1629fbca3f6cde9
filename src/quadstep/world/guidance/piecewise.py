"""Paths made of quintic pieces: waypoints with times, and recorded positions."""

from dataclasses import dataclass
from typing import NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from quadstep.interfaces.reference import Reference
from quadstep.numbers import Number, Table, Vector, maximum, where


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

"""Closed loops: states, gains, ideal weights and errors, many at once as NumPy arrays, each a point of the unit cube.

Errors, residuals and differences between gains are cubes of uniform numbers, so each is often near zero beside the others: the
inequalities of docs/theory.md are tight there. The weights' error correlates with the ideal weights, the residuals with r.
"""

from typing import NamedTuple, TypeAlias, cast

import numpy as np
from numpy.typing import NDArray

from quadstep.control.backstepping import FORCE_INPUTS, TORQUE_INPUTS, BacksteppingGains, BacksteppingMemory, position_loop
from quadstep.control.completed_backstepping import CompletedGains, CompletedMemory
from quadstep.control.filters import Filtered
from quadstep.interfaces.learning import Net
from quadstep.interfaces.plant import Reference
from quadstep.numbers import Matrix, Number, Vector
from quadstep.vehicle.paper import Rotors, State, Vehicle, thrust_direction

NEURONS = 3
"""Enough for the inequalities, which hold for any number."""

PERIOD = 0.002
"""Sampling period of the controller [s]."""

DIMENSIONS = 201
"""Numbers that define a closed loop."""

Cube: TypeAlias = NDArray[np.float64]
"""Points of the unit cube, shape (DIMENSIONS, closed loops)."""


class LoopBatch(NamedTuple):
    """A batch of closed loops. ideal: W_1 and W_2; residual: eps_1 [N] and eps_2 [N m]; period: of the law [s]."""

    vehicle: Vehicle
    state: State
    reference: Reference
    gains: CompletedGains
    memory: CompletedMemory
    ideal: tuple[Matrix, Matrix]
    residual: tuple[Vector, Vector]
    period: Number = PERIOD


class Draw:
    """Numbers read off the points of a cube, coordinate by coordinate."""

    def __init__(self, cube: Cube) -> None:
        self.cube, self.read = cube, 0

    def number(self, low: float, high: float) -> Number:
        self.read += 1
        return low + (high - low) * cast(Number, self.cube[self.read - 1])

    def error(self, bound: float) -> Number:
        """In [-bound, bound], often near zero."""
        number = self.number(-1.0, 1.0)
        return bound * (number * number * number)

    def vector(self, low: float, high: float, length: int = 3) -> Vector:
        return Vector([self.number(low, high) for _ in range(length)])

    def errors(self, bound: float, length: int = 3) -> Vector:
        return Vector([self.error(bound) for _ in range(length)])

    def gain(self, low: float, high: float) -> Vector:
        """Positive entries between the bounds, often nearly equal."""
        base, apart = self.number(low, high), self.error(1.0)
        return Vector([base + apart * apart * (self.number(low, high) - base) for _ in range(3)])

    def matrix(self, bound: float, rows: int, columns: int) -> Matrix:
        """Entries in [-bound, bound], the whole often near zero."""
        size = self.error(1.0)
        return size * Matrix([self.vector(-bound, bound, columns) for _ in range(rows)])


def draw_sample(seed: int, count: int) -> LoopBatch:
    return sample_at(np.random.default_rng(seed).random((DIMENSIONS, count)))


def sample_at(cube: Cube) -> LoopBatch:
    """The closed loops of a cube's points, far beyond any flight: |theta| to 1.4 rad, all rolls and yaws, unequal inertias,
    gains over decades.
    """
    draw = Draw(cube)
    inertia = draw.gain(0.5, 6.0)
    vehicle = Vehicle(draw.number(0.5, 3.0), inertia, 9.81, Rotors(0.25, 0.05, 0.0, 0.0))
    attitude = Vector((draw.number(-4.0, 4.0), draw.number(-1.4, 1.4), draw.number(-np.pi, np.pi)))
    state = State(draw.vector(-20.0, 20.0), draw.vector(-10.0, 10.0), attitude, draw.errors(3.0))
    slope_1, slope_2 = draw.gain(0.3, 3.0), draw.gain(0.5, 20.0)
    e1, r1, e2, r2, counter = draw.errors(2.0), draw.errors(8.0), draw.errors(3.0), draw.errors(20.0), draw.errors(1.0, 2)
    wanted_rates = state.rates + r2 - slope_2 * e2 - Vector((0.0, *counter))
    reference = Reference(
        state.position + e1,
        state.velocity + r1 - slope_1 * e1,
        Vector((0.0, 0.0, 0.0)),
        attitude[0] + e2[0],
        wanted_rates[0],
        yaw_acceleration=draw.number(-5.0, 5.0),
    )
    ideal = draw.matrix(5.0, NEURONS, 3), draw.matrix(20.0, NEURONS, 3)
    known = draw.number(-0.5, 1.0)
    kappa = draw.number(0.001, 0.1)  # one, as in Eq. 54
    paper = BacksteppingGains(
        mass=vehicle.mass,
        gravity=vehicle.gravity,
        slope_1=slope_1,
        gain_1=draw.gain(0.5, 20.0),
        integral_1=draw.gain(0.0, 2.0),
        slope_2=slope_2,
        gain_2=draw.gain(1.0, 400.0),
        integral_2=draw.gain(0.0, 20.0),
        filter_frequency=draw.number(20.0, 200.0),
        force_net=Net(input_weights(draw, FORCE_INPUTS), draw.number(0.5, 10.0), kappa),
        torque_net=Net(input_weights(draw, TORQUE_INPUTS), draw.number(0.5, 10.0), kappa),
        learning_start=0.0,
        weights_1=known * ideal[0] + draw.matrix(5.0, NEURONS, 3),
        weights_2=known * ideal[1] + draw.matrix(20.0, NEURONS, 3),
    )
    filtered = Filtered(Vector((attitude + e2).entries[1:]), Vector(wanted_rates.entries[1:]))
    before = BacksteppingMemory(draw.errors(3.0), draw.errors(1.0), filtered, paper.weights_1, paper.weights_2)
    pushing = thrust_direction(Vector((0.0, *(filtered.value + draw.errors(1.5, 2)))))  # beside where the filter is
    outer = position_loop(paper, before, state, reference, 1.0)
    lacking = draw.number(1.0, 60.0) * pushing - outer.u_d * thrust_direction(Vector((0.0, *outer.tilt)))
    along, across = draw.error(1.0), draw.error(1.0)
    sample = LoopBatch(
        vehicle=vehicle,
        state=state,
        reference=reference._replace(acceleration=lacking * (1.0 / vehicle.mass)),
        gains=CompletedGains(paper, draw.gain(2.0, 200.0), inertia, Vector((1e9, 1e9)), Vector((1e9, 1e9))),
        memory=CompletedMemory(before, Filtered(counter, draw.errors(5.0, 2))),
        ideal=ideal,
        residual=(along * r1 + across * draw.vector(-1.0, 1.0), along * r2 + across * draw.vector(-1.0, 1.0)),
    )
    assert draw.read == DIMENSIONS, draw.read
    return sample


def input_weights(draw: Draw, inputs: int) -> Matrix:
    """V of a net with its bias, uniform in [-1, 1]."""
    return Matrix([draw.vector(-1.0, 1.0, inputs + 1) for _ in range(NEURONS)])

"""Random closed loops: states, gains, ideal weights and errors, many at once as NumPy numbers."""

from typing import NamedTuple, cast

import numpy as np

from quadstep.control.backstepping import FORCE_INPUTS, TORQUE_INPUTS, BacksteppingGains, BacksteppingMemory
from quadstep.control.command_filter import Filtered
from quadstep.control.completed_backstepping import CompletedGains, CompletedMemory
from quadstep.control.networks import Net
from quadstep.guidance.reference import Reference
from quadstep.numbers import Matrix, Number, Vector
from quadstep.vehicle.lagrange import Vehicle
from quadstep.vehicle.rotors import Rotors
from quadstep.vehicle.state import State

NEURONS = 4
"""Enough for the inequalities, which hold for any number."""

PERIOD = 0.002
"""Sample of the controller [s]."""


class Sample(NamedTuple):
    """A batch of random closed loops. ideal: W_1 and W_2; residual: eps_1 [N] and eps_2 [N m]."""

    vehicle: Vehicle
    state: State
    reference: Reference
    gains: CompletedGains
    memory: CompletedMemory
    ideal: tuple[Matrix, Matrix]
    residual: tuple[Vector, Vector]


class Draw:
    """Uniform NumPy numbers, `count` at once."""

    def __init__(self, seed: int, count: int) -> None:
        self.generator, self.count = np.random.default_rng(seed), count

    def number(self, low: float, high: float) -> Number:
        """One number a closed loop."""
        return cast(Number, self.generator.uniform(low, high, self.count))

    def vector(self, low: float, high: float, length: int = 3) -> Vector:
        """A vector of independent entries."""
        return Vector([self.number(low, high) for _ in range(length)])

    def matrix(self, bound: float, rows: int, columns: int) -> Matrix:
        """A matrix of entries in [-bound, bound]."""
        return Matrix([self.vector(-bound, bound, columns) for _ in range(rows)])


def draw_sample(seed: int, count: int) -> Sample:
    """Closed loops far beyond any flight: |theta| to 1.4 rad, all rolls and yaws, unequal inertias, gains over decades."""
    draw = Draw(seed, count)
    inertia = draw.vector(0.5, 6.0)
    vehicle = Vehicle(draw.number(0.5, 3.0), inertia, 9.81, Rotors(0.25, 0.05, 0.0, 0.0))
    theta, phi = draw.number(-1.4, 1.4), draw.number(-np.pi, np.pi)
    attitude = Vector((draw.number(-4.0, 4.0), theta, phi))
    state = State(draw.vector(-20.0, 20.0), draw.vector(-10.0, 10.0), attitude, draw.vector(-3.0, 3.0))
    reference = Reference(
        state.position + draw.vector(-2.0, 2.0),
        state.velocity + draw.vector(-2.0, 2.0),
        draw.vector(-5.0, 5.0),
        attitude[0] + draw.number(-0.5, 0.5),
        draw.number(-1.0, 1.0),
        yaw_acceleration=draw.number(-5.0, 5.0),
    )
    paper = BacksteppingGains(
        mass=vehicle.mass,
        gravity=vehicle.gravity,
        slope_1=draw.vector(0.3, 3.0),
        gain_1=draw.vector(0.5, 20.0),
        integral_1=draw.vector(0.0, 2.0),
        slope_2=draw.vector(0.5, 20.0),
        gain_2=draw.vector(1.0, 400.0),
        integral_2=draw.vector(0.0, 20.0),
        filter_frequency=draw.number(20.0, 200.0),
        force_net=Net(draw.matrix(1.0, NEURONS, FORCE_INPUTS + 1), draw.number(0.5, 10.0), draw.number(0.001, 0.1)),
        torque_net=Net(draw.matrix(1.0, NEURONS, TORQUE_INPUTS + 1), draw.number(0.5, 10.0), draw.number(0.001, 0.1)),
        learning_start=0.0,
        weights_1=draw.matrix(5.0, NEURONS, 3),
        weights_2=draw.matrix(20.0, NEURONS, 3),
    )
    paper = paper._replace(torque_net=paper.torque_net._replace(damping=paper.force_net.damping))  # one kappa, as Eq. 54
    filtered = Filtered(Vector((theta, phi)) + draw.vector(-0.6, 0.6, 2), draw.vector(-3.0, 3.0, 2))
    before = BacksteppingMemory(draw.vector(-3.0, 3.0), draw.vector(-1.0, 1.0), filtered, paper.weights_1, paper.weights_2)
    return Sample(
        vehicle=vehicle,
        state=state,
        reference=reference,
        gains=CompletedGains(paper, draw.vector(2.0, 200.0), inertia, Vector((1e9, 1e9)), Vector((1e9, 1e9))),
        memory=CompletedMemory(before, Filtered(draw.vector(-1.0, 1.0, 2), draw.vector(-5.0, 5.0, 2))),
        ideal=(draw.matrix(5.0, NEURONS, 3), draw.matrix(20.0, NEURONS, 3)),
        residual=(draw.vector(-1.0, 1.0), draw.vector(-1.0, 1.0)),
    )

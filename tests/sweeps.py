"""Flights for comparing engines: with logs, and very many at once with scores only."""

import hashlib

import numpy as np

from quadstep.engines.scored import scored
from quadstep.engines.sweep import Sweep, places
from quadstep.interfaces.closed_loop import Ticks
from quadstep.numbers import flatten, vector
from quadstep.vehicle.paper import Disturbance, Rotors
from quadstep.world.pieces import through_waypoints
from tests.flights import CASE_1, parameters, same, state, vehicle

TICKS = Ticks(0.004, (1,), 5, 10000)
UNEQUAL = vehicle((5, 8, 12), mass=1.2, rotors=Rotors(0.25, 0.02, 0.0, 6.0))
WAYPOINTS = through_waypoints(
    np.array([0.0, 0.5, 1.0, 1.8]), np.array([[0, 0, 0, 0], [0.2, 0, 0.1, 0.1], [0.3, 0.2, 0.1, 0.0], [0, 0.1, 0.2, 0.3]])
)
TILTED = state((0.01, -0.02, 0.03), (0.01, 0.02, -0.03), (0.1, 0.05, -0.05), (0.1, -0.05, 0.05))
SWEEP_TICKS = Ticks(0.004, (1,), 5, 300)
LOOP, CLOCK = scored(CASE_1, SWEEP_TICKS, 0.02)
NUMBERS = parameters(6.0, vehicle=UNEQUAL, disturbance=Disturbance(0.7, vector(0.1, 0.2, 0.3), same(-0.2)))
VARYING = ("parameters.vehicle.mass", "parameters.path.duration", "start.position.2", "parameters.disturbance.scale")
PLACES = places(TILTED, NUMBERS, VARYING)


def values(count, seed=3):
    rng = np.random.default_rng(seed)
    return rng.uniform((0.8, 4.0, -0.1, 0.0), (1.2, 8.0, 0.1, 1.0), (count, 4))


def sweep(double=True, loop=LOOP, ticks=CLOCK):
    return Sweep(loop, ticks, TILTED, NUMBERS, PLACES, double)


def table(swept):
    """Everything that a sweep gives, one row per flight."""
    return np.stack([swept.outcome, swept.ended, *(np.asarray(leaf) for leaf in flatten(swept.score))], axis=1)


def digest(numbers):
    return hashlib.sha256(np.ascontiguousarray(numbers).tobytes()).hexdigest()

"""A disturbance of one's own for the paper's plant: an elastic tether to the place of take-off (docs/own-things.md)."""

from typing import NamedTuple

from quadstep.interfaces.gain import gain
from quadstep.numbers import Number, vector
from quadstep.vehicle.paper.own_disturbance import DeclaredDisturbance


class Numbers(NamedTuple):
    """What a mission says of it."""

    stiffness: Number = gain(1.0, "N/m", "of the tether")


class Tether(DeclaredDisturbance):
    """Pulls towards the origin."""

    Numbers = Numbers

    def disturb(self, state, numbers, time):
        """The pull."""
        return -numbers.stiffness * state.position, vector(0.0, 0.0, 0.0)

"""A disturbance of your own for the paper's plant: an elastic tether to the place of take-off (docs/extending.md)."""

from typing import NamedTuple

from quadstep.own import Disturbance, Number, gain, vector


class Numbers(NamedTuple):
    """What a mission says of it."""

    stiffness: Number = gain(1.0, "N/m", "of the tether")


class Tether(Disturbance):
    """Pulls towards the origin."""

    Numbers = Numbers

    def disturb(self, state, numbers, time):
        """The pull."""
        return -numbers.stiffness * state.position, vector(0.0, 0.0, 0.0)

"""How fast a vehicle settles: metrics in a file of your own, which missions name.

`metrics = ["metrics.py:SettlingTime", "metrics.py:Climb"]`, before the tables of the mission.
"""

from collections.abc import Mapping
from typing import NamedTuple

from quadstep.own import Metric, Number, absolute, sqrt, where

NEAR = 0.05
"""Distance from the path within which it counts as settled [m]."""


class SettlingTime(Metric):
    """The last time at which the vehicle was farther than `NEAR` from where it should be."""

    name, unit = "settling_time", "s"

    def start(self) -> Number:
        """At once."""
        return 0.0

    def add(self, sums: Number, sample: Mapping[str, Number]) -> Number:
        """The time of a sample that is too far away."""
        x, y, z = (sample[f"{axis}_d"] - sample[axis] for axis in "xyz")
        return where(sqrt(x * x + y * y + z * z) > NEAR, sample["t"], sums)

    def value(self, sums: Number) -> Number:
        """As it is."""
        return sums


class Climbed(NamedTuple):
    """way: up and down together [m]. height: at the last sample [m]. samples: so far."""

    way: Number
    height: Number
    samples: Number


class Climb(Metric):
    """How much it went up and down."""

    name, unit = "climb", "m"

    def start(self) -> Climbed:
        """Nothing."""
        return Climbed(0.0, 0.0, 0.0)

    def add(self, sums: Climbed, sample: Mapping[str, Number]) -> Climbed:
        """The way since the sample before, if there was one."""
        step = where(sums.samples > 0.0, absolute(sample["z"] - sums.height), 0.0)
        return Climbed(sums.way + step, sample["z"], sums.samples + 1.0)

    def value(self, sums: Climbed) -> Number:
        """The way."""
        return sums.way

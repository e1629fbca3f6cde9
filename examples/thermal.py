"""A thermal that pulses, with noise of its own: a wind in a file of your own, which missions name.

`type = "thermal.py:Thermal"` in `[wind]`.
"""

import math
from typing import Any, NamedTuple

from quadstep.own import Clock, Motion, Number, Vector, Wind, exp, gain, normals, sin, sqrt, vector

STREAM = 0
"""Of the noise: the sensors' begin at 1."""


class ThermalNumbers(NamedTuple):
    """Air that rises in pulses, in a breeze."""

    breeze: Vector = gain((1.0, 0.0, 0.0), "m/s", "steady wind", signed=True)
    rising: Number = gain(2.0, "m/s", "speed of the rising air, on average", zero=True)
    period: Number = gain(8.0, "s", "from pulse to pulse")
    noise: Number = gain(0.5, "m/s", "standard deviation of the rest", zero=True)
    time: Number = gain(0.7, "s", "over which that is correlated")


class Thermal(Wind):
    """Its state is what the noise has come to [m/s]."""

    Numbers = ThermalNumbers
    stirs = True

    def start(self) -> Vector:
        """Calm."""
        return vector(0.0, 0.0, 0.0)

    def stir(self, air: Vector, p: Any, clock: Clock) -> Vector:
        """A first-order filter of white noise, exact at its samples."""
        kept = exp(-clock.period / p.wind.time)
        fresh = Vector(normals(p.key, STREAM, clock.tick, 3))
        return kept * air + p.wind.noise * sqrt(1.0 - kept * kept) * fresh

    def wind(self, air: Vector, p: Any, time: Number, truth: Motion) -> Vector:
        """Breeze, pulses and noise."""
        pulse = 1.0 + sin(2.0 * math.pi / p.wind.period * time)
        return p.wind.breeze + vector(0.0, 0.0, p.wind.rising * pulse) + air

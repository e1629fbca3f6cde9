"""A Lissajous figure: a path in a file of your own, which missions name: `type = "lissajous.py:Lissajous"` in `[path]`."""

import math
from typing import NamedTuple

from quadstep.own import Number, Path, Reference, Vector, cos, gain, sin, vector


class LissajousNumbers(NamedTuple):
    """Each axis swings on its own; the first is out at t = 0 where its phase is pi/2."""

    centre: Vector = gain((0.0, 0.0, 3.0), "m", "of the figure", signed=True)
    size: Vector = gain((2.0, 2.0, 0.5), "m", "how far it goes to either side", zero=True)
    ratio: Vector = gain((1.0, 2.0, 3.0), "-", "swings of each axis in a period", zero=True)
    phase: Vector = gain((math.pi / 2.0, 0.0, 0.0), "rad", "of each axis at t = 0", signed=True)
    period: Number = gain(10.0, "s", "of the whole figure", low=2.0)


class Lissajous(Path):
    """Once around, in motion from the start."""

    Numbers = LissajousNumbers

    def length(self, numbers: LissajousNumbers) -> Number:
        """One period."""
        return numbers.period

    def reference(self, t: Number, numbers: LissajousNumbers) -> Reference:
        """Sines and their rates."""
        rate = (2.0 * math.pi / numbers.period) * numbers.ratio
        angles = t * rate + numbers.phase
        sines = numbers.size * Vector(sin(angle) for angle in angles)
        cosines = numbers.size * Vector(cos(angle) for angle in angles)
        still = vector(0.0, 0.0, 0.0)
        return Reference(
            numbers.centre + sines, rate * cosines, still - rate * rate * sines, 0.0, 0.0,
            jerk=still - rate * rate * rate * cosines, snap=rate * rate * rate * rate * sines,
        )  # fmt: skip

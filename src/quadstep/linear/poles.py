"""Poles of the sampled loop, given as those of an equivalent continuous loop that agrees with it from period to period."""

import math
from typing import NamedTuple

import numpy as np

from quadstep.linear.modes import Modes
from quadstep.linear.reduced import Reduced
from quadstep.linear.states import Array, short

GONE = 1e-6
"""A mode that decays to less than this share in a period is not shown: it is gone (as in a delay line)."""

STILL = 1e-9
"""A mode that changes by less than this in a period neither grows nor decays."""

NAMED, LEAST = 3, 0.2
"""Most states named of a mode, and the least share of one that is, relative to the largest."""


class Pole(NamedTuple):
    """log(z) / T, z the factor in a period T: real part [1/s], imaginary part [rad/s]. One stands for a conjugate pair.

    states: that take part in the mode, the most involved first.
    """

    real: float
    imaginary: float
    states: tuple[str, ...]

    @property
    def row(self) -> tuple[float, float, str]:
        """For a table; states separated by spaces."""
        return self.real, self.imaginary, " ".join(self.states)

    @property
    def time_constant(self) -> float:
        """[s]; negative for a growing mode, infinite for a neutral one."""
        return math.inf if self.real == 0.0 else -1.0 / self.real

    @property
    def frequency(self) -> float:
        """Natural frequency [rad/s]."""
        return math.hypot(self.real, self.imaginary)

    @property
    def damping(self) -> float:
        """Damping ratio [-]."""
        return -self.real / self.frequency if self.frequency else 0.0


def poles(loop: Reduced, modes: Modes) -> list[Pole]:
    """The poles, growing ones first, then the slowest first."""
    names = short(loop.period.names)
    found = []
    for place, z in enumerate(modes.factors):
        if abs(z) > GONE and z.imag >= 0.0:
            still = modes.still[place] or abs(z - 1.0) < STILL
            s = 0.0 if still else np.log(z) / loop.period.length
            states = tuple(names[i] for i in involved(modes.shares[:, place]))
            found.append(Pole(float(np.real(s)), abs(float(np.imag(s))), states))
    return sorted(found, key=lambda one: (-one.real, one.imaginary))


def involved(shares: Array) -> list[int]:
    """The states that make up most of a mode, in order, at most `NAMED`."""
    order = np.argsort(-shares, kind="stable")[:NAMED]
    return [int(place) for place in order if shares[place] >= LEAST * shares[order[0]]]

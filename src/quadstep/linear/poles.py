"""Poles of the sampled loop, given as those of an equivalent continuous loop that agrees with it from period to period."""

import math
from typing import NamedTuple

import numpy as np

from quadstep.linear.reduced import Reduced

GONE = 1e-6
"""A mode that decays to less than this share in a period is not shown: it is gone (as in a delay line)."""

STILL = 1e-9
"""A mode that changes by less than this in a period neither grows nor decays."""


class Pole(NamedTuple):
    """log(z) / T, z the factor in a period T: real part [1/s], imaginary part [rad/s]. One stands for a conjugate pair."""

    real: float
    imaginary: float

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


def poles(loop: Reduced) -> list[Pole]:
    """The poles, growing ones first, then the slowest first."""
    factors = np.linalg.eigvals(loop.map)
    found = []
    for z in factors:
        if abs(z) > GONE and z.imag >= 0.0:
            s = 0.0 if abs(z - 1.0) < STILL else np.log(complex(z)) / loop.period.length
            found.append(Pole(float(np.real(s)), abs(float(np.imag(s)))))
    return sorted(found, key=lambda one: (-one.real, one.imaginary))

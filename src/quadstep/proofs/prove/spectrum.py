"""Enclosed eigenvalues of a matrix that is known to within a radius: Gershgorin discs in its approximate eigenvectors.

For A within R of M, entry by entry, and M T = T D up to a defect, T^-1 A T = D + T^-1 (A T - T D). The defect is bounded
with the rounding of its own computation (Higham, "Accuracy and Stability of Numerical Algorithms", 2002, section 3.5), T^-1 by
an approximate inverse Y with |I - Y T| < 1 (Rump, "Verification methods", 2010, section 10).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
HALF_UNIT = 2.0**-53
UP = 1.0 + 1e-12
"""More than sums of up to 8,000 positive numbers lose by rounding, relative to themselves."""


class Spectrum(NamedTuple):
    """Discs that contain all eigenvalues, the largest first. Each connected set of discs contains as many as it has discs."""

    centres: ComplexArray
    radii: Array

    @property
    def outside(self) -> int:
        """The number of eigenvalues that are certainly outside the unit circle."""
        size = np.abs(self.centres)
        out = size - self.radii > 1.0 + 1e-15
        inner, outer = np.flatnonzero(~out), np.flatnonzero(out)
        while len(outer):  # discs that touch one that is not outside prove nothing
            apart = np.abs(self.centres[outer, None] - self.centres[None, inner]) * (1.0 - 1e-12)
            touching = ~(apart > self.radii[outer, None] + self.radii[None, inner]).all(axis=1)
            if not touching.any():
                break
            inner, outer = np.concatenate([inner, outer[touching]]), outer[~touching]
        return len(outer)

    @property
    def inside(self) -> bool:
        """Whether all eigenvalues are certainly inside the unit circle."""
        return bool(np.all(np.abs(self.centres) + self.radii < 1.0 - 1e-15))


def products(count: int) -> float:
    """The most that a sum of `count` complex products loses by rounding, relative to the sum of their magnitudes."""
    return 4.0 * count * HALF_UNIT / (1.0 - 4.0 * count * HALF_UNIT)


def spectrum(middle: Array, radius: Array) -> Spectrum | None:
    """The discs for all matrices within `radius` of `middle`, both (n, n); None if the eigenvectors are nearly dependent."""
    count = len(middle)
    values, t = np.linalg.eig(middle)
    try:
        y = np.linalg.inv(t)
    except np.linalg.LinAlgError:
        return None
    size = np.abs(t)
    rounded = products(count + 4) * (np.abs(middle) @ size + size * np.abs(values))
    defect = np.abs(middle @ t - t * values) + rounded + radius @ size
    identity = np.abs(y @ t - np.eye(count)) + products(count + 2) * (np.abs(y) @ size)
    q = float(identity.sum(axis=1).max()) * UP
    if not q < 0.5:
        return None
    bound = np.abs(y) @ defect * UP
    bound = bound + q / (1.0 - q) * bound.max(axis=0)
    order = np.argsort(-np.abs(values))
    return Spectrum(values[order], (bound.sum(axis=1) * UP)[order])

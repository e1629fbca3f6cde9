"""The gain conditions of Theorem 5.1, as printed and as its proof needs them, and that of the coupling it leaves out."""

from typing import NamedTuple

import numpy as np

from quadstep.control.backstepping import BacksteppingGains, largest_inertia, least_gains
from quadstep.engines.fly import FlightPlan
from quadstep.numbers import smallest
from quadstep.proofs.certify.arrays import Array


class ConditionMargins(NamedTuple):
    """Every margin must be above zero.

    j_visited: J_M, the largest eigenvalue of J(eta) over the flight's attitudes; j_anywhere: over all attitudes, 2 max(Sigma).
    position: K_r1 - m Lambda_1 for x, y, z [N s/m]. printed: K_r2 - J_M Lambda_2 for psi, theta, phi, with either J_M.
    corrected: K_r2 - J_M max(Lambda_2), with either J_M [N m s]. k_1, k_2: least entries of position and corrected (visited);
    l_2: least entry of Lambda_2. thrust: the largest u of the flight [N]; thrust_bound: 2 l_2 sqrt(k_1 k_2), below which
    the coupling condition wants it, with either J_M; None where k_1 or k_2 is not positive.
    """

    j_visited: float
    j_anywhere: float
    position: tuple[float, ...]
    printed_visited: tuple[float, ...]
    printed_anywhere: tuple[float, ...]
    corrected_visited: tuple[float, ...]
    corrected_anywhere: tuple[float, ...]
    k_1: float
    k_2: float
    l_2: float
    thrust: float
    thrust_bound: float | None
    thrust_bound_anywhere: float | None

    @property
    def k_min(self) -> float:
        """|K_v|_min of Eq. 61 with the corrected K_v: its smallest eigenvalue."""
        return min(self.k_1, self.k_2)

    @property
    def k_min_printed(self) -> float:
        """The smallest eigenvalue of K_v as Eq. 59 prints it, with J_M over the visited attitudes."""
        return min(self.k_1, *self.printed_visited)

    @property
    def printed_hold(self) -> bool:
        """Whether the printed conditions hold, for any attitude."""
        return min(*self.position, *self.printed_anywhere) > 0.0

    @property
    def hold(self) -> bool:
        """Whether the corrected conditions hold, for the attitudes of this flight."""
        return self.k_min > 0.0

    @property
    def coupling_holds(self) -> bool:
        """Whether the largest thrust is below the bound that makes the form of |r1|, |e2| and |r2| positive definite."""
        return self.thrust_bound is not None and self.thrust < self.thrust_bound

    def broken(self) -> list[str]:
        """The conditions that do not hold, each with its numbers."""
        found = []
        for axis, margin in zip("xyz", self.position, strict=True):
            if margin <= 0.0:
                found.append(f"K_r1 - m Lambda1 = {margin:.4g} N s/m in {axis}, not above 0")
        for angle, margin in zip(("psi", "theta", "phi"), self.corrected_visited, strict=True):
            if margin <= 0.0:
                found.append(
                    f"K_r2 - J_M max(Lambda2) = {margin:.4g} N m s in {angle} with J_M = {self.j_visited:.4g}, not above 0"
                )
        if self.thrust_bound is not None and not self.coupling_holds:
            found.append(
                f"coupling condition: the largest thrust, {self.thrust:.4g} N, is not below "
                f"2 l_2 sqrt(k_1 k_2) = {self.thrust_bound:.4g} N"
            )
        return found


def conditions(plan: FlightPlan, inertia: Array, thrust: Array) -> ConditionMargins:
    """The conditions for a plan's gains, with J along the flight (n, 3, 3) and its thrust (n,)."""
    gains: BacksteppingGains = plan.parameters.gains
    vehicle = plan.parameters.vehicle
    visited, anywhere = float(np.linalg.eigvalsh(inertia)[:, -1].max()), largest_inertia(vehicle.inertia)
    outer, inner = least_gains(gains, vehicle.mass, visited)
    _, inner_anywhere = least_gains(gains, vehicle.mass, anywhere)
    position, corrected = gains.gain_1 - outer, [gain - inner for gain in gains.gain_2]
    k_1, k_2, l_2 = smallest(position), smallest(corrected), smallest(gains.slope_2)

    def bound(inner: float) -> float | None:
        return 2.0 * l_2 * float(np.sqrt(k_1 * inner)) if min(k_1, inner) > 0.0 else None

    def printed(j_m: float) -> tuple[float, ...]:
        return tuple(gains.gain_2 - j_m * gains.slope_2)

    return ConditionMargins(
        j_visited=visited,
        j_anywhere=anywhere,
        position=tuple(position),
        printed_visited=printed(visited),
        printed_anywhere=printed(anywhere),
        corrected_visited=tuple(corrected),
        corrected_anywhere=tuple(gain - inner_anywhere for gain in gains.gain_2),
        k_1=k_1,
        k_2=k_2,
        l_2=l_2,
        thrust=float(thrust.max()),
        thrust_bound=bound(k_2),
        thrust_bound_anywhere=bound(smallest(gains.gain_2) - inner_anywhere),
    )

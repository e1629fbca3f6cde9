"""Theorem 5.1 on a flight: its gain conditions, L of Eq. 55 and its rate along the flight, term by term (Eq. 56 and the terms
that the proof leaves out).
"""

from typing import NamedTuple, cast

import numpy as np

from quadstep.control.backstepping import BacksteppingGains, largest_inertia, least_gains
from quadstep.engines.fly import FlightPlan
from quadstep.numbers import Number, smallest
from quadstep.proofs.certify.history import History, IdealWeights
from quadstep.proofs.plain import Array, apply, as_rows, as_stack, as_vector, dot
from quadstep.vehicle.lagrange import Lagrange
from quadstep.vehicle.paper import acceleration, angular_acceleration, coriolis, effective_inertia, effective_inertia_partials


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
    weight: float
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
                f"the largest thrust, {self.thrust:.4g} N, is not below 2 l_2 sqrt(k_1 k_2) = {self.thrust_bound:.4g} N"
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
        weight=vehicle.mass * vehicle.gravity,
        thrust=float(thrust.max()),
        thrust_bound=bound(k_2),
        thrust_bound_anywhere=bound(smallest(gains.gain_2) - inner_anywhere),
    )


class Matrices(NamedTuple):
    """J(eta), its rate, and C(eta, eta_dot) in Christoffel's form, at each sample, (n, 3, 3) each."""

    inertia: Array
    inertia_rate: Array
    coriolis: Array


class Lyapunov(NamedTuple):
    """Eq. 55 [J], its three parts, and its rate [W] at each sample, (n,) each.

    rate: from the plant's own accelerations, for the law at that sample. differenced: (L_next - L) / period, one shorter.
    The rest are the terms that `rate` is the sum of. dissipation: -r^T (K_r - ...) r. residual: r^T eps. skew: r2^T
    (J_dot / 2 - C) r2, zero for Christoffel's C. learning: tr W_tilde^T (F^-1 W_tilde_dot + mu r^T).
    coupling: -r1^T delta, which Eq. 56 leaves out. filtering: the part of coupling that the command filter's lag makes.
    """

    value: Array
    of_errors: Array
    of_integrals: Array
    of_weights: Array
    rate: Array
    differenced: Array
    dissipation: Array
    residual: Array
    skew: Array
    learning: Array
    coupling: Array
    filtering: Array

    @property
    def terms(self) -> Array:
        """The sum of the terms: Eq. 56 with the coupling term."""
        return self.dissipation + self.residual + self.skew + self.learning + self.coupling


def matrices(plan: FlightPlan, h: History) -> Matrices:
    """J, J_dot and C along a flight."""
    inertia, kinematics, count = plan.parameters.vehicle.inertia, cast(Lagrange, plan.loop.plant).kinematics, len(h.t)
    partials = effective_inertia_partials(h.state.attitude, inertia, kinematics)
    rates = as_rows(h.state.rates, count)
    return Matrices(
        inertia=as_stack(effective_inertia(h.state.attitude, inertia, kinematics), count),
        inertia_rate=sum((rates[:, k, None, None] * as_stack(p, count) for k, p in enumerate(partials)), np.zeros(())),
        coriolis=as_stack(coriolis(h.state.attitude, h.state.rates, inertia, kinematics), count),
    )


def lyapunov(plan: FlightPlan, h: History, m: Matrices, ideal: IdealWeights) -> Lyapunov:
    """L and its rate along a flight, with these ideal weights."""
    gains: BacksteppingGains = plan.parameters.gains
    vehicle, count = plan.parameters.vehicle, len(h.t)
    gain_1, integral_1 = np.array(gains.gain_1.entries), np.array(gains.integral_1.entries)
    gain_2, integral_2 = np.array(gains.gain_2.entries), np.array(gains.integral_2.entries)
    slope_1, slope_2 = np.array(gains.slope_1.entries), np.array(gains.slope_2.entries)

    missing = (ideal.missing(1, h), ideal.missing(2, h))  # W_tilde
    nets = [(gains.force_net, missing[0], h.weight_rates_1), (gains.torque_net, missing[1], h.weight_rates_2)]
    inverse = [1.0 / net.learning_rate if ideal.used else 0.0 for net, _, _ in nets]
    stored = [dot(h.integral_1, integral_1 * h.integral_1), dot(h.integral_2, integral_2 * h.integral_2)]
    weight = [f * np.square(w).sum(axis=(1, 2)) for f, (_, w, _) in zip(inverse, nets, strict=True)]
    kinetic = [vehicle.mass * dot(h.r1, h.r1), dot(h.r2, apply(m.inertia, h.r2))]
    parts = [0.5 * np.broadcast_to(sum(of), len(h.t)) for of in (kinetic, stored, weight)]
    value = sum(parts, np.zeros(()))

    plant = cast(Lagrange, plan.loop.plant)
    force, moment = plant.disturbed(plan.parameters, h.state, cast(Number, h.t))
    moving = as_rows(acceleration(vehicle, h.state.attitude, h.thrust, force), count)  # type: ignore[arg-type]
    pushed = as_vector(h.torque) + moment
    turning = angular_acceleration(vehicle, h.state.attitude, h.state.rates, pushed, plant.kinematics)
    r1_dot = as_rows(h.reference.acceleration, count) - moving + slope_1 * (h.r1 - slope_1 * h.e1)
    r2_dot = h.desired_accelerations - as_rows(turning, count) + slope_2 * (h.r2 - slope_2 * h.e2)
    tuned = sum(-f * (w * rate).sum(axis=(1, 2)) for f, (_, w, rate) in zip(inverse, nets, strict=True))
    rate = (
        vehicle.mass * dot(h.r1, r1_dot)
        + dot(h.r2, apply(m.inertia, r2_dot) + 0.5 * apply(m.inertia_rate, h.r2))
        + dot(h.r1, integral_1 * h.integral_1)
        + dot(h.r2, integral_2 * h.integral_2)
        + tuned
    )

    slowed = dot(h.r1, (gain_1 - vehicle.mass * slope_1) * h.r1) + dot(h.r2, gain_2 * h.r2 - apply(m.inertia, slope_2 * h.r2))
    driven = sum(
        np.einsum("nij,ni,nj->n", w, mu, r) for (_, w, _), mu, r in zip(nets, (h.mu_1, h.mu_2), (h.r1, h.r2), strict=True)
    )
    return Lyapunov(
        value=value,
        of_errors=parts[0],
        of_integrals=parts[1],
        of_weights=parts[2],
        rate=rate,
        differenced=np.diff(value) / h.period,
        dissipation=-slowed,
        residual=dot(h.r1, ideal.fits[0].residual) + dot(h.r2, ideal.fits[1].residual),
        skew=0.5 * dot(h.r2, apply(m.inertia_rate, h.r2)) - dot(h.r2, apply(m.coriolis, h.r2)),
        learning=tuned + driven,
        coupling=-dot(h.r1, h.delta),
        filtering=-dot(h.r1, h.lag),
    )

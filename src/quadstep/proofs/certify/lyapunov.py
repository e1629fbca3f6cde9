"""L of Eq. 55 and its rate along a flight, term by term (Eq. 56 and the terms that the proof leaves out)."""

from typing import NamedTuple, cast

import numpy as np

from quadstep.control.backstepping import BacksteppingGains
from quadstep.engines.fly import FlightPlan
from quadstep.numbers import Number
from quadstep.proofs.certify.arrays import Array, apply, as_rows, as_stack, as_vector, dot
from quadstep.proofs.certify.history import History
from quadstep.proofs.certify.ideal_weights import IdealWeights
from quadstep.vehicle.paper import (
    acceleration,
    angular_acceleration,
    coriolis,
    effective_inertia,
    effective_inertia_partials,
)
from quadstep.vehicle.plants.lagrange import Lagrange


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
        residual=dot(h.r1, ideal.residual_1) + dot(h.r2, ideal.residual_2),
        skew=0.5 * dot(h.r2, apply(m.inertia_rate, h.r2)) - dot(h.r2, apply(m.coriolis, h.r2)),
        learning=tuned + driven,
        coupling=-dot(h.r1, h.delta),
        filtering=-dot(h.r1, h.lag),
    )

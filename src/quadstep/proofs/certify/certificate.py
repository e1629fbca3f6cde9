"""All numbers of a certificate, from one flight."""

import math
from typing import NamedTuple

import numpy as np

from quadstep.engines.fly import FlightPlan, fly
from quadstep.interfaces.closed_loop import Outcome
from quadstep.interfaces.log import FlightLog
from quadstep.io.errors import UserError
from quadstep.proofs.certify.arrays import Array, Mask, lengths
from quadstep.proofs.certify.history import History, recall
from quadstep.proofs.certify.hypotheses import (
    FEWEST_SAMPLES,
    ZERO_THRUST,
    check_flight,
    check_plan,
    first_undefined,
    too_little,
)
from quadstep.proofs.certify.ideal_weights import IdealWeights, ideal_weights, residual_bound, targets, weight_bound
from quadstep.proofs.certify.lyapunov import ConditionMargins, Lyapunov, conditions, lyapunov, matrices


def error_radius(weight_bound: float, residual_bound: float, kappa: float, k_min: float) -> float | None:
    """b_r = (kappa W_B^2 / 4 + eps_N) / K_min (Eq. 63, which prints it without kappa); None if K_min is not positive."""
    return (kappa * (weight_bound * weight_bound) / 4.0 + residual_bound) / k_min if k_min > 0.0 else None


def printed_error_radius(weight_bound: float, residual_bound: float, k_min: float) -> float | None:
    """Eq. 63 as printed."""
    return error_radius(weight_bound, residual_bound, 1.0, k_min)


def weight_radius(weight_bound: float, residual_bound: float, kappas: tuple[float, float]) -> float | None:
    """b_w = W_B/2 + sqrt(W_B^2/4 + eps_N/kappa) (Eq. 65); None without damping.

    Where the nets have different kappas it is the larger root of kappa_min w^2 - kappa_max W_B w = eps_N.
    """
    least, most = min(kappas), max(kappas)
    if least <= 0.0:
        return None
    half = 0.5 * weight_bound * most / least
    return half + math.sqrt(half**2 + residual_bound / least)


class FlightCertificate(NamedTuple):
    """What Theorem 5.1 says about a flight and what the flight did.

    outcome, ended [s]: of the flight; until [s]: the last sample looked at. conditions, ideal, lyapunov: as in their files.
    weight_bound: W_B; residual_bound: eps_N [N, N m]; with _plain: of least squares without a ridge.
    b_r, b_r_printed, b_w: Eqs 63 and 65, None where there is no such radius. r, missing: |r| and |W_tilde| (n,).
    entered: the first sample with |r| <= b_r, which ends the transient; None if there is none.
    """

    outcome: Outcome
    ended: float
    until: float
    history: History
    conditions: ConditionMargins
    ideal: IdealWeights
    lyapunov: Lyapunov
    weight_bound: float
    residual_bound: float
    weight_bound_plain: float
    residual_bound_plain: float
    b_r: float | None
    b_r_printed: float | None
    b_r_plain: float | None
    b_w: float | None
    r: Array
    missing: Array
    entered: int | None

    @property
    def outside(self) -> Mask:
        """Which samples have |r| > b_r; none without b_r."""
        result: Mask = self.r > (np.inf if self.b_r is None else self.b_r)
        return result

    @property
    def coupling_ratio(self) -> Array:
        """|r1| |delta| / (K_min |r|^2) at the samples with |r| > 0; empty if K_min is not positive."""
        moving = self.r > 0.0
        if self.conditions.k_min <= 0.0:
            return np.zeros(0)
        size = lengths(self.history.r1) * lengths(self.history.delta)
        return size[moving] / (self.conditions.k_min * np.square(self.r[moving]))


def certify_plan(plan: FlightPlan) -> FlightCertificate:
    """Fly a plan and certify it. Raises UserError where Theorem 5.1 does not apply.

    A diverging flight is examined up to where its commanded force last defined an attitude.
    """
    check_plan(plan)
    plan = plan._replace(ticks=plan.ticks._replace(log=plan.ticks.every[0]))
    log = fly(plan)
    with np.errstate(over="ignore"):  # a saturated sigmoid is zero or one
        return certify_flight(plan, log)


def certify_flight(plan: FlightPlan, log: FlightLog) -> FlightCertificate:
    """The certificate of a flight of this plan, logged at every control sample. Raises UserError."""
    if len(log.rows) < FEWEST_SAMPLES:
        raise UserError(f"the flight diverged after {len(log.rows)} control samples; certify needs {FEWEST_SAMPLES}")
    history = recall(plan, log)
    check_flight(plan, history)
    undefined = first_undefined(plan, history.wanted)
    if undefined is not None:
        if log.outcome is Outcome.COMPLETED or undefined < FEWEST_SAMPLES:
            what = too_little(plan, history.wanted, undefined)
            raise UserError(f"the controller commands {what} at t = {history.t[undefined]:.4g} s{ZERO_THRUST}")
        history = recall(plan, log._replace(rows=log.rows[:undefined]))
    return certificate(plan, log, history)


def certificate(plan: FlightPlan, log: FlightLog, history: History) -> FlightCertificate:
    gains = plan.parameters.gains
    about = matrices(plan, history)
    ideal = ideal_weights(plan, history, targets(plan, history, about.inertia, about.coriolis))
    asked = conditions(plan, about.inertia, history.thrust)
    kappas = (gains.force_net.damping, gains.torque_net.damping)
    kappa = max(kappas) if ideal.used else 0.0
    size, error = weight_bound(ideal.fits), residual_bound(ideal.fits)
    plain_size, plain_error = weight_bound(ideal.plain), residual_bound(ideal.plain)
    b_r = error_radius(size, error, kappa, asked.k_min)
    r = np.sqrt(np.square(lengths(history.r1)) + np.square(lengths(history.r2)))
    inside = np.flatnonzero(r <= (-1.0 if b_r is None else b_r))
    return FlightCertificate(
        outcome=log.outcome,
        ended=log.ended,
        until=float(history.t[-1]),
        history=history,
        conditions=asked,
        ideal=ideal,
        lyapunov=lyapunov(plan, history, about, ideal),
        weight_bound=size,
        residual_bound=error,
        weight_bound_plain=plain_size,
        residual_bound_plain=plain_error,
        b_r=b_r,
        b_r_printed=printed_error_radius(size, error, asked.k_min_printed),
        b_r_plain=error_radius(plain_size, plain_error, kappa, asked.k_min),
        b_w=weight_radius(size, error, kappas) if ideal.used else None,
        r=r,
        missing=np.hypot(lengths(ideal.missing(1, history)), lengths(ideal.missing(2, history))),
        entered=int(inside[0]) if len(inside) else None,
    )

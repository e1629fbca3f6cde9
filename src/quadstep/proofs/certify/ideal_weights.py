"""The weights that the proof calls ideal: those that fit the nets' true targets (Eqs 22 and 33) on the states of a flight.

The theorem only asks that some weights W fit with an error eps; which are best is a trade, because b_r grows with both
kappa |W|^2 / 4 and eps. Least squares on a flight (one curve in the space of the inputs) is ill-conditioned and can give
huge weights for a slightly smaller error. So a ridge is chosen for each net, from none to infinite, for the smallest b_r.
"""

from typing import NamedTuple, cast

import numpy as np

from quadstep.control.backstepping import BacksteppingGains
from quadstep.engines.fly import FlightPlan
from quadstep.numbers import Number
from quadstep.proofs.certify.arrays import Array, apply, as_rows, lengths
from quadstep.proofs.certify.history import History
from quadstep.vehicle.lagrange import Lagrange

RIDGES = (0.0, *(10.0**power for power in range(-14, 1)), np.inf)
"""Tried ridges, as shares of the largest squared singular value of the basis outputs; infinite: weights of zero."""


class Fit(NamedTuple):
    """One net's weights W (N, 3) and the part of the target they leave: eps (n, 3). ridge: as in `RIDGES`."""

    ridge: float
    weights: Array
    residual: Array


class IdealWeights(NamedTuple):
    """The fits taken for both nets. used: whether there are nets at all; without, the weights are zero.

    plain: the fits by least squares without a ridge. conditions: condition number of each net's basis outputs.
    """

    fits: tuple[Fit, Fit]
    plain: tuple[Fit, Fit]
    conditions: tuple[float, float]
    used: bool

    @property
    def residual_1(self) -> Array:
        """eps_1, (n, 3) [N]."""
        return self.fits[0].residual

    @property
    def residual_2(self) -> Array:
        """eps_2, (n, 3) [N m]."""
        return self.fits[1].residual

    def missing(self, net: int, h: History) -> Array:
        """W_tilde = W - W_hat at each sample, (n, N, 3)."""
        result: Array = self.fits[net - 1].weights - (h.weights_1 if net == 1 else h.weights_2)
        return result


def weight_bound(fits: tuple[Fit, Fit]) -> float:
    """W_B = |(W_1; W_2)|, Frobenius."""
    return float(np.hypot(np.linalg.norm(fits[0].weights), np.linalg.norm(fits[1].weights)))


def residual_bound(fits: tuple[Fit, Fit]) -> float:
    """eps_N = the largest |(eps_1; eps_2)| of the flight."""
    return float(lengths(np.hstack([fit.residual for fit in fits])).max())


def targets(plan: FlightPlan, h: History, inertia: Array, coriolis: Array) -> tuple[Array, Array]:
    """What the nets should output at each sample, (n, 3) each [N] and [N m].

    v_NN1 = -A_xyz (Eq. 22), and if the controller believes another mass m_c than m, (m - m_c) (xi_d_dd - Lambda_1^2 e1 + g)
    as well. v_NN2 = J eta_d_dd - A_eta + C (eta_d_dot + Lambda_2 e2) - J Lambda_2^2 e2 (Eq. 33), eta_d after the filter.
    """
    gains: BacksteppingGains = plan.parameters.gains
    count, slope_1, slope_2 = len(h.t), np.array(gains.slope_1.entries), np.array(gains.slope_2.entries)
    force, moment = (
        as_rows(part, count) for part in cast(Lagrange, plan.loop.plant).disturbed(plan.parameters, h.state, cast(Number, h.t))
    )
    excess = plan.parameters.vehicle.mass - gains.mass
    lift = np.array([0.0, 0.0, gains.gravity])
    first = excess * (as_rows(h.reference.acceleration, count) - slope_1 * slope_1 * h.e1 + lift) - force
    wanted = h.desired_accelerations - slope_2 * slope_2 * h.e2
    return first, apply(inertia, wanted) - moment + apply(coriolis, h.desired_rates + slope_2 * h.e2)


def fit_all(mu: Array, target: Array) -> list[Fit]:
    """The fit of W^T mu = target at every sample, for each ridge."""
    left, sizes, right = np.linalg.svd(mu, full_matrices=False)
    image = left.T @ target
    least = sizes[0] * np.finfo(float).eps * max(mu.shape)
    fits = []
    for ridge in RIDGES:
        scale = np.zeros_like(sizes)
        kept = sizes > least
        if np.isfinite(ridge):
            scale[kept] = sizes[kept] / (sizes[kept] ** 2 + ridge * sizes[0] ** 2)
        weights = right.T @ (scale[:, None] * image)
        fits.append(Fit(float(ridge), weights, target - mu @ weights))
    return fits


def ideal_weights(plan: FlightPlan, h: History, aims: tuple[Array, Array]) -> IdealWeights:
    """The weights with the smallest kappa W_B^2 / 4 + eps_N, the numerator of b_r; zero if the nets never learn."""
    gains: BacksteppingGains = plan.parameters.gains
    if not h.on.any():
        none = tuple(Fit(np.inf, np.zeros((mu.shape[1], 3)), aim) for mu, aim in zip((h.mu_1, h.mu_2), aims, strict=True))
        return IdealWeights((none[0], none[1]), (none[0], none[1]), (np.inf, np.inf), used=False)
    kappa = max(gains.force_net.damping, gains.torque_net.damping)
    firsts, seconds = fit_all(h.mu_1, aims[0]), fit_all(h.mu_2, aims[1])
    errors = [[np.square(fit.residual).sum(axis=1) for fit in fits] for fits in (firsts, seconds)]
    squares = [[float(np.square(fit.weights).sum()) for fit in fits] for fits in (firsts, seconds)]
    cost = [
        [0.25 * kappa * (a + b) + float(np.sqrt((x + y).max())) for b, y in zip(squares[1], errors[1], strict=True)]
        for a, x in zip(squares[0], errors[0], strict=True)
    ]
    i, j = np.unravel_index(np.argmin(cost), (len(RIDGES), len(RIDGES)))
    conditions = tuple(float(np.linalg.cond(mu)) for mu in (h.mu_1, h.mu_2))
    return IdealWeights((firsts[i], seconds[j]), (firsts[0], seconds[0]), (conditions[0], conditions[1]), used=True)

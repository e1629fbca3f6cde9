"""What the paper's controller knew at every sample, recomputed from the log by the functions that flew; and the ideal weights.

The log holds state, thrust and torque; errors follow from them. The controller's memory (integrals, command filter, weights)
is carried forward from sample to sample by the shipped laws. `mismatch` says how far that is from what the log has of it.

Ideal weights are those that fit the nets' true targets (Eqs 22 and 33) on the states of a flight. The theorem only asks that
some weights W fit with an error eps; which are best is a trade, because b_r grows with both kappa |W|^2 / 4 and eps. Least
squares on a flight (one curve in the space of the inputs) is ill-conditioned and can give huge weights for a slightly smaller
error. So a ridge is chosen for each net, from none to infinite, for the smallest b_r.
"""

from typing import NamedTuple, cast

import numpy as np

from quadstep.control.backstepping import BacksteppingGains, desired_force, desired_torque
from quadstep.control.filters import Filtered, command_filter
from quadstep.control.vectoring import invert_force
from quadstep.engines.fly import FlightPlan
from quadstep.interfaces.learning import Net, basis, weight_rate
from quadstep.interfaces.log import FlightLog
from quadstep.interfaces.plant import Reference
from quadstep.numbers import Matrix, Number, Vector
from quadstep.proofs.plain import Array, apply, as_rows, as_vector, dot, lengths
from quadstep.vehicle.lagrange import Lagrange
from quadstep.vehicle.paper import State, thrust_direction

YAW_STEP = 1e-4
"""Half of the time [s] over which psi_d_dd is differenced from the path's psi_d_dot."""


class History(NamedTuple):
    """A flight sample by sample, n of them a control period [s] apart; attitude entries in the order (psi, theta, phi).

    state, reference: of arrays (n,). e1, r1, e2, r2, integral_1, integral_2: (n, 3). desired, desired_rates,
    desired_accelerations: eta_d after the command filter, its rate, and its second rate in the mean over the sample (n, 3).
    wanted: F_d_hat [N]; tilt: (theta_d, phi_d) before the filter (n, 2); delta: the force made less the wanted one [N];
    lag: the part of delta that is due to the command filter; thrust: u [N]; torque: tau [N m].
    mu_1, mu_2: basis outputs (n, N). weights_1, weights_2: W_hat in force (n, N, 3), zero while the nets are off;
    weight_rates_1, weight_rates_2: their rates. on: 1 where the nets learn. excess: how far the applied thrust and torque are
    from the law's [N, N m].
    """

    period: float
    t: Array
    state: State
    reference: Reference
    e1: Array
    r1: Array
    e2: Array
    r2: Array
    integral_1: Array
    integral_2: Array
    desired: Array
    desired_rates: Array
    desired_accelerations: Array
    wanted: Array
    tilt: Array
    delta: Array
    lag: Array
    thrust: Array
    torque: Array
    mu_1: Array
    mu_2: Array
    weights_1: Array
    weights_2: Array
    weight_rates_1: Array
    weight_rates_2: Array
    on: Array
    excess: Array
    mismatch: float

    @property
    def size(self) -> Array:
        """|r|, (n,)."""
        return np.hypot(lengths(self.r1), lengths(self.r2))


def recall(plan: FlightPlan, log: FlightLog) -> History:
    """The history of a flight under the paper's law, logged at every control sample."""
    gains: BacksteppingGains = plan.parameters.gains
    period, count = plan.ticks.step * plan.ticks.every[0], len(log.rows)
    t = log.column("t")
    position, velocity = log.table("x", "y", "z"), log.table("x_dot", "y_dot", "z_dot")
    attitude, rates = log.table("psi", "theta", "phi"), log.table("psi_dot", "theta_dot", "phi_dot")
    state = State(as_vector(position), as_vector(velocity), as_vector(attitude), as_vector(rates))
    reference = reference_at(plan, t)
    on = np.where(t >= gains.learning_start, 1.0, 0.0)

    e1 = as_rows(reference.position - state.position, count)  # Eq. 11
    r1 = as_rows((reference.velocity - state.velocity) + gains.slope_1 * as_vector(e1), count)  # Eq. 12
    integral_1 = summed(period * r1)
    mu_1 = as_rows(basis(gains.force_net, (*state.position, *as_vector(r1), *state.attitude, *state.rates)), count)

    tilt = log.table("theta_d", "phi_d")
    filtered, filtered_rates, second = filter_along(gains, period, state, tilt)
    yaw, yaw_rate = (as_rows((entry,), count) for entry in (reference.yaw, reference.yaw_rate))
    desired, desired_rates = np.hstack([yaw, filtered]), np.hstack([yaw_rate, filtered_rates])
    desired_accelerations = np.hstack([yaw_accelerations(plan, t), second])
    e2 = desired - attitude  # Eq. 27
    r2 = desired_rates - rates + e2 * np.array(gains.slope_2.entries)  # Eq. 28
    integral_2 = summed(period * r2)
    mu_2 = as_rows(basis(gains.torque_net, (*state.attitude, *as_vector(r1), *as_vector(r2))), count)

    size = np.sqrt(dot(r1, r1) + dot(r2, r2))
    weights_1 = learn_along(gains.force_net, gains.weights_1, mu_1, r1, size, on * period)
    weights_2 = learn_along(gains.torque_net, gains.weights_2, mu_2, r2, size, on * period)
    norms = np.stack([np.linalg.norm(weights, axis=(1, 2)) for weights in (weights_1, weights_2)], axis=1)
    weights_1, weights_2 = weights_1 * on[:, None, None], weights_2 * on[:, None, None]

    estimate_1, estimate_2 = (np.einsum("nij,ni->nj", w, mu) for w, mu in ((weights_1, mu_1), (weights_2, mu_2)))
    force = desired_force(gains, reference, as_vector(e1), as_vector(r1), as_vector(integral_1), as_vector(estimate_1))
    u_d, theta_d, phi_d = invert_force(force)
    asked = desired_torque(gains, as_vector(r2), as_vector(integral_2), as_vector(estimate_2))
    thrust, torque = log.column("u"), log.table("tau_psi", "tau_theta", "tau_phi")
    wanted = as_rows(force, count)
    made = thrust[:, None] * as_rows(thrust_direction(state.attitude), count)
    filtered_force = thrust[:, None] * as_rows(thrust_direction(as_vector(desired)), count)

    logged = [tilt, log.table("norm_W1", "norm_W2"), log.table("norm_r1", "norm_r2")]
    again = [as_rows((theta_d, phi_d), count), norms, np.sqrt(np.stack([dot(r1, r1), dot(r2, r2)], axis=1))]
    return History(
        period=period, t=t, state=state, reference=reference, e1=e1, r1=r1, e2=e2, r2=r2,
        integral_1=integral_1, integral_2=integral_2,
        desired=desired, desired_rates=desired_rates, desired_accelerations=desired_accelerations,
        wanted=wanted, tilt=tilt, delta=made - wanted, lag=filtered_force - wanted, thrust=thrust, torque=torque,
        mu_1=mu_1, mu_2=mu_2, weights_1=weights_1, weights_2=weights_2,
        weight_rates_1=learning(gains.force_net, weights_1, mu_1, r1, size, on),
        weight_rates_2=learning(gains.torque_net, weights_2, mu_2, r2, size, on),
        on=on, excess=np.abs(thrust - u_d) + np.linalg.norm(torque - as_rows(asked, count), axis=1),
        mismatch=max(float((np.abs(a - b) / (1.0 + np.abs(a))).max()) for a, b in zip(logged, again, strict=True)),
    )  # fmt: skip


def reference_at(plan: FlightPlan, t: Array) -> Reference:
    """The path at many times, as a reference of arrays."""
    return plan.loop.path.reference(cast(Number, t), plan.parameters.path)


def yaw_accelerations(plan: FlightPlan, t: Array) -> Array:
    """psi_d_dd [rad/s^2], shape (n, 1): a path gives psi_d and psi_d_dot only."""
    before, after = np.maximum(t - YAW_STEP, 0.0), t + YAW_STEP
    rates = [as_rows((reference_at(plan, times).yaw_rate,), len(t)) for times in (before, after)]
    return (rates[1] - rates[0]) / (after - before)[:, None]


def summed(steps: Array) -> Array:
    return np.concatenate([np.zeros((1, 3)), np.cumsum(steps[:-1], axis=0)])


def filter_along(gains: BacksteppingGains, period: float, state: State, tilt: Array) -> tuple[Array, Array, Array]:
    """The command filter's value, rate, and mean second rate over the sample, (n, 2) each; commands: (theta_d, phi_d).

    The mean, because the second rate itself jumps with each sample's command and decays until the next.
    """
    attitude, rates = (as_rows(entries, len(tilt))[0, 1:].tolist() for entries in (state.attitude, state.rates))
    filtered = Filtered(Vector(attitude), Vector(rates))
    values, slopes = [], [filtered.rate.entries]
    for command in tilt.tolist():
        values.append(filtered.value.entries)
        filtered = command_filter(filtered, Vector(command), gains.filter_frequency, period)
        slopes.append(filtered.rate.entries)
    return np.array(values), np.array(slopes[:-1]), np.diff(slopes, axis=0) / period


def learning(net: Net, weights: Array, mu: Array, error: Array, size: Array, on: Array) -> Array:
    """Eq. 54 at many samples at once, shape (n, N, 3): one entry of the law's matrix holds all of them."""
    grown = weight_rate(
        net,
        Matrix([Vector([weights])]),  # type: ignore[list-item]
        Vector([mu[:, :, None]]),  # type: ignore[list-item]
        Vector([error[:, None, :]]),  # type: ignore[list-item]
        size[:, None, None],  # type: ignore[arg-type]
    )
    return on[:, None, None] * np.asarray(grown[0, 0])


def learn_along(net: Net, first: Matrix, mu: Array, error: Array, size: Array, steps: Array) -> Array:
    """The weights at each sample, shape (n, N, 3), by Eq. 54 in steps [s] of the control period (zero while off)."""
    weights = np.empty((*mu.shape, 3))
    now = np.array([list(row) for row in first])
    for k in range(len(mu)):
        weights[k] = now
        if steps[k]:
            one = slice(k, k + 1)
            now = now + learning(net, weights[one], mu[one], error[one], size[one], steps[one])[0]
    return weights


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

    def missing(self, net: int, h: History) -> Array:
        """W_tilde = W - W_hat at each sample, (n, N, 3)."""
        return self.fits[net - 1].weights - (h.weights_1 if net == 1 else h.weights_2)


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

"""L and its rate along the closed loop of the shipped plant and the shipped laws, and the bounds of docs/theory.md."""

from collections.abc import Mapping
from typing import NamedTuple

from quadstep.control.backstepping import (
    Backstepping,
    BacksteppingMemory,
    PositionLoop,
    attitude_errors,
    position_loop,
    torque_basis,
)
from quadstep.control.completed_backstepping import CompletedBackstepping, coupling_columns, with_yaw
from quadstep.control.filters import Filtered
from quadstep.interfaces.learning import output
from quadstep.interfaces.plant import Kinematics
from quadstep.numbers import Matrix, Number, Vector, exp, largest, smallest, sqrt, total
from quadstep.proofs.theory.trials import LoopBatch
from quadstep.vehicle.paper import (
    acceleration,
    angular_acceleration,
    coriolis,
    effective_inertia,
    effective_inertia_partials,
    thrust_direction,
)

STANDARD = Kinematics.STANDARD


class LyapunovRate(NamedTuple):
    """L_dot as flown, the terms of the theorem's identity for it and those of its bound, and the size of the flown terms."""

    flown: Number
    identity: Mapping[str, Number]
    bound: Mapping[str, Number]
    scale: Number


def inner(a: Matrix, b: Matrix) -> Number:
    """trace(a^T b)."""
    return total(x @ y for x, y in zip(a, b, strict=True))


def learning(rate: Number, ideal: Matrix, before: Matrix, after: Matrix, period: Number) -> Number:
    """-trace(W_tilde^T F^-1 W_hat_dot): learning's term in L_dot (Eqs 54-57), from the weights that the law returned."""
    return -inner(ideal - before, (after - before) * (1.0 / period)) / rate


def filtered_command(before: Filtered, after: Filtered, frequency: Number, period: Number) -> Vector:
    """The input of the filter, from its memory before and after a sample."""
    decay, share = exp(-(frequency * period)), 1.0 + frequency * period
    passed = decay * (share * before.value + period * before.rate)
    return (after.value - passed) * (1.0 / (1.0 - decay * share))


class ErrorMotion(NamedTuple):
    """Errors and their rates in closed loop; following: the law's memory after the sample.

    raw_counter, counter: before and after its filter, from the law's memories; zero for the paper's law. torque: that the law
    commands; pushed: the torque on the plant, A_eta included; eta_dd: the resulting acceleration of the plant.
    """

    outer: PositionLoop
    e2: Vector
    r2: Vector
    following: BacksteppingMemory
    raw_counter: Vector
    counter: Vector
    e2_dot: Vector
    r1_dot: Vector
    r2_dot: Vector
    j: Matrix
    j_dot: Matrix
    c: Matrix
    torque: Vector
    pushed: Vector
    eta_dd: Vector


def closed_loop(sample: LoopBatch, completed: bool) -> ErrorMotion:
    """The shipped law's command put into the shipped plant.

    The disturbance is chosen so that Eqs 22 and 33 hold exactly with the sample's ideal weights and residuals. (The completed
    law computes the rigid-body part of Eq. 33 itself, so that only -A_eta is left for its net; the paper's leaves both.)
    """
    state, reference, memory = sample.state, sample.reference, sample.memory
    paper, before, inertia, period = sample.gains.paper, memory.paper, sample.vehicle.inertia, sample.period
    j = effective_inertia(state.attitude, inertia, STANDARD)
    c = coriolis(state.attitude, state.rates, inertia, STANDARD)
    partials = effective_inertia_partials(state.attitude, inertia, STANDARD)
    outer = position_loop(paper, before, state, reference, 1.0)
    e2, r2 = attitude_errors(paper, before.filtered, state, reference)
    wanted_rates, slope_2 = state.rates + r2 - paper.slope_2 * e2, paper.slope_2  # eta_d_dot
    raw_counter = counter = counter_dot = Vector((0.0, 0.0, 0.0))
    if completed:
        command, after = CompletedBackstepping(STANDARD).law(memory, state, reference, sample.gains, 0.0, period)
        following = after.paper
        raw_counter = with_yaw(0.0, filtered_command(memory.counter, after.counter, paper.filter_frequency, period))
        counter = with_yaw(0.0, memory.counter.value)
        r2 = r2 + counter
        counter_dot = with_yaw(0.0, (after.counter.value - memory.counter.value) / period)
    else:
        command, following = Backstepping().law(before, state, reference, paper, 0.0, period)
    mu_2 = torque_basis(paper, state, outer.r1, r2)
    wanted_acceleration = with_yaw(reference.yaw_acceleration, (following.filtered.rate - before.filtered.rate) / period)
    rigid = j @ (wanted_acceleration - slope_2 * (slope_2 * e2)) + c @ (wanted_rates + slope_2 * e2)

    force = -(output(sample.ideal[0], outer.mu_1) + sample.residual[0])  # A_xyz of Eq. 22
    target_2 = output(sample.ideal[1], mu_2) + sample.residual[1]  # Eq. 33
    pushed = command.torque - target_2 if completed else command.torque + rigid - target_2  # tau + A_eta
    xi_dd = acceleration(sample.vehicle, state.attitude, command.thrust, force)
    eta_dd = angular_acceleration(sample.vehicle, state.attitude, state.rates, pushed, STANDARD)
    e2_dot = wanted_rates - state.rates
    return ErrorMotion(
        outer, e2, r2, following, raw_counter, counter, e2_dot,
        r1_dot=reference.acceleration - xi_dd + paper.slope_1 * (reference.velocity - state.velocity),
        r2_dot=wanted_acceleration + slope_2 * e2_dot + counter_dot - eta_dd,
        j=j,
        j_dot=total(rate * partial for rate, partial in zip(state.rates, partials, strict=True)),
        c=c,
        torque=command.torque,
        pushed=pushed,
        eta_dd=eta_dd,
    )  # fmt: skip


def rate_terms(sample: LoopBatch, motion: ErrorMotion, p: Vector) -> list[Number]:
    """The terms of L_dot, L being Eq. 55 extended by 1/2 e2^T P e2."""
    paper, before, period = sample.gains.paper, sample.memory.paper, sample.period
    r1, r2, e2 = motion.outer.r1, motion.r2, motion.e2
    after = motion.following
    return [
        sample.vehicle.mass * (r1 @ motion.r1_dot),
        r2 @ (motion.j @ motion.r2_dot),
        0.5 * (r2 @ (motion.j_dot @ r2)),
        e2 @ (p * motion.e2_dot),
        before.integral_1 @ (paper.integral_1 * (after.integral_1 - before.integral_1)) / period,
        before.integral_2 @ (paper.integral_2 * (after.integral_2 - before.integral_2)) / period,
        learning(paper.force_net.learning_rate, sample.ideal[0], before.weights_1, after.weights_1, period),
        learning(paper.torque_net.learning_rate, sample.ideal[1], before.weights_2, after.weights_2, period),
    ]


def lyapunov_rate(sample: LoopBatch, completed: bool) -> LyapunovRate:
    """L_dot of the closed loop, with the identity and the bound of docs/theory.md. For the paper's law P = p I, any p > 0."""
    motion, paper, before = closed_loop(sample, completed), sample.gains.paper, sample.memory.paper
    p = sample.gains.coupling if completed else Vector([sample.gains.coupling[0]] * 3)
    terms = rate_terms(sample, motion, p)
    r1, r2, e2, u_d, slope_2 = motion.outer.r1, motion.r2, motion.e2, motion.outer.u_d, paper.slope_2
    n1, n2, ne, error_norm = r1.norm(), r2.norm(), e2.norm(), sqrt(r1 @ r1 + r2 @ r2)
    wanted = before.filtered.value
    lag_1 = u_d * (thrust_direction(with_yaw(0.0, motion.outer.tilt)) - thrust_direction(with_yaw(0.0, wanted)))  # delta_f
    lag_2 = p * (motion.raw_counter - motion.counter) if completed else 0.0 * e2

    pairs = list(zip(sample.ideal, (before.weights_1, before.weights_2), strict=True))
    kappa = paper.force_net.damping
    forgetting = kappa * error_norm * total(inner(w - w_hat, w_hat) for w, w_hat in pairs)
    error = sqrt(total(sum_squares(w - w_hat) for w, w_hat in pairs))
    ideal = sqrt(total(sum_squares(w) for w in sample.ideal))
    residual = sqrt(total(e @ e for e in sample.residual))

    surplus_1 = r1 @ ((paper.gain_1 - sample.vehicle.mass * paper.slope_1) * r1)
    surplus_2 = r2 @ (paper.gain_2 * r2) - r2 @ (motion.j @ (slope_2 * r2))
    j_most = 2.0 * largest(sample.vehicle.inertia)  # J_M
    identity = {
        "K_r1 - m Lambda_1": -surplus_1,
        "K_r2 - J Lambda_2": -surplus_2,
        "P Lambda_2": -(e2 @ (p * (slope_2 * e2))),
        "r1 eps_1": r1 @ sample.residual[0],
        "r2 eps_2": r2 @ sample.residual[1],
        "delta_f": r1 @ lag_1,
        "kappa": forgetting,
    }
    bound = {
        "k1": -(smallest(paper.gain_1 - sample.vehicle.mass * paper.slope_1) * n1 * n1),
        "min K_r2": -(smallest(paper.gain_2) * n2 * n2),
        "J_M max Lambda_2": j_most * largest(slope_2) * n2 * n2,
        "min P Lambda_2": -(smallest(p * slope_2) * ne * ne),
        "eps": error_norm * residual,
        "delta_f": n1 * lag_1.norm(),
        "kappa |W~| |W|": kappa * error_norm * error * ideal,
        "kappa |W~|^2": -(kappa * error_norm * error * error),
    }
    if completed:
        identity["c_raw - c"] = e2 @ lag_2
        bound["c_raw - c"] = ne * lag_2.norm()
    else:  # terms that the printed proof drops
        b_theta, b_phi = coupling_columns(Vector(sample.state.attitude.entries[1:]), wanted)
        identity |= {"u r1 B e2": u_d * (r1 @ (b_theta * e2[1] + b_phi * e2[2])), "p e2 r2": e2 @ (p * r2)}
        bound |= {"u |r1| |e2|": u_d * n1 * ne, "p |e2| |r2|": p[0] * ne * n2}
    return LyapunovRate(total(terms), identity, bound, total(abs(term) for term in terms))


def sum_squares(m: Matrix) -> Number:
    return inner(m, m)

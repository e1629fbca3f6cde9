"""Every inequality of docs/theory.md on random states: the worst margin, relative to the terms it is made of."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from quadstep.control.completed_backstepping import coupling_columns, with_yaw
from quadstep.control.projection import project
from quadstep.numbers import Number, Vector, absolute, maximum, total
from quadstep.theory.lyapunov import greatest, inner, least, lyapunov_rate, sum_squares
from quadstep.theory.samples import Sample, draw_sample
from quadstep.vehicle.kinematics import Kinematics, thrust_direction
from quadstep.vehicle.lagrange import coriolis, effective_inertia, effective_inertia_partials

CHUNK = 50_000
ROUND_OFF = 1e-9
"""Relative margin that rounding may cost."""


class Margin(NamedTuple):
    """An inequality: its number in docs/theory.md, what it says, its worst relative margin (negative: broken), samples."""

    number: str
    statement: str
    worst: float
    samples: int

    @property
    def holds(self) -> bool:
        """Whether it held on every sample, up to round-off."""
        return self.worst >= -ROUND_OFF


def relative(larger: Number, smaller: Number, scale: Number) -> Number:
    """(larger - smaller) / scale."""
    margin: Number = (larger - smaller) / np.maximum(scale, 1e-300)
    return margin


def tilts(sample: Sample) -> tuple[Vector, Vector, Vector]:
    """Tilt, filtered tilt, and their difference."""
    tilt, wanted = Vector(sample.state.attitude.entries[1:]), sample.memory.paper.filtered.value
    return tilt, wanted, wanted - tilt


def force_gap(sample: Sample) -> tuple[Vector, Vector]:
    """n(wanted) - n(tilt), and B e2."""
    tilt, wanted, error = tilts(sample)
    b_theta, b_phi = coupling_columns(tilt, wanted)
    gap = thrust_direction(with_yaw(0.0, wanted)) - thrust_direction(with_yaw(0.0, tilt))
    return gap, b_theta * error[0] + b_phi * error[1]


def coupling_identity(sample: Sample) -> Number:
    """B e2 is the gap itself."""
    gap, product = force_gap(sample)
    return -(gap - product).norm()


def coupling_bound(sample: Sample) -> Number:
    """The gap is at most the tilt error."""
    gap, _ = force_gap(sample)
    error = tilts(sample)[2].norm()
    return relative(error, gap.norm(), error)


def column_bounds(sample: Sample) -> Number:
    """Each column of B has length at most 1."""
    tilt, wanted, _ = tilts(sample)
    b_theta, b_phi = coupling_columns(tilt, wanted)
    return 1.0 - maximum(b_theta.norm(), b_phi.norm())


def inertia_bound(sample: Sample) -> Number:
    """r^T J r <= max(Sigma) (1 + |sin theta|) |r|^2 <= J_M |r|^2."""
    attitude, inertia, r = sample.state.attitude, sample.vehicle.inertia, sample.state.rates
    form = r @ (effective_inertia(attitude, inertia, Kinematics.STANDARD) @ r)
    limit: Number = greatest(inertia) * (1.0 + np.abs(np.sin(attitude[1]))) * (r @ r)
    return relative(limit, form, limit)


def gain_bound(sample: Sample) -> Number:
    """r^T (K_r2 - J Lambda_2) r >= (min K_r2 - J_M max Lambda_2) |r|^2, Lambda_2 any positive diagonal."""
    paper, inertia, r = sample.gains.paper, sample.vehicle.inertia, sample.state.rates
    j = effective_inertia(sample.state.attitude, inertia, Kinematics.STANDARD)
    form = r @ (paper.gain_2 * r) - r @ (j @ (paper.slope_2 * r))
    k2 = least(paper.gain_2) - 2.0 * greatest(inertia) * greatest(paper.slope_2)
    return relative(form, k2 * (r @ r), (r @ (paper.gain_2 * r)) + np.abs(k2) * (r @ r))


def skewness(sample: Sample) -> Number:
    """r^T (J_dot - 2 C) r = 0 for Christoffel's C."""
    attitude, rates, inertia = sample.state.attitude, sample.state.rates, sample.vehicle.inertia
    r = sample.memory.paper.integral_1
    partials = effective_inertia_partials(attitude, inertia, Kinematics.STANDARD)
    j_dot = total(rate * partial for rate, partial in zip(rates, partials, strict=True))
    one, two = r @ (j_dot @ r), 2.0 * (r @ (coriolis(attitude, rates, inertia, Kinematics.STANDARD) @ r))
    return -absolute(one - two) / (absolute(one) + absolute(two) + 1e-300)


def trace_bound(sample: Sample) -> Number:
    """trace(W_tilde^T W_hat) <= |W_tilde| |W| - |W_tilde|^2."""
    ideal, weights = sample.ideal[0], sample.memory.paper.weights_1
    error = ideal - weights
    limit = (sum_squares(error) * sum_squares(ideal)) ** 0.5 - sum_squares(error)
    return relative(limit, inner(error, weights), sum_squares(error) + sum_squares(ideal))


def projection(sample: Sample) -> Number:
    """Projection brings no vector farther from one inside the bound."""
    inside, moved = sample.residual[0], sample.memory.paper.integral_1
    bound: Number = 3.0**0.5  # the residuals are inside
    before, after = (moved - inside).norm(), (project(moved, bound) - inside).norm()
    return relative(before, after, before)


def rate_identity(completed: bool) -> Callable[[Sample], Number]:
    """L_dot is as the theorem says, to round-off."""

    def margin(sample: Sample) -> Number:
        rate = lyapunov_rate(sample, completed)
        return -absolute(relative(rate.identity, rate.flown, rate.scale))

    return margin


def rate_bound(completed: bool) -> Callable[[Sample], Number]:
    """L_dot is at most its bound."""

    def margin(sample: Sample) -> Number:
        rate = lyapunov_rate(sample, completed)
        return relative(rate.bound, rate.flown, rate.scale)

    return margin


def small_gain(sample: Sample) -> Number:
    """For p = 2 l2 k2, the quadratic form of the paper's law is positive wherever u_d^2 < 4 k1 k2 l2^2."""
    a = np.abs(np.stack(np.broadcast_arrays(*sample.state.velocity)))  # any positive numbers: |r1|, |e2|, |r2|
    k1, k2, l2 = (
        np.abs(gain[0]) for gain in (sample.gains.paper.gain_1, sample.gains.paper.gain_2, sample.gains.paper.slope_2)
    )
    p, u = 2.0 * l2 * k2, 0.999 * 2.0 * l2 * (k1 * k2) ** 0.5
    positive = k1 * a[0] ** 2 + p * l2 * a[1] ** 2 + k2 * a[2] ** 2
    return relative(positive, u * a[0] * a[1] + p * a[1] * a[2], positive)


CHECKS: tuple[tuple[str, str, Callable[[Sample], Number]], ...] = (
    ("T1", "n(eta_f) - n(eta) = B e2", coupling_identity),
    ("T2", "|n(eta_f) - n(eta)| <= |e2|", coupling_bound),
    ("T3", "each column of B has length at most 1", column_bounds),
    ("T4", "r^T J r <= max(Sigma) (1 + |sin theta|) |r|^2", inertia_bound),
    ("T5", "r^T (K_r2 - J Lambda_2) r >= (min K_r2 - J_M max Lambda_2) |r|^2", gain_bound),
    ("T6", "r^T (J_dot - 2 C) r = 0", skewness),
    ("T7", "tr(W_tilde^T W_hat) <= |W_tilde| |W| - |W_tilde|^2", trace_bound),
    ("T8", "projection never increases |W_tilde|", projection),
    ("T9", "L_dot of the completed law is the theorem's", rate_identity(completed=True)),
    ("T10", "L_dot of the completed law <= its bound", rate_bound(completed=True)),
    ("T11", "L_dot of the paper's law is the theorem's, with the coupling it drops", rate_identity(completed=False)),
    ("T12", "L_dot of the paper's law <= its bound with the coupling", rate_bound(completed=False)),
    ("T13", "the coupling is dominated wherever u_d^2 < 4 k1 k2 l2^2", small_gain),
)


def check_inequalities(samples: int = 1_000_000, seed: int = 1) -> list[Margin]:
    """The worst margin of every inequality over random closed loops."""
    worst = {number: np.inf for number, _, _ in CHECKS}
    done = 0
    while done < samples:
        count = min(CHUNK, samples - done)
        sample = draw_sample(seed * 1_000_003 + done, count)
        for number, _, margin in CHECKS:
            worst[number] = min(worst[number], float(np.min(margin(sample))))
        done += count
    return [Margin(number, statement, worst[number], samples) for number, statement, _ in CHECKS]

"""Every statement of docs/theory.md on closed loops: two sides, the larger one split into terms, so each can be tested."""

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from quadstep.control.backstepping import Backstepping
from quadstep.control.completed_backstepping import coupling_columns, with_yaw
from quadstep.control.vectoring import project
from quadstep.interfaces.plant import Kinematics
from quadstep.numbers import Number, Vector, absolute, largest, smallest, total
from quadstep.proofs.theory.lyapunov import inner, lyapunov_rate, sum_squares
from quadstep.proofs.theory.trials import PERIOD, LoopBatch
from quadstep.vehicle.paper import coriolis, effective_inertia, effective_inertia_partials, thrust_direction


class Sides(NamedTuple):
    """smaller <= the sum of `terms`, or equal to it. scale: size of the numbers in either side, for round-off."""

    smaller: Number
    terms: Mapping[str, Number]
    scale: Number
    equal: bool = False

    @property
    def slack(self) -> Number:
        """Slack of the larger side; for an equation, minus the difference. Negative: violated."""
        apart = total(self.terms.values()) - self.smaller
        return -absolute(apart) if self.equal else apart

    @property
    def size(self) -> Number:
        return total(absolute(term) for term in self.terms.values()) + absolute(self.smaller) + self.scale


class Statement(NamedTuple):
    """A statement. number: in docs/theory.md. says: its text. sides: for a batch of closed loops."""

    number: str
    says: str
    sides: Callable[[LoopBatch], list[Sides]]


def tilts(sample: LoopBatch) -> tuple[Vector, Vector, Vector]:
    """Tilt, filtered tilt, and their difference."""
    tilt, wanted = Vector(sample.state.attitude.entries[1:]), sample.memory.paper.filtered.value
    return tilt, wanted, wanted - tilt


def force_gap(sample: LoopBatch) -> Vector:
    """n(wanted) - n(tilt)."""
    tilt, wanted, _ = tilts(sample)
    return thrust_direction(with_yaw(0.0, wanted)) - thrust_direction(with_yaw(0.0, tilt))


def coupling_identity(sample: LoopBatch) -> list[Sides]:
    """B e2 is the gap itself, along any direction."""
    tilt, wanted, error = tilts(sample)
    b_theta, b_phi = coupling_columns(tilt, wanted)
    way = sample.state.velocity
    terms = {"theta": way @ (b_theta * error[0]), "phi": way @ (b_phi * error[1])}
    return [Sides(way @ force_gap(sample), terms, way.norm(), equal=True)]


def coupling_bound(sample: LoopBatch) -> list[Sides]:
    """The gap is at most the tilt error."""
    error = tilts(sample)[2].norm()
    return [Sides(force_gap(sample).norm(), {"|e2|": error}, 1.0)]  # both directions have length 1


def column_bounds(sample: LoopBatch) -> list[Sides]:
    """Each column of B has length at most 1."""
    tilt, wanted, _ = tilts(sample)
    return [Sides(column.norm(), {"1": 0.0 * column[0] + 1.0}, 1.0) for column in coupling_columns(tilt, wanted)]


def inertia_bounds(sample: LoopBatch) -> list[Sides]:
    """min(Sigma) (1 - |sin theta|) |r|^2 <= r^T J r <= max(Sigma) (1 + |sin theta|) |r|^2."""
    attitude, inertia, r = sample.state.attitude, sample.vehicle.inertia, sample.state.rates
    form = r @ (effective_inertia(attitude, inertia, Kinematics.STANDARD) @ r)
    sine: Number = np.abs(np.sin(attitude[1]))
    low, high = smallest(inertia) * (1.0 - sine) * (r @ r), largest(inertia) * (1.0 + sine) * (r @ r)
    return [Sides(form, {"max(Sigma) (1 + |sin theta|)": high}, high), Sides(low, {"r^T J r": form}, high)]


def gain_bound(sample: LoopBatch) -> list[Sides]:
    """r^T (K_r2 - J Lambda_2) r >= (min K_r2 - J_M max Lambda_2) |r|^2, Lambda_2 any positive diagonal."""
    paper, inertia, r = sample.gains.paper, sample.vehicle.inertia, sample.state.rates
    j = effective_inertia(sample.state.attitude, inertia, Kinematics.STANDARD)
    damped = r @ (paper.gain_2 * r)
    terms = {
        "min K_r2": -(smallest(paper.gain_2) * (r @ r)),
        "J_M max Lambda_2": 2.0 * largest(inertia) * largest(paper.slope_2) * (r @ r),
    }
    return [Sides(r @ (j @ (paper.slope_2 * r)) - damped, terms, damped)]


def skewness(sample: LoopBatch) -> list[Sides]:
    """r^T J_dot r = 2 r^T C r for Christoffel's C, and J_dot = C + C^T."""
    attitude, rates, inertia = sample.state.attitude, sample.state.rates, sample.vehicle.inertia
    r, other = sample.memory.paper.integral_1, sample.state.velocity
    partials = effective_inertia_partials(attitude, inertia, Kinematics.STANDARD)
    j_dot = total(rate * partial for rate, partial in zip(rates, partials, strict=True))
    c = coriolis(attitude, rates, inertia, Kinematics.STANDARD)
    transposed = {"C": other @ (c @ r), "C^T": r @ (c @ other)}
    size = largest(inertia) * rates.norm() * r.norm()
    return [
        Sides(r @ (j_dot @ r), {"2 C": 2.0 * (r @ (c @ r))}, size * r.norm(), equal=True),
        Sides(other @ (j_dot @ r), transposed, size * other.norm(), equal=True),
    ]


def trace_bound(sample: LoopBatch) -> list[Sides]:
    """trace(W_tilde^T W_hat) <= |W_tilde| |W| - |W_tilde|^2."""
    ideal, weights = sample.ideal[0], sample.memory.paper.weights_1
    error = ideal - weights
    terms = {"|W~| |W|": (sum_squares(error) * sum_squares(ideal)) ** 0.5, "|W~|^2": -sum_squares(error)}
    return [Sides(inner(error, weights), terms, sum_squares(error) + sum_squares(ideal))]


def projection(sample: LoopBatch) -> list[Sides]:
    """Projection brings no vector farther from one inside the bound."""
    inside, moved = sample.residual[0], sample.memory.paper.integral_1
    bound = inside.norm() * sample.vehicle.mass + 0.1  # the mass is 0.5 kg or more: some are outside
    inside = project(inside, bound)
    before, after = (moved - inside).norm(), (project(moved, bound) - inside).norm()
    return [Sides(after, {"|W~|": before}, before)]


def rate_of(completed: bool, bounded: bool) -> Callable[[LoopBatch], list[Sides]]:
    """L_dot is as the theorem states, up to round-off; or, bounded, at most its bound."""

    def sides(sample: LoopBatch) -> list[Sides]:
        rate = lyapunov_rate(sample, completed)
        return [Sides(rate.flown, rate.bound if bounded else rate.identity, rate.scale, equal=not bounded)]

    return sides


def small_gain(sample: LoopBatch) -> list[Sides]:
    """For p = 2 l2 k2, the quadratic form of the paper's law is positive wherever u_d^2 < 4 k1 k2 l2^2."""
    a = [absolute(number) for number in sample.state.velocity]  # any positive numbers: |r1|, |e2|, |r2|
    paper = sample.gains.paper
    k1, k2, l2 = paper.gain_1[0], paper.gain_2[0], paper.slope_2[0]
    p, u = 2.0 * l2 * k2, 2.0 * l2 * (k1 * k2) ** 0.5
    positive = {"k1": k1 * a[0] ** 2, "p l2": p * l2 * a[1] ** 2, "k2": k2 * a[2] ** 2}
    return [Sides(u * a[0] * a[1] + p * a[1] * a[2], positive, 0.0 * u)]


def learning_bound(sample: LoopBatch) -> list[Sides]:
    """One sample of Eq. 54: |W^+| <= (1 - s) |W^| + s sqrt(N) / kappa, s = F kappa |r| T, for each net of the paper's law."""
    paper, before = sample.gains.paper, sample.memory.paper
    command, after = Backstepping().law(before, sample.state, sample.reference, paper, 0.0, PERIOD)
    size = (command.r1 @ command.r1 + command.r2 @ command.r2) ** 0.5
    found = []
    for net, old, new in (
        (paper.force_net, before.weights_1, after.weights_1),
        (paper.torque_net, before.weights_2, after.weights_2),
    ):
        share = net.learning_rate * net.damping * size * PERIOD
        neurons = len(net.input_weights.rows)
        terms = {"(1 - s) |W^|": (1.0 - share) * old.norm(), "s sqrt(N) / kappa": share * neurons**0.5 / net.damping}
        found.append(Sides(new.norm(), terms, old.norm()))
    return found


STATEMENTS: tuple[Statement, ...] = (
    Statement("T1", "n(eta_f) - n(eta) = B e2", coupling_identity),
    Statement("T2", "|n(eta_f) - n(eta)| <= |e2|", coupling_bound),
    Statement("T3", "each column of B has length at most 1", column_bounds),
    Statement("T4", "min(Sigma) (1 - |sin theta|) <= J <= max(Sigma) (1 + |sin theta|)", inertia_bounds),
    Statement("T5", "r^T (K_r2 - J Lambda_2) r >= (min K_r2 - J_M max Lambda_2) |r|^2", gain_bound),
    Statement("T6", "r^T (J_dot - 2 C) r = 0, J_dot = C + C^T", skewness),
    Statement("T7", "tr(W_tilde^T W_hat) <= |W_tilde| |W| - |W_tilde|^2", trace_bound),
    Statement("T8", "projection never increases |W_tilde|", projection),
    Statement("T9", "L_dot of the completed law is the theorem's", rate_of(completed=True, bounded=False)),
    Statement("T10", "L_dot of the completed law <= its bound", rate_of(completed=True, bounded=True)),
    Statement(
        "T11", "L_dot of the paper's law is the theorem's, with the coupling it drops", rate_of(completed=False, bounded=False)
    ),
    Statement("T12", "L_dot of the paper's law <= its bound with the coupling", rate_of(completed=False, bounded=True)),
    Statement("T13", "the coupling is dominated wherever u_d^2 < 4 k1 k2 l2^2", small_gain),
    Statement("T16", "a sample of Eq. 54 keeps |W_hat| <= sqrt(N) / kappa", learning_bound),
)

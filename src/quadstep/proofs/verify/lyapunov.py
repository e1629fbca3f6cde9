"""Random moments of flight under the shipped law and plant, as NumPy batches, with L_dot and every quantity of the proof.

The disturbance is chosen so that each net's ideal weights and error are known, so every inequality of the proof has numbers.
"""

from typing import NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from quadstep.control.backstepping import FORCE_INPUTS, TORQUE_INPUTS, BacksteppingGains, BacksteppingMemory, torque_basis
from quadstep.control.completed_backstepping import CompletedGains, CompletedMemory, with_yaw
from quadstep.control.filters import Filtered
from quadstep.interfaces.learning import Net, random_input_weights
from quadstep.interfaces.plant import Reference
from quadstep.numbers import Matrix, Number, Vector, sqrt, total
from quadstep.proofs.theory.lyapunov import closed_loop, inner, rate_terms
from quadstep.proofs.theory.trials import LoopBatch
from quadstep.vehicle.paper import Rotors, State, Vehicle, thrust_direction

Batch = NDArray[np.float64]
COUNT, NEURONS, PERIOD = 4000, 4, 1e-3
ZERO = Vector((0.0, 0.0, 0.0))


class LyapunovBatch(NamedTuple):
    """One number per entry and flight. l_dot: by the chain rule from the laws and the plant.

    delta: F_d less F_d_hat. growth: tr W_tilde^T (F^-1 W_tilde_dot + mu_r). k_v: smallest eigenvalue of the corrected K_v.
    """

    r1: Vector
    r2: Vector
    j: Matrix
    j_dot: Matrix
    c: Matrix
    eps_1: Vector
    eps_2: Vector
    delta: Vector
    gains: BacksteppingGains
    growth: Batch
    trace: Batch
    l_dot: Batch
    k_v: Batch

    @property
    def r(self) -> Batch:
        """|r|, both filtered errors together."""
        return batch(sqrt(self.r1 @ self.r1 + self.r2 @ self.r2))

    @property
    def eps(self) -> Batch:
        """|eps_v|."""
        return batch(sqrt(self.eps_1 @ self.eps_1 + self.eps_2 @ self.eps_2))


class WeightNorms(NamedTuple):
    """Frobenius norms of the ideal weights and of their error, both nets together, and the ideal ones themselves."""

    ideal: Batch
    error: Batch


def batch(number: Number | Batch) -> Batch:
    """A number of a law as the array that it is here."""
    return np.asarray(number, dtype=np.float64)


def frobenius(*matrices: Matrix) -> Batch:
    """Norm of several stacked matrices."""
    return batch(sqrt(total(m.norm() * m.norm() for m in matrices)))


def moments(
    seed: int, at_desired_attitude: bool = True, sliding: bool = False, half_learnt: bool = False
) -> tuple[LyapunovBatch, WeightNorms]:
    """COUNT random moments; r and the weights' error spread over decades.

    at_desired_attitude: the force is the desired one (delta = 0). sliding: r1 = r2 = 0.
    half_learnt: W_hat = W / 2 and r2 small, where the tuning law raises L the most.
    """
    draw = np.random.default_rng(seed)

    def spread(rows: int, low: float, high: float) -> Vector:
        scale = 10.0 ** draw.uniform(low, high, COUNT)
        return Vector(scale * entry for entry in draw.normal(size=(rows, COUNT)))

    def positive(low: float, high: float) -> Vector:
        return Vector(draw.uniform(low, high, (3, COUNT)))

    def weights(low: float, high: float) -> Matrix:
        flat = spread(3 * NEURONS, low, high).entries
        return Matrix(Vector(flat[3 * i : 3 * i + 3]) for i in range(NEURONS))

    def between(low: float, high: float) -> Number:
        return cast(Number, draw.uniform(low, high, COUNT))

    attitude = Vector([between(-3, 3), between(-1.2, 1.2), between(-3, 3)])
    state = State(spread(3, -1, 0.5), spread(3, -1, 0.5), attitude, spread(3, -1, 0.5))
    mass, inertia = between(0.5, 2), positive(2, 9)
    heaviest = np.max(np.array(inertia.entries), axis=0)
    slope_1, slope_2 = positive(0.5, 4), positive(1, 20)
    steepest = np.max(np.array(slope_2.entries), axis=0)
    margin_1, margin_2 = positive(0.5, 5), positive(0.5, 50)
    ideal_1, ideal_2 = weights(-2, 1), weights(-2, 1)
    rate, kappa = between(0.5, 9), 10.0 ** between(-2, 1)
    gains = BacksteppingGains(
        mass=mass, gravity=9.81, slope_1=slope_1, gain_1=mass * slope_1 + margin_1, integral_1=positive(0, 2),
        slope_2=slope_2, gain_2=Vector(2.0 * heaviest * steepest + entry for entry in margin_2), integral_2=positive(0, 20),
        filter_frequency=100.0,
        force_net=Net(random_input_weights(seed, 1, NEURONS, FORCE_INPUTS), rate, kappa),
        torque_net=Net(random_input_weights(seed, 2, NEURONS, TORQUE_INPUTS), rate, kappa),
        learning_start=0.0,
        weights_1=ideal_1 * 0.5 if half_learnt else ideal_1 - weights(-2, 1.5),
        weights_2=ideal_2 * 0.5 if half_learnt else ideal_2 - weights(-2, 1.5),
    )  # fmt: skip
    turning = spread(3, -1, 0.5)[0]  # psi_d_dd
    e1, e2 = spread(3, -2, 1), spread(3, -2, 0.5)
    r1, r2 = (0.0 * e1, 0.0 * e2) if sliding else (spread(3, -2, 1.5), spread(3, -2, 1.5))
    r2 = 1e-3 * r2 if half_learnt else r2
    desired, desired_rate = state.attitude + e2, state.rates + (r2 - slope_2 * e2)
    reference = Reference(
        state.position + e1, state.velocity + (r1 - slope_1 * e1), spread(3, -1, 0.5), desired[0], desired_rate[0],
        yaw_acceleration=turning,
    )  # fmt: skip
    filtered = Filtered(Vector(desired.entries[1:]), Vector(desired_rate.entries[1:]))
    memory = BacksteppingMemory(spread(3, -1, 0.5), spread(3, -1, 0.5), filtered, gains.weights_1, gains.weights_2)
    sample = LoopBatch(
        Vehicle(mass, inertia, 9.81, Rotors(0.25, 0.05, 0.0, 8.0)), state, reference,
        CompletedGains(gains, ZERO, inertia, ZERO, ZERO), CompletedMemory(memory, Filtered(ZERO, ZERO)),
        (ideal_1, ideal_2), (spread(3, -2, 1), spread(3, -2, 1)), PERIOD,
    )  # fmt: skip
    motion = closed_loop(sample, completed=False)
    r1, r2 = motion.outer.r1, motion.r2
    delta = motion.outer.u_d * (thrust_direction(attitude) - thrust_direction(with_yaw(0.0, motion.outer.tilt)))
    if at_desired_attitude:
        motion = motion._replace(r1_dot=motion.r1_dot + delta * (1.0 / mass))
    terms = rate_terms(sample, motion, ZERO)

    w_tilde = (ideal_1 - memory.weights_1, ideal_2 - memory.weights_2)
    mu = (motion.outer.mu_1, torque_basis(gains, state, r1, r2))
    mu_r = total(r @ (w.T @ mu) for r, w, mu in zip((r1, r2), w_tilde, mu, strict=True))
    moment = LyapunovBatch(
        r1, r2, motion.j, motion.j_dot, motion.c, *sample.residual, delta, gains,
        growth=batch(mu_r + total(terms[-2:])),  # the last two are those of learning
        trace=batch(total(inner(w, hat) for w, hat in zip(w_tilde, (memory.weights_1, memory.weights_2), strict=True))),
        l_dot=batch(total(terms)),
        k_v=np.min(np.array([*margin_1, *margin_2]), axis=0),
    )  # fmt: skip
    return moment, WeightNorms(frobenius(ideal_1, ideal_2), frobenius(*w_tilde))

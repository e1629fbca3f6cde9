"""Adaptive neural backstepping, the paper's controller: Eqs 11-54 in the order of its Fig. 2."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from quadstep.control.filters import Filtered, command_filter
from quadstep.control.vectoring import invert_force
from quadstep.interfaces.controller import Command, Condition, Controller
from quadstep.interfaces.gain import ANGLES, AXES, believed, gain, given
from quadstep.interfaces.learning import Net, basis, net, nets_start, output, weight_rate, weights
from quadstep.interfaces.plant import Model, Reference
from quadstep.numbers import Matrix, Number, Vector, largest, maximum, smallest, sqrt, vector, where
from quadstep.vehicle.paper import State

FORCE_INPUTS = 12
"""chi_1 = (xi, r1, eta, eta_dot), after Eq. 22."""

TORQUE_INPUTS = 9
"""chi_2 = (eta, r1, r2), after Eq. 33."""


class BacksteppingGains(NamedTuple):
    """Design parameters; diagonal matrices as vectors, attitude entries in the order (psi, theta, phi).

    force_net, torque_net: the nets of Eq. 23 and Eq. 34. learning_start: when they switch on [s]; infinite for never.
    weights_1 [m/s^2], weights_2 [rad/s^2]: W_hat at that moment, (N, 3).
    """

    mass: Number = believed("mass")
    gravity: Number = given(lambda model: model.gravity)
    slope_1: Vector = gain(1.0, "1/s", "decay rate of the position error while r1 = 0 (Eq. 12)", key="Lambda1")
    gain_1: Vector = gain(3.0, "N s/m", "gain of r1, the filtered error; the theorem requires K_r1 > m Lambda1", key="K_r1")
    integral_1: Vector = gain(0.2, "N/m", "gain of the integral of r1 (Eq. 24)", key="K_i1", zero=True, high=2.0)
    slope_2: Vector = gain(15.0, "1/s", "decay rate of the attitude error while r2 = 0 (Eq. 28)", key="Lambda2", parts=ANGLES)
    gain_2: Vector = gain(
        250.0, "N m s", "gain of r2; Theorem 5.1: K_r2 > J_M max(Lambda2), J_M = 2 max(inertia)", key="K_r2", parts=ANGLES
    )
    integral_2: Vector = gain(
        10.0, "N m", "gain of the integral of r2 (Eq. 35)", key="K_i2", parts=ANGLES, zero=True, high=100.0
    )
    filter_frequency: Number = gain(100.0, "rad/s", "bandwidth of the command filter of theta_d and phi_d")
    force_net: Net = net(1, FORCE_INPUTS, rate=5.0, damping=0.01)
    torque_net: Net = net(2, TORQUE_INPUTS, rate=5.0, damping=0.01)
    learning_start: Number = nets_start()
    weights_1: Matrix = weights(1)
    weights_2: Matrix = weights(2)


class BacksteppingMemory(NamedTuple):
    """integral_1 [m], integral_2 [rad]: integrals of r1 and r2. filtered: command filter of (theta, phi).

    weights_1 [m/s^2], weights_2 [rad/s^2]: W_hat_1, W_hat_2, (N, 3).
    """

    integral_1: Vector
    integral_2: Vector
    filtered: Filtered
    weights_1: Matrix
    weights_2: Matrix


def desired_force(
    gains: BacksteppingGains, reference: Reference, e1: Vector, r1: Vector, integral: Vector, estimate: Vector
) -> Vector:
    """F_d_hat [N] (Eq. 19, Eq. 24): m xi_d_dd - m Lambda_1^2 e1 - m_g + W_hat_1^T mu_1 + K_r1 r1 + K_i1 int r1."""
    m_g = vector(0.0, 0.0, -gains.mass * gains.gravity)
    feedback = gains.gain_1 * r1 + gains.integral_1 * integral
    return gains.mass * (reference.acceleration - gains.slope_1 * gains.slope_1 * e1) - m_g + estimate + feedback


def desired_torque(gains: BacksteppingGains, r2: Vector, integral: Vector, estimate: Vector) -> Vector:
    """tau [N m] (Eq. 35): W_hat_2^T mu_2 + K_r2 r2 + K_i2 int r2."""
    return estimate + gains.gain_2 * r2 + gains.integral_2 * integral


def largest_inertia(inertia: Vector) -> Number:
    """J_M = 2 max(Sigma) [kg m^2]: bounds J = T^T Sigma T everywhere, as T^T T's eigenvalues are at most 1 + |sin theta|."""
    return 2.0 * largest(inertia)


def least_gains(gains: BacksteppingGains, mass: Number, j_m: Number) -> tuple[Vector, Number]:
    """What Theorem 5.1, corrected, wants K_r1 and each entry of K_r2 to exceed: m Lambda_1 and J_M max(Lambda_2)."""
    return mass * gains.slope_1, j_m * largest(gains.slope_2)


def theorem_conditions(gains: BacksteppingGains, model: Model) -> list[Condition]:
    """The gain conditions of Theorem 5.1, corrected, with the mass that flies, whatever the controller assumes."""
    outer, inner = least_gains(gains, model.mass, largest_inertia(model.inertia))
    position = zip(AXES, gains.gain_1, outer, strict=True)
    attitude = zip(ANGLES, gains.gain_2, strict=True)
    return [
        *(Condition(f"K_r1 ({axis}) > m Lambda1", k, least, "Theorem 5.1", unit="N s/m") for axis, k, least in position),
        *(Condition(f"K_r2 ({angle}) > J_M max(Lambda2)", k, inner, "Theorem 5.1", unit="N m s") for angle, k in attitude),
    ]


def coupling_condition(gains: BacksteppingGains, model: Model) -> Condition:
    """u < 2 l_2 sqrt(k_1 k_2), squared, for the thrust of hovering: what the printed proof leaves out."""
    outer, inner = least_gains(gains, model.mass, largest_inertia(model.inertia))
    k_1, k_2 = smallest(gains.gain_1 - outer), smallest(gains.gain_2) - inner
    l_2 = smallest(gains.slope_2)
    hover = model.mass * model.gravity
    room = 4.0 * l_2 * l_2 * maximum(0.0, k_1) * maximum(0.0, k_2)
    text = "4 l_2^2 k_1 k_2 > (m g)^2, with l_2 the least Lambda2, k_1 and k_2 the least margins of K_r1 and K_r2 above"
    return Condition(text, room, hover * hover, "repaired theorem (at hover)", warned=False, unit="N^2")


class PositionLoop(NamedTuple):
    """What the outer loop computes. r1 [m/s]; mu_1: the first net's basis; then u_d [N] and (theta_d, phi_d) [rad]."""

    r1: Vector
    mu_1: Vector
    u_d: Number
    tilt: Vector


def position_loop(
    gains: BacksteppingGains, memory: BacksteppingMemory, measured: State, reference: Reference, on: Number
) -> PositionLoop:
    """Outer loop: errors, net, wanted force, inversion (Eqs 11-24 and 40-52). on: 1 where the nets are switched on."""
    e1 = reference.position - measured.position  # Eq. 11
    r1 = (reference.velocity - measured.velocity) + gains.slope_1 * e1  # Eq. 12
    mu_1 = basis(gains.force_net, (*measured.position, *r1, *measured.attitude, *measured.rates))
    estimate_1 = on * output(memory.weights_1, mu_1)  # Eq. 23
    force = desired_force(gains, reference, e1, r1, memory.integral_1, estimate_1)  # Eq. 24
    u_d, theta_d, phi_d = invert_force(force)  # Eqs 40-52
    return PositionLoop(r1, mu_1, u_d, vector(theta_d, phi_d))


def attitude_errors(
    gains: BacksteppingGains, filtered: Filtered, measured: State, reference: Reference
) -> tuple[Vector, Vector]:
    """(e2 [rad], r2 [rad/s]) of Eq. 27 and Eq. 28. Yaw and its rate come from the path, theta_d and phi_d from the filter."""
    desired = Vector((reference.yaw, *filtered.value))
    desired_rates = Vector((reference.yaw_rate, *filtered.rate))
    e2 = desired - measured.attitude  # Eq. 27
    r2 = (desired_rates - measured.rates) + gains.slope_2 * e2  # Eq. 28
    return e2, r2


def torque_basis(gains: BacksteppingGains, measured: State, r1: Vector, r2: Vector) -> Vector:
    """mu_2(chi_2) of Eq. 34."""
    return basis(gains.torque_net, (*measured.attitude, *r1, *r2))


def following_memory(
    gains: BacksteppingGains, memory: BacksteppingMemory, outer: PositionLoop, mu_2: Vector, r2: Vector,
    period: Number, on: Number,
) -> BacksteppingMemory:  # fmt: skip
    """The memory one `period` [s] later: integrals, command filter, and the tuning laws of Eq. 54."""
    r1, mu_1 = outer.r1, outer.mu_1
    learning = on * period  # Eq. 54 is linear in the errors: their rates times this are what the weights change by
    moved = learning * sqrt(r1 @ r1 + r2 @ r2)
    change_1 = weight_rate(gains.force_net, memory.weights_1, mu_1, learning * r1, moved)
    change_2 = weight_rate(gains.torque_net, memory.weights_2, mu_2, learning * r2, moved)
    return BacksteppingMemory(
        integral_1=memory.integral_1 + period * r1,
        integral_2=memory.integral_2 + period * r2,
        filtered=command_filter(memory.filtered, outer.tilt, gains.filter_frequency, period),
        weights_1=memory.weights_1 + change_1,
        weights_2=memory.weights_2 + change_2,
    )


def command_of(
    gains: BacksteppingGains, memory: BacksteppingMemory, outer: PositionLoop, reference: Reference,
    torque: Vector, r2: Vector,
) -> Command:  # fmt: skip
    """The command with what the log wants to know."""
    stored_1 = memory.integral_1 @ (gains.integral_1 * memory.integral_1)
    stored_2 = memory.integral_2 @ (gains.integral_2 * memory.integral_2)
    return Command(
        thrust=outer.u_d,
        torque=torque,
        desired_attitude=Vector((reference.yaw, *outer.tilt)),
        r1=outer.r1,
        r2=r2,
        stored=0.5 * (stored_1 + stored_2),
        weight_norms=vector(memory.weights_1.norm(), memory.weights_2.norm()),
    )


def start_memory(measured: State, gains: BacksteppingGains) -> BacksteppingMemory:
    """Integrals at zero, the filter at the measured attitude, the nets at their initial weights."""
    zero = vector(0.0, 0.0, 0.0)
    tilt, tilt_rate = Vector(measured.attitude.entries[1:]), Vector(measured.rates.entries[1:])
    return BacksteppingMemory(zero, zero, Filtered(tilt, tilt_rate), gains.weights_1, gains.weights_2)


@dataclass(frozen=True)
class Backstepping(Controller):
    """The paper's adaptive controller, sampled."""

    name = "backstepping"
    label = "adaptive backstepping (the paper's)"
    theorem = True
    source = "Das, Lewis, Subbarao 2009"
    Gains = BacksteppingGains
    measures = State

    def start(self, measured: State, gains: BacksteppingGains) -> BacksteppingMemory:
        return start_memory(measured, gains)

    def law(
        self, memory: BacksteppingMemory, measured: State, reference: Reference, gains: BacksteppingGains,
        t: Number, period: Number,
    ) -> tuple[Command, BacksteppingMemory]:  # fmt: skip
        """One sample: outer position loop, inner attitude loop, learning."""
        on = where(t >= gains.learning_start, 1.0, 0.0)
        outer = position_loop(gains, memory, measured, reference, on)
        _, r2 = attitude_errors(gains, memory.filtered, measured, reference)
        mu_2 = torque_basis(gains, measured, outer.r1, r2)
        estimate_2 = on * output(memory.weights_2, mu_2)  # Eq. 34
        torque = desired_torque(gains, r2, memory.integral_2, estimate_2)  # Eq. 35
        following = following_memory(gains, memory, outer, mu_2, r2, period, on)
        return command_of(gains, memory, outer, reference, torque, r2), following

    def conditions(self, gains: BacksteppingGains, model: Model) -> Sequence[Condition]:
        """Theorem 5.1's, and that of the coupling between both loops."""
        return [*theorem_conditions(gains, model), coupling_condition(gains, model)]

"""The paper's quadrotor: state, kinematics, Lagrange dynamics (Eqs 1-10, 66), rotor map (Eq. 5), disturbance (Eq. 67)."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

from quadstep.interfaces.plant import Kinematics
from quadstep.numbers import Matrix, Number, Vector, clip, cos, matrix, sin, solve_symmetric, total, vector


class State(NamedTuple):
    """The twelve states of Eq. 7 and Eq. 8: q = (xi, eta) and their rates.

    position [m]: xi = (x, y, z), inertial frame, z up.
    velocity [m/s]: xi_dot.
    attitude [rad]: eta = (psi, theta, phi) = (yaw, pitch, roll), in this order everywhere.
    rates [rad/s]: eta_dot = (psi_dot, theta_dot, phi_dot), Euler rates, not body rates.
    """

    position: Vector
    velocity: Vector
    attitude: Vector
    rates: Vector


def euler_rate_matrix(attitude: Vector, kinematics: Kinematics) -> Matrix:
    """T_eta of Eq. 4, shape (3, 3): body rates = T_eta @ (psi_dot, theta_dot, phi_dot)."""
    theta, angle = attitude[1], attitude[kinematics.angle]
    sin_theta, cos_theta, s, c = sin(theta), cos(theta), sin(angle), cos(angle)
    if kinematics is Kinematics.RIGID:
        return matrix((0.0, s, -c * cos_theta), (0.0, -c, -s * cos_theta), (-1.0, 0.0, sin_theta))
    return matrix((-sin_theta, 0.0, 1.0), (cos_theta * s, c, 0.0), (cos_theta * c, -s, 0.0))


def euler_rate_partials(attitude: Vector, kinematics: Kinematics) -> tuple[Matrix, Matrix, Matrix]:
    """dT_eta/dpsi, dT_eta/dtheta, dT_eta/dphi, each of shape (3, 3)."""
    theta, angle = attitude[1], attitude[kinematics.angle]
    sin_theta, cos_theta, s, c = sin(theta), cos(theta), sin(angle), cos(angle)
    if kinematics is Kinematics.RIGID:
        by_theta = matrix((0.0, 0.0, c * sin_theta), (0.0, 0.0, s * sin_theta), (0.0, 0.0, cos_theta))
        by_angle = matrix((0.0, c, s * cos_theta), (0.0, s, -c * cos_theta), (0.0, 0.0, 0.0))
    else:
        by_theta = matrix((-cos_theta, 0.0, 0.0), (-sin_theta * s, 0.0, 0.0), (-sin_theta * c, 0.0, 0.0))
        by_angle = matrix((0.0, 0.0, 0.0), (cos_theta * c, -s, 0.0), (-cos_theta * s, -c, 0.0))
    nothing = matrix((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    return (nothing, by_theta, by_angle) if kinematics.angle == 2 else (by_angle, by_theta, nothing)


def thrust_direction(attitude: Vector) -> Vector:
    """Unit vector of the thrust in the inertial frame (Eq. 7): (-sin theta, cos theta sin phi, cos theta cos phi).

    The paper's form is free of yaw; it is R e3 for R = Rx(-phi) Ry(-theta) Rz(-psi), yaw innermost.
    """
    _, theta, phi = attitude
    return vector(-sin(theta), cos(theta) * sin(phi), cos(theta) * cos(phi))


class Rotors(NamedTuple):
    """Four rotors, whose thrusts make the thrust and the three torques by Eq. 5.

    The reading taken (the paper's text, signs and angles fit no single one): with the paper's left-handed angles, where
    positive phi tilts the thrust towards +y and positive theta towards -x, rotor 1 sits at -y, 2 at -x, 3 at +y, 4 at +x.
    Rotors 1 and 3 push psi up and so turn counter-clockwise seen from above (positive psi is clockwise), 2 and 4 the other
    way. The text has it reversed (front and rear counter-clockwise); Eq. 5 is kept as printed.

    arm: l, motor to centre of gravity [m]. moment: c, torque per thrust [m]. minimum, maximum: thrust of one [N].
    """

    arm: Number
    moment: Number
    minimum: Number
    maximum: Number


def rotor_map(rotors: Rotors) -> Matrix:
    """M of Eq. 5, shape (4, 4): (u, tau_phi, tau_theta, tau_psi) = M (f1, f2, f3, f4). det M = 8 c l^2."""
    l, c = rotors.arm, rotors.moment  # noqa: E741 (the paper's symbols)
    return matrix((1.0, 1.0, 1.0, 1.0), (l, 0.0, -l, 0.0), (0.0, -l, 0.0, l), (c, -c, c, -c))


def mix(rotors: Rotors, thrusts: Vector) -> tuple[Number, Vector]:
    """(u [N], tau = (tau_psi, tau_theta, tau_phi) [N m]) that four rotor thrusts [N] make (Eq. 5)."""
    u, tau_phi, tau_theta, tau_psi = rotor_map(rotors) @ thrusts
    return u, vector(tau_psi, tau_theta, tau_phi)


def allocate(rotors: Rotors, thrust: Number, torque: Vector) -> Vector:
    """The four rotor thrusts [N] that make `thrust` [N] and `torque` (psi, theta, phi) [N m]: the inverse of Eq. 5."""
    tau_psi, tau_theta, tau_phi = torque
    mean, yaw = 0.25 * thrust, 0.25 * tau_psi / rotors.moment
    pitch, roll = 0.5 * tau_theta / rotors.arm, 0.5 * tau_phi / rotors.arm
    return vector(mean + roll + yaw, mean - pitch - yaw, mean - roll + yaw, mean + pitch - yaw)


def limit(rotors: Rotors, thrust: Number, torque: Vector) -> tuple[Number, Vector]:
    """What is left of a wanted thrust and torque when every rotor keeps to its limits."""
    return mix(rotors, Vector(clip(f, rotors.minimum, rotors.maximum) for f in allocate(rotors, thrust, torque)))


class Disturbance(NamedTuple):
    """scale: factor on the paper's disturbance, Eq. 67 [-]. force [N] (inertial), torque [N m] (generalised): constant."""

    scale: Number
    force: Vector
    torque: Vector


def disturb(disturbance: Disturbance, state: State) -> tuple[Vector, Vector]:
    """(A_xyz [N], A_eta [N m]) at a state.

    Eq. 67 prints two 3x2 arrays; the products along each row, (x_dot phi_dot, y_dot theta_dot, z_dot psi_dot), are
    meant: only they leave tau_psi = 0 in Case 1 and tau_phi = 0 in Case 2.
    """
    x_dot, y_dot, z_dot = state.velocity
    psi_dot, theta_dot, phi_dot = state.rates
    products = disturbance.scale * Vector((x_dot * phi_dot, y_dot * theta_dot, z_dot * psi_dot))
    return products + disturbance.force, products + disturbance.torque


@dataclass(frozen=True)
class DeclaredDisturbance(ABC):
    """A_xyz and A_eta of Eqs 9 and 10 in place of Eq. 67, in a file of your own; structure only, so it has no fields.

        [disturbance]
        type = "my_disturbance.py:Tether"

    Numbers: a `NamedTuple` of declarations (`interfaces/gain.py`), each with a default, from which the keys of
    `[disturbance]` follow.

    >>> from typing import NamedTuple
    >>> from quadstep.interfaces.gain import gain
    >>> from quadstep.numbers import vector
    >>> from quadstep.vehicle.paper import DeclaredDisturbance
    >>> from quadstep.vehicle.paper import State
    >>> class SpringNumbers(NamedTuple):
    ...     stiffness: float = gain(2.0, "N/m", "how strongly it is pulled back")
    >>> class Spring(DeclaredDisturbance):
    ...     Numbers = SpringNumbers
    ...     def disturb(self, state, numbers, time):
    ...         return -numbers.stiffness * state.position, vector(0.0, 0.0, 0.0)
    >>> still = vector(0.0, 0.0, 0.0)
    >>> Spring().disturb(State(vector(1.0, 0.0, 0.5), still, still, still), SpringNumbers(2.0), 0.0)
    (Vector([-2.0, -0.0, -1.0]), Vector([0.0, 0.0, 0.0]))
    """

    Numbers: ClassVar[type]

    @abstractmethod
    def disturb(self, state: State, numbers: object, time: Number) -> tuple[Vector, Vector]:
        """Force [N] in the world's frame and generalised torque [N m] (psi, theta, phi) at time t [s]."""


class Vehicle(NamedTuple):
    """mass: m [kg]. inertia: diagonal of Sigma [kg m^2]. gravity: g [m/s^2]. rotors: of Eq. 5."""

    mass: Number
    inertia: Vector
    gravity: Number
    rotors: Rotors


def scaled_rows(diagonal: Vector, m: Matrix) -> Matrix:
    """diag(diagonal) @ m."""
    return Matrix(entry * row for entry, row in zip(diagonal, m, strict=True))


def effective_inertia(attitude: Vector, inertia: Vector, kinematics: Kinematics) -> Matrix:
    """J(eta) = T_eta^T Sigma T_eta, shape (3, 3) [kg m^2] (Eq. 4; Eq. 66 for the printed kinematics)."""
    rates = euler_rate_matrix(attitude, kinematics)
    return rates.T @ scaled_rows(inertia, rates)


def effective_inertia_partials(attitude: Vector, inertia: Vector, kinematics: Kinematics) -> list[Matrix]:
    """dJ/dpsi, dJ/dtheta, dJ/dphi, each of shape (3, 3)."""
    rates = scaled_rows(inertia, euler_rate_matrix(attitude, kinematics))
    halves = [partial.T @ rates for partial in euler_rate_partials(attitude, kinematics)]
    return [half + half.T for half in halves]


def coriolis(attitude: Vector, rates: Vector, inertia: Vector, kinematics: Kinematics) -> Matrix:
    """C(eta, eta_dot) of Eq. 3, shape (3, 3) [kg m^2/s], built from Christoffel symbols.

    C_ij = 1/2 sum_k (dJ_ij/deta_k + dJ_ik/deta_j - dJ_jk/deta_i) eta_dot_k. The form printed in Eq. 6 gives the same
    C eta_dot, so the same flight, but only this one makes J_dot - 2 C skew-symmetric, which the proof needs. A flight
    needs only the product: `coriolis_torque`.
    """
    by = effective_inertia_partials(attitude, inertia, kinematics)

    def entry(i: int, j: int) -> Number:
        return 0.5 * total((by[k][i, j] + by[j][i, k] - by[i][j, k]) * rates[k] for k in range(3))

    return matrix(*([entry(i, j) for j in range(3)] for i in range(3)))


def coriolis_torque(attitude: Vector, rates: Vector, inertia: Vector, kinematics: Kinematics) -> Vector:
    """C eta_dot [N m], shape (3,), as Eq. 2 has it: J_dot eta_dot - 1/2 d/deta (eta_dot^T J eta_dot).

    With omega = T eta_dot this is T_dot^T Sigma omega + T^T Sigma T_dot eta_dot - (dT/deta_k eta_dot)^T Sigma omega.
    """
    t, partials = euler_rate_matrix(attitude, kinematics), euler_rate_partials(attitude, kinematics)
    momentum = inertia * (t @ rates)
    slopes = [partial @ rates for partial in partials]
    t_dot_rates = total(rate * slope for rate, slope in zip(rates, slopes, strict=True))
    t_dot_momentum = total(rate * (partial.T @ momentum) for rate, partial in zip(rates, partials, strict=True))
    return t_dot_momentum + t.T @ (inertia * t_dot_rates) - Vector(slope @ momentum for slope in slopes)


def acceleration(vehicle: Vehicle, attitude: Vector, thrust: Number, force: Vector) -> Vector:
    """xi_dd [m/s^2] under `thrust` u [N] and the disturbance `force` A_xyz [N] (Eq. 1, Eq. 7, Eq. 9)."""
    weight = vector(0.0, 0.0, vehicle.mass * vehicle.gravity)
    return (thrust * thrust_direction(attitude) - weight + force) * (1.0 / vehicle.mass)


def angular_acceleration(vehicle: Vehicle, attitude: Vector, rates: Vector, torque: Vector, kinematics: Kinematics) -> Vector:
    """eta_dd [rad/s^2] under the generalised `torque` tau + A_eta [N m] (Eq. 2, Eq. 3, Eq. 8, Eq. 10)."""
    inertia = effective_inertia(attitude, vehicle.inertia, kinematics)
    return solve_symmetric(inertia, torque - coriolis_torque(attitude, rates, vehicle.inertia, kinematics))


def derivative(
    vehicle: Vehicle, disturbance: object, kinematics: Kinematics, state: State, thrust: Number, torque: Vector,
    law: Callable[[Any, State], tuple[Vector, Vector]] = disturb,
) -> State:  # fmt: skip
    """Rate of every state under a held thrust u [N] and generalised torque tau [N m] (Eq. 9, Eq. 10).

    law: gives A_xyz and A_eta from the disturbance's numbers and the state.
    """
    force, moment = law(disturbance, state)
    return State(
        position=state.velocity,
        velocity=acceleration(vehicle, state.attitude, thrust, force),
        attitude=state.rates,
        rates=angular_acceleration(vehicle, state.attitude, state.rates, torque + moment, kinematics),
    )


def energy(vehicle: Vehicle, state: State, kinematics: Kinematics) -> Number:
    """Kinetic plus potential energy [J]: 1/2 m |xi_dot|^2 + 1/2 eta_dot^T J eta_dot + m g z."""
    turning = state.rates @ (effective_inertia(state.attitude, vehicle.inertia, kinematics) @ state.rates)
    moving = vehicle.mass * (state.velocity @ state.velocity)
    return 0.5 * (moving + turning) + vehicle.mass * vehicle.gravity * state.position[2]

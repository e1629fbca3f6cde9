"""The quadrotor in Lagrange form, Eqs 1-10 and 66."""

from collections.abc import Callable
from typing import Any, NamedTuple

from quadstep.interfaces.model import Kinematics
from quadstep.numbers import Matrix, Number, Vector, matrix, solve_symmetric, total, vector
from quadstep.vehicle.paper.disturbance import disturb
from quadstep.vehicle.paper.kinematics import euler_rate_matrix, euler_rate_partials, thrust_direction
from quadstep.vehicle.paper.rotors import Rotors
from quadstep.vehicle.paper.state import State


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
    vehicle: Vehicle,
    disturbance: object,
    kinematics: Kinematics,
    state: State,
    thrust: Number,
    torque: Vector,
    law: Callable[[Any, State], tuple[Vector, Vector]] = disturb,
) -> State:
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

"""The unmodelled forces and torques A_xyz and A_eta of Eq. 9 and Eq. 10."""

from typing import NamedTuple

from quadstep.numbers import Number, Vector
from quadstep.vehicle.paper.state import State


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

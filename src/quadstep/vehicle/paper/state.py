"""What the quadrotor is doing."""

from typing import NamedTuple

from quadstep.numbers import Vector


class State(NamedTuple):
    """The twelve states of Eq. 7 and Eq. 8: q = (xi, eta) and their rates.

    position: xi = (x, y, z) [m], inertial frame, z up.
    velocity: xi_dot [m/s].
    attitude: eta = (psi, theta, phi) = (yaw, pitch, roll) [rad], in this order everywhere.
    rates: eta_dot = (psi_dot, theta_dot, phi_dot) [rad/s], Euler rates, not body rates.
    """

    position: Vector
    velocity: Vector
    attitude: Vector
    rates: Vector

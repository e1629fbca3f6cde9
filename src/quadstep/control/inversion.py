"""Kinematic inversion, Eq. 40 to Eq. 52: which thrust and attitude make a wanted force."""

from quadstep.numbers import Number, Vector, atan2, sqrt, where


def invert_force(force: Vector) -> tuple[Number, Number, Number]:
    """(u_d [N], theta_d [rad], phi_d [rad]) with u_d (-sin theta_d, cos theta_d sin phi_d, cos theta_d cos phi_d) = force.

    `force` is F_d_hat [N], inertial. Eq. 52 prints atan(f_y / f_z), the wrong branch for f_z < 0; atan2 flies inverted too.
    theta_d lies in [-pi/2, pi/2], phi_d in (-pi, pi]. Where the force leaves an angle free it is zero: phi_d for a force
    along x, both for no force at all.
    """
    f_x, f_y, f_z = force
    b = sqrt(f_y * f_y + f_z * f_z)  # Eq. 45
    u_d = sqrt(f_x * f_x + b * b)  # Eq. 48
    theta_d = where(u_d > 0.0, atan2(-f_x, b), 0.0)  # Eq. 43, Eq. 50
    phi_d = where(b > 0.0, atan2(f_y, f_z), 0.0)  # Eq. 52
    return u_d, theta_d, phi_d

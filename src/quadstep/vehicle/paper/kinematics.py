"""How the attitude turns rates and thrust: T_eta (after Eq. 4) and the thrust direction (Eq. 7)."""

from quadstep.interfaces.model import Kinematics
from quadstep.numbers import Matrix, Vector, cos, matrix, sin, vector


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

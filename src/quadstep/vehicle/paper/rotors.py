"""The rotor map, Eq. 5: four rotor thrusts make the thrust and the three torques.

The reading taken (the paper's text, signs and angles fit no single one): with the paper's left-handed angles, where
positive phi tilts the thrust towards +y and positive theta towards -x, rotor 1 sits at -y, 2 at -x, 3 at +y, 4 at +x.
Rotors 1 and 3 push psi up and so turn counter-clockwise seen from above (positive psi is clockwise), 2 and 4 the other
way. The text has it reversed (front and rear counter-clockwise); Eq. 5 is kept as printed.
"""

from typing import NamedTuple

from quadstep.numbers import Matrix, Number, Vector, clip, matrix, vector


class Rotors(NamedTuple):
    """arm: l, motor to centre of gravity [m]. moment: c, torque per thrust [m]. minimum, maximum: thrust of one [N]."""

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

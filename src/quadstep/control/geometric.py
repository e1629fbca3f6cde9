"""Geometric tracking control on SE(3): Lee, Leok, McClamroch (2010), with the integral terms of Goodarzi, Lee, Lee (2013)."""

from dataclasses import dataclass
from typing import NamedTuple

from quadstep.control.controller import AirframeLaw, Command, Measured
from quadstep.control.projection import project
from quadstep.control.wanted_attitude import up_axis, wanted_attitude
from quadstep.guidance.reference import Reference
from quadstep.numbers import Matrix, Number, Vector, vector
from quadstep.numbers.rotations import cross, quaternion_of, rotation_matrix, yaw_pitch_roll


class GeometricGains(NamedTuple):
    """What the controller believes of the vehicle, and its gains over mass and inertia.

    mass [kg], inertia (diagonal) [kg m^2], gravity [m/s^2]. stiffness: k_x / m [1/s^2], damping: k_v / m [1/s], integral
    [1/s^3] in x, y, z. turn_stiffness: k_R / J [1/s^2], turn_damping: k_Omega / J [1/s] about body x, y, z. integral_bound
    [m s].
    """

    mass: Number
    inertia: Vector
    gravity: Number
    stiffness: Vector
    damping: Vector
    integral: Vector
    turn_stiffness: Vector
    turn_damping: Vector
    integral_bound: Number


class GeometricMemory(NamedTuple):
    """integral: of the position error [m s]."""

    integral: Vector


def vee_error(wanted: Matrix, rotation: Matrix) -> Vector:
    """e_R = 1/2 vee(R_c^T R - R^T R_c), body axes (Lee 2010, Eq. 10)."""
    e = wanted.T @ rotation
    return 0.5 * vector(e[2, 1] - e[1, 2], e[0, 2] - e[2, 0], e[1, 0] - e[0, 1])


@dataclass(frozen=True)
class Geometric(AirframeLaw):
    """Position and attitude loop in one, at the attitude loop's rate."""

    def start(self, measured: Measured, gains: GeometricGains) -> GeometricMemory:
        """Nothing integrated."""
        return GeometricMemory(vector(0.0, 0.0, 0.0))

    def law(
        self,
        memory: GeometricMemory,
        measured: Measured,
        reference: Reference,
        gains: GeometricGains,
        t: Number,
        period: Number,
    ) -> tuple[Command, GeometricMemory]:
        """One sample. The force's rates take the acceleration from the thrust last made, along the thrust axis, without
        drag.
        """
        rotation, rates = rotation_matrix(measured.attitude), measured.rates
        axis = up_axis(rotation)
        e, e_dot = reference.position - measured.position, reference.velocity - measured.velocity
        made = measured.thrust / gains.mass
        e_dd = reference.acceleration - (made * axis - vector(0.0, 0.0, gains.gravity))
        e_ddd = reference.jerk - made * (rotation @ vector(rates[1], -rates[0], 0.0))  # b3_dot = R (Omega x e3)

        pull = gains.stiffness * e + gains.damping * e_dot + gains.integral * memory.integral
        force = gains.mass * (reference.acceleration + pull + vector(0.0, 0.0, gains.gravity))
        force_rate = gains.mass * (reference.jerk + gains.stiffness * e_dot + gains.damping * e_dd + gains.integral * e)
        force_change = gains.mass * (reference.snap + gains.stiffness * e_dd + gains.damping * e_ddd + gains.integral * e_dot)
        wanted = wanted_attitude(force, force_rate, force_change, reference.yaw, reference.yaw_rate)

        e_r = vee_error(wanted.rotation, rotation)
        across = rotation.T @ wanted.rotation  # from the wanted body axes into the body's
        turning = across @ wanted.rates
        e_omega = rates - turning
        feed_forward = across @ wanted.acceleration - cross(rates, turning)
        angular = feed_forward - gains.turn_stiffness * e_r - gains.turn_damping * e_omega
        torque = gains.inertia * angular + cross(rates, gains.inertia * rates)
        command = Command(
            thrust=force @ axis,
            torque=torque,
            desired_attitude=yaw_pitch_roll(quaternion_of(wanted.rotation)),
            r1=e_dot + e,
            r2=-e_omega,
        )
        return command, GeometricMemory(project(memory.integral + period * e, gains.integral_bound))

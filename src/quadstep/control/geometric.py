"""Geometric tracking control on SE(3): Lee, Leok, McClamroch (2010), with the integral terms of Goodarzi, Lee, Lee (2013)."""

from dataclasses import dataclass
from typing import NamedTuple

from quadstep.control.vectoring import push_against, turning_errors
from quadstep.control.wanted_attitude import integral_for, project, up_axis, wanted_attitude
from quadstep.interfaces.controller import Command, Controller, Measured
from quadstep.interfaces.gain import believed, gain, given, usual
from quadstep.interfaces.reference import Reference
from quadstep.numbers import Number, Vector, vector
from quadstep.numbers.rotations import cross, quaternion_of, rotation_matrix, yaw_pitch_roll


class GeometricGains(NamedTuple):
    """Assumed vehicle parameters and gains: over mass in x, y, z, over inertia about body x, y, z."""

    mass: Number = believed("mass")
    inertia: Vector = believed("inertia")
    gravity: Number = given(lambda model: model.gravity)
    stiffness: Vector = gain(usual(18.2, 2), "1/s^2", "stiffness of position, over mass", key="k_x")
    damping: Vector = gain(usual(3.77, 1), "1/s", "damping of position, over mass", key="k_v")
    integral: Vector = gain(usual(7.9, 3), "1/s^3", "integral gain of position, over mass", key="k_i", zero=True)
    turn_stiffness: Vector = gain(
        usual((66.8, 66.8, 70.0), 2, "body"), "1/s^2", "stiffness of attitude, over inertia", key="k_R"
    )
    turn_damping: Vector = gain(
        usual((22.4, 22.4, 17.0), 1, "rate"), "1/s", "damping of attitude, over inertia", key="k_Omega"
    )
    integral_bound: Number = gain(5.0, "m s", "bound on the integral of the position error")


class GeometricMemory(NamedTuple):
    """integral: of the position error [m s]."""

    integral: Vector


@dataclass(frozen=True)
class Geometric(Controller):
    """Position and attitude loop in one, at the attitude loop's rate."""

    name = "geometric"
    label = "geometric tracking on SE(3)"
    source = "Lee, Leok, McClamroch 2010; Goodarzi, Lee, Lee 2013"
    Gains = GeometricGains

    def start(self, measured: Measured, gains: GeometricGains) -> GeometricMemory:
        return GeometricMemory(vector(0.0, 0.0, 0.0))

    def enter(self, measured: Measured, reference: Reference, gains: GeometricGains) -> GeometricMemory:
        """Against a constant force the law leans by what it believes of its own acceleration: so does the integral."""
        push, over = push_against(measured, reference, gains), measured.thrust / gains.mass

        def with_lean(lean: Vector) -> GeometricMemory:
            across = rotation_matrix(measured.attitude) @ vector(lean[1], -lean[0], 0.0)
            return GeometricMemory(integral_for(push + over * across, gains.integral, gains.integral_bound))

        command, _ = self.law(with_lean(vector(0.0, 0.0, 0.0)), measured, reference, gains, 0.0, 0.0)
        missing, stiffness = measured.torque - command.torque, gains.inertia * gains.turn_stiffness
        return with_lean(Vector(torque / stiff for torque, stiff in zip(missing, stiffness, strict=True)))

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

        errors = turning_errors(wanted, rotation, rates)
        angular = errors.feed_forward - gains.turn_stiffness * errors.attitude - gains.turn_damping * errors.rates
        torque = gains.inertia * angular + cross(rates, gains.inertia * rates)
        command = Command(
            thrust=force @ axis,
            torque=torque,
            desired_attitude=yaw_pitch_roll(quaternion_of(wanted.rotation)),
            r1=e_dot + e,
            r2=-errors.rates,
        )
        return command, GeometricMemory(project(memory.integral + period * e, gains.integral_bound))

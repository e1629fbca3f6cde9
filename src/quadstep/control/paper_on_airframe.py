"""The paper's laws on a real vehicle: Euler angles and generalised torques translated both ways.

The paper's angles (psi, theta, phi) are left-handed with yaw innermost: body to world R = Rx(-phi) Ry(-theta) Rz(-psi),
whose third column is Eq. 7. Body rates are T eta_dot with T of `Kinematics.RIGID`, and by virtual work tau_eta = T^T
tau_body. Singular at theta = 90 degrees, as the paper's law is.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

from quadstep.control.backstepping import (
    FORCE_INPUTS,
    TORQUE_INPUTS,
    Backstepping,
    BacksteppingGains,
    BacksteppingMemory,
    largest_inertia,
)
from quadstep.control.vectoring import integral_for, push_against
from quadstep.interfaces.controller import Command, Condition, Controller, Measured
from quadstep.interfaces.gain import from_gains
from quadstep.interfaces.learning import net
from quadstep.interfaces.plant import Model, Reference
from quadstep.numbers import Matrix, Number, Vector, absolute, atan2, cos, largest, maximum, minimum, sin, sqrt, vector, where
from quadstep.numbers.rotations import quaternion_of, rotation_matrix, yaw_pitch_roll
from quadstep.vehicle.paper import State

STEEPEST = 0.02
"""Least cos(theta) divided by: within 1.1 degrees of straight up the rates are those at 1.1 degrees."""


def euler_angles(rotation: Matrix) -> Vector:
    """The paper's (psi, theta, phi) [rad] of a body-to-world matrix."""
    level = sqrt(rotation[1, 2] * rotation[1, 2] + rotation[2, 2] * rotation[2, 2])
    theta = atan2(-rotation[0, 2], level)
    return vector(atan2(rotation[0, 1], rotation[0, 0]), theta, atan2(rotation[1, 2], rotation[2, 2]))


def body_to_world(attitude: Vector) -> Matrix:
    """R = Rx(-phi) Ry(-theta) Rz(-psi) of the paper's angles [rad]."""
    psi, theta, phi = attitude
    (s, c), (st, ct), (sp, cp) = ((sin(angle), cos(angle)) for angle in (psi, theta, phi))
    return Matrix(
        Vector(row)
        for row in (
            (ct * c, ct * s, -st),
            (-cp * s + sp * st * c, cp * c + sp * st * s, sp * ct),
            (sp * s + cp * st * c, -sp * c + cp * st * s, cp * ct),
        )
    )


def euler_rates(attitude: Vector, rates: Vector) -> Vector:
    """(psi_dot, theta_dot, phi_dot) [rad/s] of body rates: T^-1 omega."""
    psi, theta, _ = attitude
    p, q, r = rates
    s, c, level = sin(psi), cos(psi), cos(theta)
    level = where(absolute(level) < STEEPEST, STEEPEST, level)
    phi_dot = -(c * p + s * q) / level
    theta_dot = s * p - c * q
    return vector(sin(theta) * phi_dot - r, theta_dot, phi_dot)


def body_torque(attitude: Vector, torque: Vector) -> Vector:
    """tau_body [N m] of a generalised torque (tau_psi, tau_theta, tau_phi): T^-T tau."""
    psi, theta, _ = attitude
    by_psi, by_theta, by_phi = torque
    s, c, level = sin(psi), cos(psi), cos(theta)
    level = where(absolute(level) < STEEPEST, STEEPEST, level)
    along = -(by_phi + by_psi * sin(theta)) / level
    return vector(c * along + s * by_theta, s * along - c * by_theta, -by_psi)


def paper_torque(attitude: Vector, torque: Vector) -> Vector:
    """(tau_psi, tau_theta, tau_phi) [N m] of a torque about the body's axes: T^T tau."""
    psi, theta, _ = attitude
    x, y, z = torque
    s, c = sin(psi), cos(psi)
    return vector(-z, s * x - c * y, z * sin(theta) - (c * x + s * y) * cos(theta))


def paper_state(measured: Measured) -> State:
    """A measurement as the paper's twelve states."""
    attitude = euler_angles(rotation_matrix(measured.attitude))
    return State(measured.position, measured.velocity, attitude, euler_rates(attitude, measured.rates))


def pace(model: Model) -> Number:
    """The agility that all three angles share: Theorem 5.1 bounds the gain of each by the fastest."""
    return minimum(model.agility, 3.0 * model.yaw_agility)


def angles(model: Model) -> tuple[Number, Number, Number]:
    """Lambda_2 of psi, theta and phi."""
    level = 1.67 * pace(model)
    return minimum(level, 1.67 * model.yaw_agility), level, level


def turn_gains(gains: BacksteppingGains, model: Model) -> Vector:
    """K_r2 of psi, theta and phi: 18 1/s over inertia about the vertical axis, 37 1/s about the others, with an agility of 1;
    above the theorem's bound for any inertia.
    """
    about_x, about_y, about_z = model.inertia
    least = 1.2 * largest_inertia(model.inertia) * largest(gains.slope_2)
    wanted = vector(11.0 * about_z, 22.0 * about_y, 22.0 * about_x) * gains.slope_2
    return Vector(maximum(one, least) for one in wanted)


FORCE_RATE = from_gains(lambda gains, model: 0.5 * gains.mass * (pace(model) * pace(model)))
TORQUE_RATE = from_gains(lambda _, model: 0.01 * largest(model.inertia) * (pace(model) * pace(model)))
"""Learning rates that suit a vehicle: F_1 and F_2 of Eq. 54."""


@dataclass(frozen=True)
class PaperOnAirframe(Controller):
    """Any law of the paper's plant, flown on a real vehicle. Its psi follows the heading: psi_d = -yaw.

    With the gains of the paper's law, in newtons; those left out follow the vehicle, so that the conditions of Theorem 5.1
    hold.
    """

    name = "backstepping"
    label = "adaptive backstepping (the paper's)"
    source = "Das, Lewis, Subbarao 2009, through its Euler angles"
    Gains: ClassVar[type] = BacksteppingGains
    defaults: ClassVar[Mapping[str, object]] = {
        "slope_1": lambda model: 3.0 * pace(model),
        "gain_1": from_gains(lambda gains, model: 7.6 * gains.mass * pace(model)),
        "integral_1": from_gains(lambda gains, model: pace(model) * gains.gain_1),
        "slope_2": angles,
        "gain_2": from_gains(turn_gains),
        "integral_2": from_gains(lambda gains, model: (0.06 * pace(model)) * gains.gain_2),
        "filter_frequency": lambda model: 38.0 * pace(model),
        "force_net": net(1, FORCE_INPUTS, rate=FORCE_RATE, damping=0.008),
        "torque_net": net(2, TORQUE_INPUTS, rate=TORQUE_RATE, damping=0.008),
    }

    law_on_angles: Controller = field(default_factory=Backstepping)

    def start(self, measured: Measured, gains: object) -> object:
        return self.law_on_angles.start(paper_state(measured), gains)

    def enter(self, measured: Measured, reference: Reference, gains: object) -> object:
        """The paper's integrals are what the present command is for beyond the present motion; other laws start."""
        memory = self.start(measured, gains)
        if not isinstance(memory, BacksteppingMemory) or not isinstance(gains, BacksteppingGains):
            return memory
        state = paper_state(measured)
        spin = vector(-reference.yaw_rate, *state.rates.entries[1:]) - state.rates
        turning = paper_torque(state.attitude, measured.torque) - gains.gain_2 * spin
        force = gains.mass * push_against(measured, reference, gains)
        integral_1 = integral_for(force, gains.integral_1, math.inf)
        return memory._replace(integral_1=integral_1, integral_2=integral_for(turning, gains.integral_2, math.inf))

    def law(
        self, memory: object, measured: Measured, reference: Reference, gains: object, t: Number, period: Number
    ) -> tuple[Command, object]:
        """One sample of the paper's law. Yaw errors are taken the short way round."""
        state = paper_state(measured)
        wanted_psi = -reference.yaw
        gap = wanted_psi - state.attitude[0]
        psi = wanted_psi - atan2(sin(gap), cos(gap))  # the measured angle, on the turn of the wanted one
        _, theta, phi = state.attitude
        near = state._replace(attitude=vector(psi, theta, phi))
        turned = reference._replace(yaw=wanted_psi, yaw_rate=-reference.yaw_rate)
        command, memory = self.law_on_angles.law(memory, near, turned, gains, t, period)
        attitude = yaw_pitch_roll(quaternion_of(body_to_world(command.desired_attitude)))
        return command._replace(torque=body_torque(state.attitude, command.torque), desired_attitude=attitude), memory

    def conditions(self, gains: object, model: Model) -> Sequence[Condition]:
        """Those of the law on angles."""
        return self.law_on_angles.conditions(gains, model)

"""Geometric tracking control on SE(3): Lee, Leok, McClamroch (2010), with the integral terms of Goodarzi, Lee, Lee (2013).

Geometric control with adaptation: Goodarzi, Lee, Lee, "Geometric adaptive tracking control of a quadrotor unmanned aerial
vehicle on SE(3) for agile maneuvers" (2015, doi 10.1115/1.4030419).

What acts on the vehicle is W_x t_x and W_R t_R with known regressors W and unknown constants t, which the law learns from the
errors (true less wanted) and subtracts, each t within a ball:

    t_x_dot = g_x W_x^T (e_v + c_1 e_x),     t_R_dot = g_R W_R^T (e_Omega + c_2 e_R)

Here t_x holds a constant acceleration and a drag along each of the body's axes, t_R a constant angular acceleration and a drag
about them: W_x = [I, -R diag(R^T v)], W_R = [I, -diag(Omega)].
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

from quadstep.control.vectoring import (
    ZERO,
    BelievedBody,
    PositionIntegral,
    Pull,
    Turn,
    angular_of,
    attitude_for,
    desired_attitude,
    errors_to,
    force_for,
    integral_for,
    project,
    pulled,
    push_against,
    torque_for,
    turned,
    turning_errors,
    up_axis,
)
from quadstep.interfaces.controller import Command, Controller, Measured
from quadstep.interfaces.gain import believed, gain, given, usual
from quadstep.interfaces.plant import Reference
from quadstep.numbers import Number, Vector, vector
from quadstep.numbers.rotations import cross, rotation_matrix


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


@dataclass(frozen=True)
class Geometric(Controller):
    """Position and attitude loop in one, at the attitude loop's rate."""

    name = "geometric"
    label = "geometric tracking on SE(3)"
    source = "Lee, Leok, McClamroch 2010; Goodarzi, Lee, Lee 2013"
    off_command = (
        "the law ignores drag, so it computes a false acceleration and from it a body rate that the vehicle should not have"
    )
    Gains = GeometricGains

    def start(self, measured: Measured, gains: GeometricGains) -> PositionIntegral:
        return PositionIntegral()

    def enter(self, measured: Measured, reference: Reference, gains: GeometricGains) -> PositionIntegral:
        """Against a constant force the law leans by what it believes of its own acceleration: so does the integral."""
        push, over = push_against(measured, reference, gains), measured.thrust / gains.mass

        def with_lean(lean: Vector) -> PositionIntegral:
            across = rotation_matrix(measured.attitude) @ vector(lean[1], -lean[0], 0.0)
            return PositionIntegral(integral_for(push + over * across, gains.integral, gains.integral_bound))

        command, _ = self.law(with_lean(vector(0.0, 0.0, 0.0)), measured, reference, gains, 0.0, 0.0)
        missing, stiffness = measured.torque - command.torque, gains.inertia * gains.turn_stiffness
        return with_lean(missing / stiffness)

    def law(
        self, memory: PositionIntegral, measured: Measured, reference: Reference, gains: GeometricGains,
        t: Number, period: Number,
    ) -> tuple[Command, PositionIntegral]:  # fmt: skip
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
        wanted = desired_attitude(force, force_rate, force_change, reference.yaw, reference.yaw_rate)

        errors = turning_errors(wanted, rotation, rates)
        angular = errors.feed_forward - gains.turn_stiffness * errors.attitude - gains.turn_damping * errors.rates
        torque = gains.inertia * angular + cross(rates, gains.inertia * rates)
        command = Command(force @ axis, torque, wanted.angles)
        return command, PositionIntegral(project(memory.integral + period * e, gains.integral_bound))


class GeometricAdaptiveGains(NamedTuple):
    """The vehicle parameters that the controller assumes, and its gains."""

    body: BelievedBody
    pull: Pull
    turn: Turn
    adaptation: Number = gain(usual(6.0, 2), "1/s^2", "adaptation rate of the acceleration estimate", symbol="g_x", zero=True)
    drag_adaptation: Number = gain(0.02, "s/m^2", "adaptation rate of the drag estimate", zero=True)
    turn_adaptation: Vector = gain(
        usual((14.7, 14.7, 14.7), 2, "body"),
        "1/s^2",
        "adaptation rate of the angular acceleration estimate",
        symbol="g_R",
        zero=True,
    )
    turn_drag_adaptation: Number = gain(0.1, "s/rad^2", "adaptation rate of the rotational drag estimate", zero=True)
    coupling: Number = gain(usual(2.6, 1), "1/s", "weight of the position error in adaptation", symbol="c_1", key="c_1")
    turn_coupling: Vector = gain(
        usual((6.1, 6.1, 6.1), 1, "body"), "1/s", "weight of the attitude error in adaptation", symbol="c_2", key="c_2"
    )
    bound: Number = gain(15.0, "m/s^2", "bound on the acceleration estimate", tunable=False)
    drag_bound: Number = gain(1.0, "1/s", "bound on the drag estimate", tunable=False)
    turn_bound: Number = gain(100.0, "rad/s^2", "bound on the angular acceleration estimate", tunable=False)
    turn_drag_bound: Number = gain(5.0, "1/s", "bound on the rotational drag estimate", tunable=False)


class GeometricAdaptiveMemory(NamedTuple):
    """What has been learnt. push [m/s^2]: world. drag [1/s], turning [rad/s^2], turn_drag [1/s]: along or about body axes."""

    push: Vector
    drag: Vector
    turning: Vector
    turn_drag: Vector


@dataclass(frozen=True)
class GeometricAdaptive(Controller):
    """All loops in one, at the attitude loop's rate."""

    name = "geometric-adaptive"
    label = "geometric, adaptive"
    source = "Goodarzi, Lee, Lee 2015"
    Gains = GeometricAdaptiveGains
    defaults: ClassVar[Mapping[str, object]] = {
        "pull.stiffness": usual(10.3, 2),
        "pull.damping": usual(5.68, 1),
        "turn.stiffness": usual((142.5, 142.5, 70.0), 2, "body"),
        "turn.damping": usual((23.4, 23.4, 15.0), 1, "rate"),
    }

    def start(self, measured: Measured, gains: GeometricAdaptiveGains) -> GeometricAdaptiveMemory:
        return GeometricAdaptiveMemory(ZERO, ZERO, ZERO, ZERO)

    def enter(self, measured: Measured, reference: Reference, gains: GeometricAdaptiveGains) -> GeometricAdaptiveMemory:
        push = project(-push_against(measured, reference, gains.body), gains.bound)
        turning = project(-angular_of(measured.torque, measured, gains.body), gains.turn_bound)
        return GeometricAdaptiveMemory(push, ZERO, turning, ZERO)

    def law(
        self, memory: GeometricAdaptiveMemory, measured: Measured, reference: Reference, gains: GeometricAdaptiveGains,
        t: Number, period: Number,
    ) -> tuple[Command, GeometricAdaptiveMemory]:  # fmt: skip
        body, rates, rotation = gains.body, measured.rates, rotation_matrix(measured.attitude)
        through = rotation.T @ measured.velocity  # body axes
        known = memory.push - rotation @ (through * memory.drag)
        force = force_for(pulled(measured, reference, gains.pull) - known, body)
        attitude = attitude_for(force, reference, body.mass)
        errors = errors_to(attitude, measured)
        angular = turned(errors, gains.turn) - (memory.turning - rates * memory.turn_drag)
        command = Command(force @ up_axis(rotation), torque_for(angular, measured, body), attitude.angles)
        e_x, e_v = measured.position - reference.position, measured.velocity - reference.velocity
        off, off_r = e_v + gains.coupling * e_x, errors.rates + gains.turn_coupling * errors.attitude
        dragged = through * (rotation.T @ off)
        return command, GeometricAdaptiveMemory(
            push=project(memory.push + (period * gains.adaptation) * off, gains.bound),
            drag=project(memory.drag - (period * gains.drag_adaptation) * dragged, gains.drag_bound),
            turning=project(memory.turning + (period * gains.turn_adaptation) * off_r, gains.turn_bound),
            turn_drag=project(
                memory.turn_drag - (period * gains.turn_drag_adaptation) * (rates * off_r), gains.turn_drag_bound
            ),
        )

"""Geometric control with adaptation: Goodarzi, Lee, Lee, "Geometric adaptive tracking control of a quadrotor unmanned aerial
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
    Pull,
    Turn,
    angular_of,
    attitude_for,
    errors_to,
    force_for,
    pulled,
    push_against,
    torque_for,
    turned,
)
from quadstep.control.wanted_attitude import project, up_axis
from quadstep.interfaces.controller import Command, Controller, Measured
from quadstep.interfaces.gain import gain, usual
from quadstep.interfaces.reference import Reference
from quadstep.numbers import Number, Vector
from quadstep.numbers.rotations import quaternion_of, rotation_matrix, yaw_pitch_roll


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
        command = Command(
            thrust=force @ up_axis(rotation),
            torque=torque_for(angular, measured, body),
            desired_attitude=yaw_pitch_roll(quaternion_of(attitude.rotation)),
            r1=reference.velocity - measured.velocity,
            r2=-errors.rates,
        )
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

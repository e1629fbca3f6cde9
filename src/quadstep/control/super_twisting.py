"""Super-twisting sliding modes in position and attitude: Levant, "Sliding order and sliding accuracy in sliding mode control"
(1993); gains as in Moreno and Osorio, "Strict Lyapunov functions for the super-twisting algorithm" (2012).

    s = e_dot + c e,     s_dot = -k_1 |s|^(1/2) sign(s) + v,     v_dot = -k_2 sign(s)

in finite time from any disturbance whose rate is bounded. The sign is smoothed within a layer d: s / (|s| + d), and
|s|^(1/2) sign(s) is s / (|s| + d)^(1/2).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from quadstep.control.vectoring import (
    ZERO,
    BelievedBody,
    angular_of,
    attitude_for,
    boxed,
    errors_to,
    force_for,
    push_against,
    torque_for,
    up_axis,
)
from quadstep.interfaces.controller import Command, Condition, Controller, Measured
from quadstep.interfaces.gain import gain, usual
from quadstep.interfaces.plant import Model, Reference
from quadstep.numbers import Number, Vector, absolute, sqrt
from quadstep.numbers.rotations import rotation_matrix


class SuperTwistingGains(NamedTuple):
    """The vehicle parameters that the controller assumes, and its gains in x, y, z; of the attitude about body x, y, z."""

    body: BelievedBody
    slope: Vector = gain(usual(2.15, 1), "1/s", "decay rate of an error on the sliding surface", symbol="c")
    reaching: Vector = gain(usual(2.87, 1), "m^(1/2)/s^(3/2)", "gain of the square root of s", symbol="k_1", key="k_1")
    twisting: Vector = gain(usual(1.3, 2), "m/s^3", "rate of the integral part", symbol="k_2", key="k_2", zero=True)
    layer: Number = gain(0.35, "m/s", "boundary layer of s in which the sign is smoothed", low=0.005, high=5.0, scale="log")
    bound: Number = gain(15.0, "m/s^2", "bound on the integral part along an axis", tunable=False)
    turn_slope: Vector = gain(usual((8.8, 8.8, 8.0), 1, "body"), "1/s", "decay rate of the attitude error", symbol="c_R")
    turn_reaching: Vector = gain(
        usual((17.3, 17.3, 10.0), 1, "rate"), "rad^(1/2)/s^(3/2)", "k_1 of the attitude loop", key="h_1"
    )
    turn_twisting: Vector = gain(
        usual((15.4, 15.4, 15.0), 2, "body"), "rad/s^3", "k_2 of the attitude loop", key="h_2", zero=True
    )
    turn_layer: Number = gain(1.0, "rad/s", "boundary layer of the attitude loop", low=0.02, high=10.0, scale="log")
    turn_bound: Number = gain(100.0, "rad/s^2", "bound on the integral part about an axis", tunable=False)
    lipschitz: Number = gain(0.0, "m/s^3", "largest rate of the disturbance to reject", zero=True, tunable=False)


class SuperTwistingMemory(NamedTuple):
    """The integral parts v: integral, of the position [m/s^2], world; turn_integral, of the attitude [rad/s^2], body axes."""

    integral: Vector
    turn_integral: Vector


def smooth_sign(s: Vector, layer: Number) -> Vector:
    """The sign of each entry, nearly linear within the layer."""
    return Vector(entry / (absolute(entry) + layer) for entry in s)


def smooth_root(s: Vector, layer: Number) -> Vector:
    """The root of each entry's size, with its sign; nearly linear within the layer."""
    return Vector(entry / sqrt(absolute(entry) + layer) for entry in s)


@dataclass(frozen=True)
class SuperTwisting(Controller):
    """Both loops in one, at the attitude loop's rate."""

    name = "super-twisting"
    label = "super-twisting"
    source = "Levant 1993; Moreno and Osorio 2012"
    Gains = SuperTwistingGains

    def start(self, measured: Measured, gains: SuperTwistingGains) -> SuperTwistingMemory:
        return SuperTwistingMemory(ZERO, ZERO)

    def enter(self, measured: Measured, reference: Reference, gains: SuperTwistingGains) -> SuperTwistingMemory:
        turning = angular_of(measured.torque, measured, gains.body)
        return SuperTwistingMemory(
            boxed(push_against(measured, reference, gains.body), gains.bound), boxed(turning, gains.turn_bound)
        )

    def law(
        self, memory: SuperTwistingMemory, measured: Measured, reference: Reference, gains: SuperTwistingGains,
        t: Number, period: Number,
    ) -> tuple[Command, SuperTwistingMemory]:  # fmt: skip
        """One sample. On both surfaces the errors are those of the wanted less the true motion."""
        body = gains.body
        e, e_dot = reference.position - measured.position, reference.velocity - measured.velocity
        s = e_dot + gains.slope * e
        reached = gains.reaching * smooth_root(s, gains.layer)
        force = force_for(reference.acceleration + gains.slope * e_dot + reached + memory.integral, body)

        attitude = attitude_for(force, reference, body.mass)
        errors = errors_to(attitude, measured)
        s_r = -(errors.rates + gains.turn_slope * errors.attitude)
        turn_reached = gains.turn_reaching * smooth_root(s_r, gains.turn_layer)
        angular = errors.feed_forward - gains.turn_slope * errors.rates + turn_reached + memory.turn_integral
        thrust = force @ up_axis(rotation_matrix(measured.attitude))
        command = Command(thrust, torque_for(angular, measured, body), attitude.angles, r1=s, r2=s_r)
        twisted = period * (gains.twisting * smooth_sign(s, gains.layer))
        turn_twisted = period * (gains.turn_twisting * smooth_sign(s_r, gains.turn_layer))
        return command, SuperTwistingMemory(
            boxed(memory.integral + twisted, gains.bound), boxed(memory.turn_integral + turn_twisted, gains.turn_bound)
        )

    def conditions(self, gains: SuperTwistingGains, model: Model) -> Sequence[Condition]:
        """k_1 > 1.5 sqrt(L), k_2 > 1.1 L: enough for convergence in finite time against a disturbance of rate L."""
        needed, source = 1.5 * sqrt(gains.lipschitz), "Levant 1998, after Levant 1993"
        found: list[Condition] = []
        for axis, k_1, k_2 in zip("xyz", gains.reaching, gains.twisting, strict=True):
            found.append(Condition(f"k_1 ({axis}) > 1.5 sqrt(L)", k_1, needed, source))
            found.append(Condition(f"k_2 ({axis}) >= 1.1 L", k_2, 1.1 * gains.lipschitz, source))
        return found

"""Super-twisting control of a quadrotor: a controller in a file of your own, which missions name.

    [controller]
    type = "super_twisting.py:SuperTwisting"

The position's sliding variable s = e_dot + c e is driven to zero by a = k_1 |s|^(1/2) sign(s) + v, v_dot = k_2 sign(s), after
Levant (1993) with the gains of Moreno and Osorio (2012); the attitude follows by a proportional-derivative loop.
"""

from dataclasses import dataclass
from typing import NamedTuple

from quadstep.own import (
    Command,
    Condition,
    Controller,
    Measured,
    Model,
    Number,
    Reference,
    Vector,
    absolute,
    believed,
    cross,
    desired_attitude,
    gain,
    given,
    project,
    quaternion_of,
    rotation_matrix,
    sqrt,
    up_axis,
    usual,
    vector,
    vee_error,
    where,
    yaw_pitch_roll,
)


class Gains(NamedTuple):
    """What the controller believes of the vehicle, and its gains."""

    mass: Number = believed("mass")
    inertia: Vector = believed("inertia")
    gravity: Number = given(lambda model: model.gravity)
    slope: Vector = gain(usual(2.0, 1), "1/s", "how fast the error decays on the sliding surface", symbol="c")
    reaching: Vector = gain(usual(4.0, 1), "m^(1/2)/s^(3/2)", "gain of the root of s", symbol="k_1", key="k_1")
    twisting: Vector = gain(usual(2.0, 1), "m/s^3", "rate of the integral part", symbol="k_2", key="k_2", zero=True)
    layer: Number = gain(0.05, "m/s", "width of s in which the sign is smoothed", low=0.001, high=1.0)
    bound: Number = gain(6.0, "m/s^2", "bound of the integral part", tunable=False)
    k_R: Vector = gain(usual((180.0, 180.0, 50.0), 2), "1/s^2", "attitude")  # noqa: N815 (the field's symbol)
    k_w: Vector = gain(usual((28.0, 28.0, 14.0), 1), "1/s", "body rates")
    lipschitz: Number = gain(1.0, "m/s^3", "largest rate of the disturbance that is to be rejected", zero=True, tunable=False)


class Memory(NamedTuple):
    """integral: v [m/s^2]. force: the desired one, from `guide` [N]."""

    integral: Vector
    force: Vector


def smooth_sign(s: Vector, layer: Number) -> Vector:
    """Sign of each entry, linear within the layer."""
    return Vector(where(absolute(one) < layer, one / layer, where(one < 0.0, -1.0, 1.0)) for one in s)


def root(s: Vector) -> Vector:
    """|s|^(1/2) of each entry."""
    return Vector(sqrt(absolute(one)) for one in s)


@dataclass(frozen=True)
class SuperTwisting(Controller):
    """Super-twisting on the position, proportional-derivative on the attitude."""

    name = "super-twisting"
    label = "super-twisting"
    source = "Levant 1993; Moreno and Osorio 2012"
    Gains = Gains
    measures = Measured

    def start(self, measured: Measured, gains: Gains) -> Memory:
        """Nothing integrated; hover."""
        return Memory(vector(0.0, 0.0, 0.0), vector(0.0, 0.0, gains.mass * gains.gravity))

    def guide(
        self, memory: Memory, measured: Measured, reference: Reference, gains: Gains, t: Number, period: Number
    ) -> Memory:
        """The position loop."""
        e, e_dot = reference.position - measured.position, reference.velocity - measured.velocity
        s = e_dot + gains.slope * e
        sign = smooth_sign(s, gains.layer)
        pull = gains.slope * e_dot + gains.reaching * root(s) * sign + memory.integral
        force = gains.mass * (reference.acceleration + pull + vector(0.0, 0.0, gains.gravity))
        integral = project(memory.integral + period * (gains.twisting * sign), gains.bound)
        return Memory(integral, force)

    def law(
        self, memory: Memory, measured: Measured, reference: Reference, gains: Gains, t: Number, period: Number
    ) -> tuple[Command, Memory]:
        """The attitude loop."""
        zero, rotation = vector(0.0, 0.0, 0.0), rotation_matrix(measured.attitude)
        desired = desired_attitude(memory.force, zero, zero, reference.yaw, reference.yaw_rate)
        angular = -gains.k_R * vee_error(desired.rotation, rotation) - gains.k_w * measured.rates
        torque = gains.inertia * angular + cross(measured.rates, gains.inertia * measured.rates)
        attitude = yaw_pitch_roll(quaternion_of(desired.rotation))
        return Command(memory.force @ up_axis(rotation), torque, attitude), memory

    def conditions(self, gains: Gains, model: Model) -> list[Condition]:
        """k_1 > 1.5 sqrt(L), k_2 > 1.1 L: enough for convergence in finite time against a disturbance of rate L."""
        source, needed = "Levant 1993", 1.5 * sqrt(gains.lipschitz)
        return [
            condition
            for axis, k_1, k_2 in zip("xyz", gains.reaching, gains.twisting, strict=True)
            for condition in (
                Condition(f"k_1 ({axis}) > 1.5 sqrt(L)", k_1, needed, source),
                Condition(f"k_2 ({axis}) > 1.1 L", k_2, 1.1 * gains.lipschitz, source),
            )
        ]

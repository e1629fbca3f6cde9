"""Cascaded PID, as the paper's references [4] and [12] fly it: position, velocity, attitude, body rates, one inside the
other.
"""

from dataclasses import dataclass
from typing import NamedTuple

from quadstep.control.vectoring import project, push_against, tilted_within, turning_attitude, up_axis, within
from quadstep.interfaces.controller import Command, Controller, Measured
from quadstep.interfaces.gain import believed, gain, given, usual
from quadstep.interfaces.plant import Reference
from quadstep.numbers import Number, Vector, clip, exp, vector
from quadstep.numbers.rotations import conjugate, multiply, rotation_matrix, rotation_vector, yaw_pitch_roll


class OuterGains(NamedTuple):
    """Assumed vehicle parameters, and gains in x, y, z; of attitude about body x, y, z."""

    mass: Number = believed("mass")
    gravity: Number = given(lambda model: model.gravity)
    most_thrust: Number = given(lambda model: model.most_thrust)
    position: Vector = gain(usual(2.77, 1), "1/s", "P gain of position")
    most_speed: Number = gain(3.0, "m/s", "largest commanded speed towards the path")
    axis_speed: Number = gain(
        100.0, "m/s", "largest commanded speed towards the path along each axis", low=0.1, high=100.0, tunable=False
    )
    most_tilt: Number = gain(1.5, "rad", "largest commanded tilt", low=0.05, high=1.5, tunable=False)
    velocity: Vector = gain(usual(5.35, 1), "1/s", "P gain of velocity")
    velocity_integral: Vector = gain(usual(2.0, 2), "1/s^2", "I gain of velocity", zero=True)
    integral_bound: Number = gain(15.0, "m/s^2", "largest acceleration from the velocity integral")
    attitude: Vector = gain(usual((6.8, 6.8, 6.2), 1, "body"), "1/s", "P gain of attitude")
    most_rate: Number = gain(8.0, "rad/s", "largest commanded body rate")


class OuterMemory(NamedTuple):
    """integral [m/s^2]: what the I part of velocity adds. force [N], wanted (unit quaternion) and turn [rad/s] of
    that attitude about its thrust axis: from the velocity loop.
    """

    integral: Vector
    force: Vector
    wanted: Vector
    turn: Number


def first_memory(measured: Measured, gains: OuterGains) -> OuterMemory:
    weight = vector(0.0, 0.0, gains.mass * gains.gravity)
    return OuterMemory(vector(0.0, 0.0, 0.0), weight, measured.attitude, 0.0)


def memory_on_entry(measured: Measured, reference: Reference, gains: OuterGains) -> OuterMemory:
    """The integral is what the present thrust is for beyond the present motion."""
    return first_memory(measured, gains)._replace(
        integral=project(push_against(measured, reference, gains), gains.integral_bound)
    )


def guided(memory: OuterMemory, measured: Measured, reference: Reference, gains: OuterGains, period: Number) -> OuterMemory:
    """Position P gives a velocity, velocity PI an acceleration, and that a force within the rotors' reach."""
    back = gains.position * (reference.position - measured.position)
    back_on_path = project(Vector(clip(one, -gains.axis_speed, gains.axis_speed) for one in back), gains.most_speed)
    wanted_velocity = reference.velocity + back_on_path
    error = wanted_velocity - measured.velocity
    pull = reference.acceleration + gains.velocity * error + memory.integral
    asked = gains.mass * (pull + vector(0.0, 0.0, gains.gravity))
    force = tilted_within(within(asked, gains.most_thrust), gains.most_tilt)
    lost = (force - asked) * (1.0 / gains.mass)  # anti-windup: what cannot be had is not integrated
    integral = memory.integral + period * (gains.velocity_integral * error + 2.0 * lost)
    return OuterMemory(project(integral, gains.integral_bound), force, *turning_attitude(force, reference))


def asked_rates(memory: OuterMemory, measured: Measured, gains: OuterGains) -> Vector:
    """Attitude P gives body rates [rad/s]; the turn of the path's heading is added about the body's own thrust axis, which is
    the wanted one up to the error.
    """
    roll, pitch, yaw = gains.attitude * rotation_vector(multiply(conjugate(measured.attitude), memory.wanted))
    return project(vector(roll, pitch, yaw + memory.turn), gains.most_rate)


class CascadedPidGains(NamedTuple):
    """Those of the outer loops, and of body rates about body x, y, z."""

    outer: OuterGains
    inertia: Vector = believed("inertia")
    rate: Vector = gain(usual((21.9, 21.9, 20.0), 1, "rate"), "1/s", "P gain of body rates")
    rate_integral: Vector = gain(usual((3.8, 3.8, 3.8), 2, "body"), "1/s^2", "I gain of body rates", zero=True)
    rate_integral_bound: Number = gain(20.0, "rad/s^2", "largest angular acceleration from the rate integral")
    rate_derivative: Vector = gain(0.0, "-", "D gain of body rates", zero=True)
    rate_filter: Number = gain(60.0, "rad/s", "cut-off of the low-pass filter of the D term")


class CascadedPidMemory(NamedTuple):
    """rate_integral [rad/s^2]: what the I part of body rates adds. rates [rad/s]: filtered."""

    outer: OuterMemory
    rate_integral: Vector
    rates: Vector


@dataclass(frozen=True)
class CascadedPid(Controller):
    """`guide` is the position and velocity loop, `law` the attitude and rate loop."""

    name = "pid"
    label = "cascaded PID"
    source = "the paper's references [4] and [12]"
    Gains = CascadedPidGains

    def start(self, measured: Measured, gains: CascadedPidGains) -> CascadedPidMemory:
        return CascadedPidMemory(first_memory(measured, gains.outer), vector(0.0, 0.0, 0.0), measured.rates)

    def enter(self, measured: Measured, reference: Reference, gains: CascadedPidGains) -> CascadedPidMemory:
        rate_integral = project(measured.torque / gains.inertia + gains.rate * measured.rates, gains.rate_integral_bound)
        return CascadedPidMemory(memory_on_entry(measured, reference, gains.outer), rate_integral, measured.rates)

    def guide(
        self, memory: CascadedPidMemory, measured: Measured, reference: Reference, gains: CascadedPidGains,
        t: Number, period: Number,
    ) -> CascadedPidMemory:  # fmt: skip
        return memory._replace(outer=guided(memory.outer, measured, reference, gains.outer, period))

    def law(
        self, memory: CascadedPidMemory, measured: Measured, reference: Reference, gains: CascadedPidGains,
        t: Number, period: Number,
    ) -> tuple[Command, CascadedPidMemory]:  # fmt: skip
        """Attitude P gives body rates, rate PID an angular acceleration."""
        outer = memory.outer
        rate_error = asked_rates(outer, measured, gains.outer) - measured.rates
        share = 1.0 - exp(-(gains.rate_filter * period))
        rates = memory.rates + share * (measured.rates - memory.rates)
        derivative = (rates - memory.rates) * (1.0 / period)
        angular = gains.rate * rate_error + memory.rate_integral - gains.rate_derivative * derivative
        rate_integral = project(memory.rate_integral + period * (gains.rate_integral * rate_error), gains.rate_integral_bound)
        thrust = outer.force @ up_axis(rotation_matrix(measured.attitude))
        command = Command(thrust, gains.inertia * angular, yaw_pitch_roll(outer.wanted))
        return command, CascadedPidMemory(outer, rate_integral, rates)

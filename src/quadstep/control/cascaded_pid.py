"""Cascaded PID, as the paper's references [4] and [12] fly it: position, velocity, attitude, body rates, one inside the
other.
"""

from dataclasses import dataclass
from typing import NamedTuple

from quadstep.control.controller import AirframeLaw, Command, Measured
from quadstep.control.projection import project
from quadstep.control.wanted_attitude import up_axis, wanted_attitude, within
from quadstep.guidance.reference import Reference
from quadstep.numbers import Number, Vector, exp, vector
from quadstep.numbers.rotations import conjugate, multiply, quaternion_of, rotation_matrix, rotation_vector, yaw_pitch_roll


class CascadedPidGains(NamedTuple):
    """What the controller believes of the vehicle, and its gains; vectors are x, y, z.

    mass [kg], inertia (diagonal) [kg m^2], gravity [m/s^2], most_thrust it may ask for [N]. position: P [1/s], for at most
    most_speed [m/s]. velocity: P [1/s], velocity_integral: I [1/s^2], bounded to integral_bound [m/s^2]. attitude: P [1/s].
    rate: P [1/s], rate_integral: I [1/s^2], bounded to rate_integral_bound [rad/s^2], rate_derivative: D [-] of the rate
    filtered with rate_filter [rad/s].
    """

    mass: Number
    inertia: Vector
    gravity: Number
    most_thrust: Number
    position: Vector
    most_speed: Number
    velocity: Vector
    velocity_integral: Vector
    integral_bound: Number
    attitude: Vector
    most_rate: Number
    rate: Vector
    rate_integral: Vector
    rate_integral_bound: Number
    rate_derivative: Vector
    rate_filter: Number


class CascadedPidMemory(NamedTuple):
    """integral [m/s^2] and rate_integral [rad/s^2]: what the integral parts add. rates: filtered. force [N], wanted: from
    the position loop.
    """

    integral: Vector
    rate_integral: Vector
    rates: Vector
    force: Vector
    wanted: Vector
    velocity_error: Vector


@dataclass(frozen=True)
class CascadedPid(AirframeLaw):
    """`guide` is the position and velocity loop, `law` the attitude and rate loop."""

    def start(self, measured: Measured, gains: CascadedPidGains) -> CascadedPidMemory:
        """Nothing integrated."""
        zero = vector(0.0, 0.0, 0.0)
        weight = vector(0.0, 0.0, gains.mass * gains.gravity)
        return CascadedPidMemory(zero, zero, measured.rates, weight, measured.attitude, zero)

    def guide(
        self,
        memory: CascadedPidMemory,
        measured: Measured,
        reference: Reference,
        gains: CascadedPidGains,
        t: Number,
        period: Number,
    ) -> CascadedPidMemory:
        """Position P gives a velocity, velocity PI an acceleration, and that a force within the rotors' reach."""
        back_on_path = project(gains.position * (reference.position - measured.position), gains.most_speed)
        wanted_velocity = reference.velocity + back_on_path
        error = wanted_velocity - measured.velocity
        pull = reference.acceleration + gains.velocity * error + memory.integral
        asked = gains.mass * (pull + vector(0.0, 0.0, gains.gravity))
        force = within(asked, gains.most_thrust)
        back = (force - asked) * (1.0 / gains.mass)  # anti-windup: what cannot be had is not integrated
        integral = memory.integral + period * (gains.velocity_integral * error + 2.0 * back)
        zero = vector(0.0, 0.0, 0.0)
        attitude = wanted_attitude(force, zero, zero, reference.yaw, 0.0).rotation
        return memory._replace(
            integral=project(integral, gains.integral_bound),
            force=force,
            wanted=quaternion_of(attitude),
            velocity_error=error,
        )

    def law(
        self,
        memory: CascadedPidMemory,
        measured: Measured,
        reference: Reference,
        gains: CascadedPidGains,
        t: Number,
        period: Number,
    ) -> tuple[Command, CascadedPidMemory]:
        """Attitude P gives body rates, rate PID an angular acceleration."""
        error = rotation_vector(multiply(conjugate(measured.attitude), memory.wanted))
        rate_error = project(gains.attitude * error, gains.most_rate) - measured.rates
        share = 1.0 - exp(-(gains.rate_filter * period))
        rates = memory.rates + share * (measured.rates - memory.rates)
        derivative = (rates - memory.rates) * (1.0 / period)
        angular = gains.rate * rate_error + memory.rate_integral - gains.rate_derivative * derivative
        rate_integral = project(memory.rate_integral + period * (gains.rate_integral * rate_error), gains.rate_integral_bound)
        command = Command(
            thrust=memory.force @ up_axis(rotation_matrix(measured.attitude)),
            torque=gains.inertia * angular,
            desired_attitude=yaw_pitch_roll(memory.wanted),
            r1=memory.velocity_error,
            r2=rate_error,
        )
        return command, memory._replace(rate_integral=rate_integral, rates=rates)

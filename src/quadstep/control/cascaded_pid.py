"""Cascaded PID, as the paper's references [4] and [12] fly it: position, velocity, attitude, body rates, one inside the
other.
"""

from dataclasses import dataclass
from typing import NamedTuple

from quadstep.control.outer_loops import OuterGains, OuterMemory, asked_rates, begun, entered, guided
from quadstep.control.projection import project
from quadstep.control.wanted_attitude import up_axis
from quadstep.interfaces.controller import Command, Controller, Measured
from quadstep.interfaces.gain import believed, gain, usual
from quadstep.interfaces.reference import Reference
from quadstep.numbers import Number, Vector, exp, vector
from quadstep.numbers.rotations import rotation_matrix, yaw_pitch_roll


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
        return CascadedPidMemory(begun(measured, gains.outer), vector(0.0, 0.0, 0.0), measured.rates)

    def enter(self, measured: Measured, reference: Reference, gains: CascadedPidGains) -> CascadedPidMemory:
        turning = Vector(torque / inertia for torque, inertia in zip(measured.torque, gains.inertia, strict=True))
        rate_integral = project(turning + gains.rate * measured.rates, gains.rate_integral_bound)
        return CascadedPidMemory(entered(measured, reference, gains.outer), rate_integral, measured.rates)

    def guide(
        self,
        memory: CascadedPidMemory,
        measured: Measured,
        reference: Reference,
        gains: CascadedPidGains,
        t: Number,
        period: Number,
    ) -> CascadedPidMemory:
        return memory._replace(outer=guided(memory.outer, measured, reference, gains.outer, period))

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
        outer = memory.outer
        rate_error = asked_rates(outer, measured, gains.outer) - measured.rates
        share = 1.0 - exp(-(gains.rate_filter * period))
        rates = memory.rates + share * (measured.rates - memory.rates)
        derivative = (rates - memory.rates) * (1.0 / period)
        angular = gains.rate * rate_error + memory.rate_integral - gains.rate_derivative * derivative
        rate_integral = project(memory.rate_integral + period * (gains.rate_integral * rate_error), gains.rate_integral_bound)
        command = Command(
            thrust=outer.force @ up_axis(rotation_matrix(measured.attitude)),
            torque=gains.inertia * angular,
            desired_attitude=yaw_pitch_roll(outer.wanted),
            r1=outer.velocity_error,
            r2=rate_error,
        )
        return command, CascadedPidMemory(outer, rate_integral, rates)

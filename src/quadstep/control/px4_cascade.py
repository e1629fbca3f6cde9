"""PX4's own cascade for multirotors (v1.15): position and velocity at 100 Hz, attitude at 200 Hz, rates and mixer at 1 kHz.

Its parameters have PX4's names, units, ranges and defaults. A path is a trajectory setpoint, as in offboard control: position,
velocity and acceleration, heading and its rate. The law begins in the air, its hover thrust estimator (MPC_USE_HTE) settled.
"""

import math
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

from quadstep.control.filters import low_pass, share_of
from quadstep.control.mixers import (
    FULL_SPEED,
    HOVER_SPEED,
    Px4Mixer,
    command_of_thrust,
    px4_missed,
    px4_mixed,
    px4_mixer,
    thrust_of_command,
)
from quadstep.control.px4_loops import (
    STILL,
    GyroFilters,
    GyroMemory,
    MotionNow,
    PositionGains,
    Px4RateGains,
    attitude_loop,
    attitude_of,
    notch,
    of_gyro,
    position_loop,
    rate_loop,
)
from quadstep.control.vectoring import ZERO
from quadstep.interfaces.controller import Controller, Measured, RotorSpeeds
from quadstep.interfaces.gain import given, parameter, switch
from quadstep.interfaces.plant import Reference
from quadstep.numbers import Number, Vector, clip, maximum, vector, where
from quadstep.numbers.rotations import yaw_pitch_roll

RADIANS = math.pi / 180.0


class Px4RateParameters(NamedTuple):
    """Multicopter rate control: from rad/s to shares of torque."""

    roll_p: Number = parameter("MC_ROLLRATE_P", 0.15, "s/rad", "P gain of the roll rate", low=0.01, high=0.5)
    roll_i: Number = parameter("MC_ROLLRATE_I", 0.2, "1/rad", "I gain of the roll rate")
    roll_d: Number = parameter("MC_ROLLRATE_D", 0.003, "s^2/rad", "D gain of the roll rate", high=0.01)
    roll_ff: Number = parameter("MC_ROLLRATE_FF", 0.0, "s/rad", "feed-forward gain of the roll rate")
    roll_k: Number = parameter("MC_ROLLRATE_K", 1.0, "-", "factor of P, I and D of the roll rate", low=0.01, high=5.0)
    roll_most: Number = parameter("MC_RR_INT_LIM", 0.3, "-", "limit of the roll rate's integral", tunable=False)
    pitch_p: Number = parameter("MC_PITCHRATE_P", 0.15, "s/rad", "P gain of the pitch rate", low=0.01, high=0.6)
    pitch_i: Number = parameter("MC_PITCHRATE_I", 0.2, "1/rad", "I gain of the pitch rate")
    pitch_d: Number = parameter("MC_PITCHRATE_D", 0.003, "s^2/rad", "D gain of the pitch rate")
    pitch_ff: Number = parameter("MC_PITCHRATE_FF", 0.0, "s/rad", "feed-forward gain of the pitch rate")
    pitch_k: Number = parameter("MC_PITCHRATE_K", 1.0, "-", "factor of P, I and D of the pitch rate", low=0.01, high=5.0)
    pitch_most: Number = parameter("MC_PR_INT_LIM", 0.3, "-", "limit of the pitch rate's integral", tunable=False)
    yaw_p: Number = parameter("MC_YAWRATE_P", 0.2, "s/rad", "P gain of the yaw rate", high=0.6)
    yaw_i: Number = parameter("MC_YAWRATE_I", 0.1, "1/rad", "I gain of the yaw rate")
    yaw_d: Number = parameter("MC_YAWRATE_D", 0.0, "s^2/rad", "D gain of the yaw rate")
    yaw_ff: Number = parameter("MC_YAWRATE_FF", 0.0, "s/rad", "feed-forward gain of the yaw rate")
    yaw_k: Number = parameter("MC_YAWRATE_K", 1.0, "-", "factor of P, I and D of the yaw rate", high=5.0)
    yaw_most: Number = parameter("MC_YR_INT_LIM", 0.3, "-", "limit of the yaw rate's integral", tunable=False)
    airmode: Number = switch("MC_AIRMODE", 0.0, "1: thrust may grow for roll and pitch; 2: for yaw too", most=2)
    factor: Number = parameter(
        "THR_MDL_FAC", 0.0, "-", "share of a motor's thrust that is quadratic in its command", tunable=False
    )


class FilterParameters(NamedTuple):
    """Of the gyro."""

    cut: Number = parameter("IMU_GYRO_CUTOFF", 40.0, "Hz", "cut-off of body rates; 0: none", high=1000.0, tunable=False)
    derivative: Number = parameter("IMU_DGYRO_CUTOFF", 30.0, "Hz", "cut-off of D parts; 0: none", high=1000.0, tunable=False)
    centre0: Number = parameter("IMU_GYRO_NF0_FRQ", 0.0, "Hz", "first notch's centre; 0: none", high=1000.0, tunable=False)
    band0: Number = parameter("IMU_GYRO_NF0_BW", 20.0, "Hz", "first notch's bandwidth", high=100.0, tunable=False)
    centre1: Number = parameter("IMU_GYRO_NF1_FRQ", 0.0, "Hz", "second notch's centre; 0: none", high=1000.0, tunable=False)
    band1: Number = parameter("IMU_GYRO_NF1_BW", 20.0, "Hz", "second notch's bandwidth", high=100.0, tunable=False)


class Px4AttitudeParameters(NamedTuple):
    """Multicopter attitude control: from rad to rad/s."""

    roll: Number = parameter("MC_ROLL_P", 6.5, "1/s", "P gain of roll", high=12.0)
    pitch: Number = parameter("MC_PITCH_P", 6.5, "1/s", "P gain of pitch", high=12.0)
    yaw: Number = parameter("MC_YAW_P", 2.8, "1/s", "P gain of yaw", high=5.0)
    weight: Number = parameter("MC_YAW_WEIGHT", 0.4, "-", "weight of the yaw error relative to tilt", high=1.0, tunable=False)
    roll_most: Number = parameter("MC_ROLLRATE_MAX", 220.0, "deg/s", "largest commanded roll rate", tunable=False)
    pitch_most: Number = parameter("MC_PITCHRATE_MAX", 220.0, "deg/s", "largest commanded pitch rate", tunable=False)
    yaw_most: Number = parameter("MC_YAWRATE_MAX", 200.0, "deg/s", "largest commanded yaw rate", tunable=False)


class Px4PositionParameters(NamedTuple):
    """Multicopter position control."""

    xy: Number = parameter("MPC_XY_P", 0.95, "1/s", "P gain of the horizontal position", high=2.0)
    z: Number = parameter("MPC_Z_P", 1.0, "1/s", "P gain of the height", low=0.1, high=1.5)
    xy_p: Number = parameter("MPC_XY_VEL_P_ACC", 1.8, "1/s", "P gain of the horizontal speed", zero=False, low=1.2, high=5.0)
    xy_i: Number = parameter("MPC_XY_VEL_I_ACC", 0.4, "1/s^2", "I gain of the horizontal speed", high=60.0)
    xy_d: Number = parameter("MPC_XY_VEL_D_ACC", 0.2, "-", "D gain of the horizontal speed", low=0.1, high=2.0)
    z_p: Number = parameter("MPC_Z_VEL_P_ACC", 4.0, "1/s", "P gain of the vertical speed", low=2.0, high=15.0)
    z_i: Number = parameter("MPC_Z_VEL_I_ACC", 2.0, "1/s^2", "I gain of the vertical speed", low=0.2, high=3.0)
    z_d: Number = parameter("MPC_Z_VEL_D_ACC", 0.0, "-", "D gain of the vertical speed", high=2.0)
    speed: Number = parameter("MPC_XY_VEL_MAX", 12.0, "m/s", "largest horizontal speed", tunable=False)
    up: Number = parameter("MPC_Z_VEL_MAX_UP", 3.0, "m/s", "largest climb rate", tunable=False)
    down: Number = parameter("MPC_Z_VEL_MAX_DN", 1.5, "m/s", "largest descent rate", tunable=False)
    tilt: Number = parameter("MPC_TILTMAX_AIR", 45.0, "deg", "largest tilt", zero=False, tunable=False)
    least: Number = parameter("MPC_THR_MIN", 0.12, "-", "least thrust", tunable=False)
    most: Number = parameter("MPC_THR_MAX", 1.0, "-", "largest thrust", zero=False, tunable=False)
    hover: Number = parameter("MPC_THR_HOVER", 0.5, "-", "hover thrust", zero=False, tunable=False)
    estimated: Number = switch("MPC_USE_HTE", 1.0, "1: hover thrust is estimated in flight")
    reach: Number = parameter("HTE_THR_RANGE", 0.2, "-", "how far the hover thrust may be from MPC_THR_HOVER", tunable=False)
    margin: Number = parameter(
        "MPC_THR_XY_MARG", 0.3, "-", "thrust reserved for horizontal control while climbing", tunable=False
    )
    slope: Number = parameter("MPC_VELD_LP", 5.0, "Hz", "cut-off of the velocity's D part", tunable=False)
    decoupled: Number = switch("MPC_ACC_DECOUPLE", 1.0, "1: climbing does not change the tilt")


class Px4CascadeGains(NamedTuple):
    """PX4's parameters, what the law believes of the motors, and the vehicle's own mixer.

    hover_speed: of a rotor that carries its share [rad/s].
    """

    rates: Px4RateParameters
    filters: FilterParameters
    attitude: Px4AttitudeParameters
    position: Px4PositionParameters
    full_speed: Number = FULL_SPEED
    hover_speed: Number = HOVER_SPEED
    mixer: Px4Mixer = given(px4_mixer)


class Px4CascadeMemory(NamedTuple):
    """What is left for the next sample: of each loop, and setpoints of the inner ones.

    velocity [m/s], slope [m/s^2]: last one, and its filtered slope. climbing [m/s^2], turning: integrals. thrust: share.
    wanted: attitude; turn: rate of the wanted heading [rad/s]. rates: wanted [rad/s]. missed: torques not made, at the last
    sample; limited: at the last one of the attitude loop. begun, sampled: 1 after a first sample of the position loop and of
    the gyro.
    """

    velocity: Vector
    slope: Vector
    climbing: Vector
    thrust: Number
    wanted: Vector
    turn: Number
    rates: Vector
    turning: Vector
    missed: Vector
    limited: Vector
    roll: GyroMemory
    pitch: GyroMemory
    yaw: GyroMemory
    begun: Number
    sampled: Number


def hover_of(g: Px4CascadeGains) -> Number:
    """The share of thrust that carries the vehicle, as the law takes it: estimated, within the estimator's range, or said."""
    p, true = g.position, thrust_of_command(g.hover_speed / g.full_speed, g.rates.factor)
    settled = clip(true, clip(p.hover - p.reach, 0.0, 0.8), clip(p.hover + p.reach, 0.2, 0.9))
    return where(p.estimated > 0.5, settled, p.hover)


def position_gains(g: Px4CascadeGains) -> PositionGains:
    p = g.position
    outer, proportional, integral, slope = (
        vector(xy, xy, z) for xy, z in ((p.xy, p.z), (p.xy_p, p.z_p), (p.xy_i, p.z_i), (p.xy_d, p.z_d))
    )
    least = maximum(p.least, 1e-3)
    hover = hover_of(g)
    limits = (p.speed, p.up, p.down, p.tilt, least, p.most, hover, p.margin, p.decoupled)
    return PositionGains(outer, proportional, integral, slope, *limits)


def rate_gains(r: Px4RateParameters) -> Px4RateGains:
    k = vector(r.roll_k, r.pitch_k, r.yaw_k)
    p, i, d = (
        k * Vector(parts)
        for parts in ((r.roll_p, r.pitch_p, r.yaw_p), (r.roll_i, r.pitch_i, r.yaw_i), (r.roll_d, r.pitch_d, r.yaw_d))
    )
    return Px4RateGains(p, i, d, vector(r.roll_ff, r.pitch_ff, r.yaw_ff), vector(r.roll_most, r.pitch_most, r.yaw_most))


def gyro_filters(f: FilterParameters, period: Number) -> GyroFilters:
    """At this sample time [s]."""
    on = where(f.cut > 0.0, where(2.0 * f.cut * period < 1.0, 1.0, 0.0), 0.0)
    smooth = low_pass(on, where(on > 0.5, f.cut, 0.25 / period), period)  # what is off forgets too
    first, second = notch(f.centre0, f.band0, period), notch(f.centre1, f.band1, period)
    return GyroFilters(first, second, smooth, share_of(f.derivative, period))


@dataclass(frozen=True)
class Px4Cascade(Controller[Px4CascadeMemory, Measured, Px4CascadeGains, RotorSpeeds]):
    """The autopilot's cascade, on any number of rotors."""

    name = "px4-cascade"
    label = "PX4's cascade"
    source = "PX4 v1.15"
    Gains = Px4CascadeGains
    commands = RotorSpeeds
    rates: ClassVar = {"guide": 0.01, "attitude": 0.005, "law": 0.001}
    parameter_file = "px4"
    supported: ClassVar = {"CA_AIRFRAME": (0.0,), "CA_METHOD": (1.0, 2.0), "CA_R_REV": (0.0,)}
    renamed: ClassVar = {
        "IMU_GYRO_NF_FREQ": "IMU_GYRO_NF0_FRQ", "IMU_GYRO_NF_BW": "IMU_GYRO_NF0_BW", "MC_DTERM_CUTOFF": "IMU_DGYRO_CUTOFF",
        **{f"MPC_{axis}_VEL_{term}": f"MPC_{axis}_VEL_{term}_ACC" for axis in ("XY", "Z") for term in "PID"},
    }  # fmt: skip
    ordered = (
        "MPC_THR_MIN <= MPC_THR_MAX", "MPC_THR_MIN <= MPC_THR_HOVER", "MPC_THR_HOVER <= MPC_THR_MAX",
        "MPC_THR_XY_MARG <= MPC_THR_MAX",
    )  # fmt: skip

    def start(self, measured: Measured, gains: Px4CascadeGains) -> Px4CascadeMemory:
        """In the air: nothing integrated, the thrust that of a hover."""
        wanted = (hover_of(gains), measured.attitude, 0.0, ZERO)
        return Px4CascadeMemory(measured.velocity, ZERO, ZERO, *wanted, ZERO, ZERO, ZERO, STILL, STILL, STILL, 0.0, 0.0)

    def guide(
        self, memory: Px4CascadeMemory, measured: Measured, reference: Reference, gains: Px4CascadeGains,
        t: Number, period: Number,
    ) -> Px4CascadeMemory:  # fmt: skip
        """Position and velocity give a thrust, and so an attitude."""
        step = 2.0 * math.pi * gains.position.slope * period
        share = step / (1.0 + step)
        raw = memory.begun * ((measured.velocity - memory.velocity) / period)
        slope = share * raw + (1.0 - share) * memory.slope
        now = MotionNow(measured.position, measured.velocity, slope)
        thrust, climbing = position_loop(position_gains(gains), memory.climbing, now, reference, period)
        return memory._replace(
            velocity=measured.velocity, slope=slope, climbing=climbing, thrust=thrust.norm(),
            wanted=attitude_of(thrust, reference.yaw), turn=reference.yaw_rate, begun=1.0,
        )  # fmt: skip

    def attitude(
        self, memory: Px4CascadeMemory, measured: Measured, reference: Reference, gains: Px4CascadeGains,
        t: Number, period: Number,
    ) -> Px4CascadeMemory:  # fmt: skip
        """Attitude gives body rates; the mixer tells the rate loop as often what it could not make."""
        a = gains.attitude
        p, most = vector(a.roll, a.pitch, a.yaw), RADIANS * vector(a.roll_most, a.pitch_most, a.yaw_most)
        weight = clip(a.weight, 0.0, 1.0)
        rates = attitude_loop(p, weight, most, memory.wanted, measured.attitude, memory.turn)
        return memory._replace(rates=rates, limited=memory.missed)

    def law(
        self, memory: Px4CascadeMemory, measured: Measured, reference: Reference, gains: Px4CascadeGains,
        t: Number, period: Number,
    ) -> tuple[RotorSpeeds, Px4CascadeMemory]:  # fmt: skip
        """Gyro filters, rate loop, mixer and motors."""
        m, filters = memory, gyro_filters(gains.filters, period)
        axes = [
            of_gyro(filters, axis, rate, m.sampled, period)
            for axis, rate in zip((m.roll, m.pitch, m.yaw), measured.rates, strict=True)
        ]
        rates, slopes = Vector(axis.rate for axis in axes), Vector(axis.acceleration for axis in axes)
        torque, turning = rate_loop(rate_gains(gains.rates), m.turning, m.rates, rates, slopes, m.limited, period)
        outputs = px4_mixed(gains.mixer.outputs, torque, m.thrust, gains.rates.airmode)
        speeds = outputs.map(lambda output: gains.full_speed * command_of_thrust(output, gains.rates.factor))
        roll, pitch, yaw = axes
        return RotorSpeeds(speeds, yaw_pitch_roll(m.wanted)), m._replace(
            turning=turning, roll=roll, pitch=pitch, yaw=yaw, sampled=1.0,
            missed=px4_missed(gains.mixer.torques, torque, outputs),
        )  # fmt: skip

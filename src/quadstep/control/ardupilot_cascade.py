"""ArduPilot's own cascade for multirotors (Copter 4.6): rates and mixer first, then position and attitude for the next sample.

All at 500 Hz, a value of SCHED_LOOP_RATE. Parameters have ArduPilot's names, units, ranges and defaults (of 4.6.2). A path is
what the position controller is told of position, velocity and acceleration, heading and its rate. The law begins in the air,
the hover's throttle (MOT_HOVER_LEARN) learnt.
"""

import math
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

from quadstep.control.ardupilot_loops import (
    AttitudeGains,
    Held,
    PidGains,
    PidMemory,
    Target,
    attitude_loop,
    pid,
    root,
    rooted,
    shaped_target,
    shortened,
    shrinking,
    turned,
    unrooted,
)
from quadstep.control.ardupilot_mixer import factors_of, mixed
from quadstep.control.low_pass import low_pass, share_of, smoothed
from quadstep.control.thrust_curve import command_of_thrust, thrust_of_command
from quadstep.interfaces.controller import Controller, Measured, RotorSpeeds
from quadstep.interfaces.gain import BELIEF, gain, given, parameter, switch
from quadstep.interfaces.reference import Reference
from quadstep.numbers import Matrix, Number, Vector, atan2, clip, cos, maximum, minimum, sin, sqrt, vector, where
from quadstep.numbers.rotations import (
    from_rotation_vector,
    multiply,
    normalised,
    rotate,
    rotation_matrix,
    yaw_pitch_roll,
)

GRAVITY = 9.80665
"""ArduPilot's own [m/s^2]."""

CENTI = 0.01
"""Of ArduPilot's centimetres and centidegrees."""

RADIANS = math.pi / 180.0

THROTTLE_CUT = 2.0
"""Of the filter of the throttle from the height's controller [Hz]."""

LEAST_HOVER, MOST_HOVER = 0.125, 0.6875
"""Of the hover's throttle as it is learnt."""

LEAST_BEYOND = 5e-11
"""Of the square of what was beyond the lean's limit [m^2/s^4], which is 0 or more than this: `lean_that_lifts` is at least
1e-6 rad. Asked for so, the 0 of a law at rest is on no edge.
"""

LEAN_SHARE = 0.8
"""Of the throttle from which the lean is limited so that the height can be kept."""

ZERO = vector(0.0, 0.0, 0.0)

RENAMED = {
    f"{other}{ending}": f"{here}{ending}"
    for other, here, endings in (
        ("PSC_NE_POS_", "PSC_POSXY_", "P"),
        ("PSC_NE_VEL_", "PSC_VELXY_", "P I D FF IMAX FLTE FLTD"),
        ("PSC_D_POS_", "PSC_POSZ_", "P"),
        ("PSC_D_VEL_", "PSC_VELZ_", "P I D FF IMAX FLTE FLTD"),
        ("PSC_D_ACC_", "PSC_ACCZ_", "P I D FF D_FF IMAX PDMX FLTT FLTE FLTD"),
        ("POS_XY_", "PSC_POSXY_", "P"),
        ("VEL_XY_", "PSC_VELXY_", "P I IMAX"),
        ("POS_Z_", "PSC_POSZ_", "P"),
        ("VEL_Z_", "PSC_VELZ_", "P"),
        ("ACCEL_Z_", "PSC_ACCZ_", "P I D IMAX"),
        ("STB_RLL_", "ATC_ANG_RLL_", "P"),
        ("STB_PIT_", "ATC_ANG_PIT_", "P"),
        ("STB_YAW_", "ATC_ANG_YAW_", "P"),
        ("RATE_RLL_", "ATC_RAT_RLL_", "P I D IMAX"),
        ("RATE_PIT_", "ATC_RAT_PIT_", "P I D IMAX"),
        ("RATE_YAW_", "ATC_RAT_YAW_", "P I D IMAX"),
    )
    for ending in endings.split()
}
"""Names of Copter 4.7, and of 3.5 and before."""


class RollParameters(NamedTuple):
    """ATC_RAT_RLL: from rad/s to shares of torque."""

    p: Number = parameter("ATC_RAT_RLL_P", 0.135, "s/rad", "P gain of the roll rate", low=0.01, high=0.5)
    i: Number = parameter("ATC_RAT_RLL_I", 0.135, "1/rad", "I gain of the roll rate", low=0.01, high=2.0)
    d: Number = parameter("ATC_RAT_RLL_D", 0.0036, "s^2/rad", "D gain of the roll rate", high=0.05)
    ff: Number = parameter("ATC_RAT_RLL_FF", 0.0, "s/rad", "feed-forward gain of the roll rate", high=0.5)
    d_ff: Number = parameter("ATC_RAT_RLL_D_FF", 0.0, "s^2/rad", "feed-forward gain of its slope", high=0.02)
    most: Number = parameter("ATC_RAT_RLL_IMAX", 0.5, "-", "limit of the integral", tunable=False)
    most_pd: Number = parameter("ATC_RAT_RLL_PDMX", 0.0, "-", "limit of P and D; 0: none", tunable=False)
    target_cut: Number = parameter("ATC_RAT_RLL_FLTT", 20.0, "Hz", "cut-off of the target; 0: none", tunable=False)
    error_cut: Number = parameter("ATC_RAT_RLL_FLTE", 0.0, "Hz", "cut-off of the error; 0: none", tunable=False)
    slope_cut: Number = parameter("ATC_RAT_RLL_FLTD", 20.0, "Hz", "cut-off of the D part; 0: none", tunable=False)


class PitchParameters(NamedTuple):
    """ATC_RAT_PIT: from rad/s to shares of torque."""

    p: Number = parameter("ATC_RAT_PIT_P", 0.135, "s/rad", "P gain of the pitch rate", low=0.01, high=0.5)
    i: Number = parameter("ATC_RAT_PIT_I", 0.135, "1/rad", "I gain of the pitch rate", low=0.01, high=2.0)
    d: Number = parameter("ATC_RAT_PIT_D", 0.0036, "s^2/rad", "D gain of the pitch rate", high=0.05)
    ff: Number = parameter("ATC_RAT_PIT_FF", 0.0, "s/rad", "feed-forward gain of the pitch rate", high=0.5)
    d_ff: Number = parameter("ATC_RAT_PIT_D_FF", 0.0, "s^2/rad", "feed-forward gain of its slope", high=0.02)
    most: Number = parameter("ATC_RAT_PIT_IMAX", 0.5, "-", "limit of the integral", tunable=False)
    most_pd: Number = parameter("ATC_RAT_PIT_PDMX", 0.0, "-", "limit of P and D; 0: none", tunable=False)
    target_cut: Number = parameter("ATC_RAT_PIT_FLTT", 20.0, "Hz", "cut-off of the target; 0: none", tunable=False)
    error_cut: Number = parameter("ATC_RAT_PIT_FLTE", 0.0, "Hz", "cut-off of the error; 0: none", tunable=False)
    slope_cut: Number = parameter("ATC_RAT_PIT_FLTD", 20.0, "Hz", "cut-off of the D part; 0: none", tunable=False)


class YawParameters(NamedTuple):
    """ATC_RAT_YAW: from rad/s to shares of torque."""

    p: Number = parameter("ATC_RAT_YAW_P", 0.18, "s/rad", "P gain of the yaw rate", low=0.1, high=2.5)
    i: Number = parameter("ATC_RAT_YAW_I", 0.018, "1/rad", "I gain of the yaw rate", low=0.01, high=1.0)
    d: Number = parameter("ATC_RAT_YAW_D", 0.0, "s^2/rad", "D gain of the yaw rate", high=0.02)
    ff: Number = parameter("ATC_RAT_YAW_FF", 0.0, "s/rad", "feed-forward gain of the yaw rate", high=0.5)
    d_ff: Number = parameter("ATC_RAT_YAW_D_FF", 0.0, "s^2/rad", "feed-forward gain of its slope", high=0.02)
    most: Number = parameter("ATC_RAT_YAW_IMAX", 0.5, "-", "limit of the integral", tunable=False)
    most_pd: Number = parameter("ATC_RAT_YAW_PDMX", 0.0, "-", "limit of P and D; 0: none", tunable=False)
    target_cut: Number = parameter("ATC_RAT_YAW_FLTT", 20.0, "Hz", "cut-off of the target; 0: none", tunable=False)
    error_cut: Number = parameter("ATC_RAT_YAW_FLTE", 2.5, "Hz", "cut-off of the error; 0: none", tunable=False)
    slope_cut: Number = parameter("ATC_RAT_YAW_FLTD", 20.0, "Hz", "cut-off of the D part; 0: none", tunable=False)


class AttitudeParameters(NamedTuple):
    """ATC: from rad to rad/s, and its limits."""

    roll: Number = parameter("ATC_ANG_RLL_P", 4.5, "1/s", "P gain of roll", zero=False, low=3.0, high=12.0)
    pitch: Number = parameter("ATC_ANG_PIT_P", 4.5, "1/s", "P gain of pitch", zero=False, low=3.0, high=12.0)
    yaw: Number = parameter("ATC_ANG_YAW_P", 4.5, "1/s", "P gain of yaw", zero=False, low=3.0, high=12.0)
    roll_acc: Number = parameter("ATC_ACCEL_R_MAX", 110000.0, "cdeg/s^2", "largest acceleration of roll", tunable=False)
    pitch_acc: Number = parameter("ATC_ACCEL_P_MAX", 110000.0, "cdeg/s^2", "largest acceleration of pitch", tunable=False)
    yaw_acc: Number = parameter("ATC_ACCEL_Y_MAX", 27000.0, "cdeg/s^2", "largest acceleration of yaw", tunable=False)
    roll_most: Number = parameter("ATC_RATE_R_MAX", 0.0, "deg/s", "largest roll rate; 0: none", tunable=False)
    pitch_most: Number = parameter("ATC_RATE_P_MAX", 0.0, "deg/s", "largest pitch rate; 0: none", tunable=False)
    yaw_most: Number = parameter("ATC_RATE_Y_MAX", 0.0, "deg/s", "largest yaw rate; 0: none", tunable=False)
    slew: Number = parameter("ATC_SLEW_YAW", 6000.0, "cdeg/s", "largest rate of the heading's target", tunable=False)
    constant: Number = parameter("ATC_INPUT_TC", 0.15, "s", "time constant of the target", high=1.0, tunable=False)
    ahead: Number = switch("ATC_RATE_FF_ENAB", 1.0, "1: the target is shaped and its rates fed forward")
    boost: Number = switch("ATC_ANGLE_BOOST", 1.0, "1: more throttle when leaning")
    lean_constant: Number = parameter(
        "ATC_ANG_LIM_TC", 1.0, "s", "time constant of the lean's limit", zero=False, tunable=False
    )
    mix: Number = parameter("ATC_THR_MIX_MAX", 0.5, "-", "how far torques go before throttle", tunable=False)


class PositionParameters(NamedTuple):
    """PSC, WPNAV and ANGLE_MAX."""

    xy: Number = parameter("PSC_POSXY_P", 1.0, "1/s", "P gain of the horizontal position", zero=False, low=0.5, high=2.0)
    xy_p: Number = parameter("PSC_VELXY_P", 2.0, "1/s", "P gain of the horizontal velocity", low=0.1, high=6.0)
    xy_i: Number = parameter("PSC_VELXY_I", 1.0, "1/s^2", "I gain of the horizontal velocity", low=0.02, high=1.0)
    xy_d: Number = parameter("PSC_VELXY_D", 0.25, "-", "D gain of the horizontal velocity", high=1.0)
    xy_ff: Number = parameter("PSC_VELXY_FF", 0.0, "1/s", "feed-forward gain of the horizontal velocity", high=6.0)
    xy_most: Number = parameter("PSC_VELXY_IMAX", 1000.0, "cm/s^2", "limit of its integral", tunable=False)
    xy_error: Number = parameter("PSC_VELXY_FLTE", 5.0, "Hz", "cut-off of its error; 0: none", tunable=False)
    xy_slope: Number = parameter("PSC_VELXY_FLTD", 5.0, "Hz", "cut-off of its D part; 0: none", tunable=False)
    z: Number = parameter("PSC_POSZ_P", 1.0, "1/s", "P gain of the height", zero=False, low=1.0, high=3.0)
    z_p: Number = parameter("PSC_VELZ_P", 5.0, "1/s", "P gain of the vertical velocity", low=1.0, high=8.0)
    z_i: Number = parameter("PSC_VELZ_I", 0.0, "1/s^2", "I gain of the vertical velocity", low=0.0, high=1.0)
    z_d: Number = parameter("PSC_VELZ_D", 0.0, "-", "D gain of the vertical velocity", high=1.0)
    z_ff: Number = parameter("PSC_VELZ_FF", 0.0, "1/s", "feed-forward gain of the vertical velocity", high=1.0)
    z_most: Number = parameter("PSC_VELZ_IMAX", 1000.0, "cm/s^2", "limit of its integral", tunable=False)
    z_error: Number = parameter("PSC_VELZ_FLTE", 5.0, "Hz", "cut-off of its error; 0: none", tunable=False)
    z_slope: Number = parameter("PSC_VELZ_FLTD", 5.0, "Hz", "cut-off of its D part; 0: none", tunable=False)
    acc_p: Number = parameter("PSC_ACCZ_P", 0.5, "0.001 s^2/cm", "P gain of the vertical acceleration", low=0.2, high=1.5)
    acc_i: Number = parameter("PSC_ACCZ_I", 1.0, "0.001 s/cm", "I gain of the vertical acceleration", high=3.0)
    acc_d: Number = parameter("PSC_ACCZ_D", 0.0, "0.001 s^3/cm", "D gain of the vertical acceleration", high=0.4)
    acc_ff: Number = parameter("PSC_ACCZ_FF", 0.0, "0.001 s^2/cm", "feed-forward gain of it", high=0.5)
    acc_d_ff: Number = parameter("PSC_ACCZ_D_FF", 0.0, "0.001 s^3/cm", "feed-forward gain of its slope", high=0.02)
    acc_most: Number = parameter("PSC_ACCZ_IMAX", 800.0, "0.001", "limit of its integral", tunable=False)
    acc_pd: Number = parameter("PSC_ACCZ_PDMX", 0.0, "0.001", "limit of its P and D; 0: none", tunable=False)
    acc_target: Number = parameter("PSC_ACCZ_FLTT", 0.0, "Hz", "cut-off of its target; 0: none", tunable=False)
    acc_error: Number = parameter("PSC_ACCZ_FLTE", 20.0, "Hz", "cut-off of its error; 0: none", tunable=False)
    acc_slope: Number = parameter("PSC_ACCZ_FLTD", 0.0, "Hz", "cut-off of its D part; 0: none", tunable=False)
    lean: Number = parameter("PSC_ANGLE_MAX", 0.0, "deg", "largest lean; 0: ANGLE_MAX", tunable=False)
    copter_lean: Number = parameter("ANGLE_MAX", 3000.0, "cdeg", "largest lean", zero=False, tunable=False)
    speed: Number = parameter("WPNAV_SPEED", 1000.0, "cm/s", "speed of the horizontal correction", zero=False, tunable=False)
    up: Number = parameter("WPNAV_SPEED_UP", 250.0, "cm/s", "speed of a climbing correction", zero=False, tunable=False)
    down: Number = parameter("WPNAV_SPEED_DN", 150.0, "cm/s", "speed of a descending correction", zero=False, tunable=False)
    brake: Number = parameter("WPNAV_ACCEL", 250.0, "cm/s^2", "with which corrections are braked", zero=False, tunable=False)
    brake_z: Number = parameter("WPNAV_ACCEL_Z", 100.0, "cm/s^2", "the same vertically", zero=False, tunable=False)


class MotorParameters(NamedTuple):
    """MOT and INS."""

    expo: Number = parameter("MOT_THST_EXPO", 0.65, "-", "share of a motor's thrust that goes with the square", tunable=False)
    spin_min: Number = parameter("MOT_SPIN_MIN", 0.15, "-", "command of no thrust", tunable=False)
    spin_max: Number = parameter("MOT_SPIN_MAX", 0.95, "-", "command of full thrust", zero=False, tunable=False)
    hover: Number = parameter("MOT_THST_HOVER", 0.35, "-", "throttle of a hover", zero=False, tunable=False)
    learn: Number = switch("MOT_HOVER_LEARN", 2.0, "above 0: the throttle of a hover is learnt", most=2)
    headroom: Number = parameter("MOT_YAW_HEADROOM", 200.0, "0.001", "room that yaw keeps", tunable=False)
    gyro_cut: Number = parameter("INS_GYRO_FILTER", 20.0, "Hz", "cut-off of the gyro; 0: none", tunable=False)
    acc_cut: Number = parameter("INS_ACCEL_FILTER", 20.0, "Hz", "cut-off of the accelerometer; 0: none", tunable=False)


class ArduPilotCascadeGains(NamedTuple):
    """ArduPilot's parameters, what the law believes of the motors, and the vehicle's own mixer.

    hover_speed: of a rotor that carries its share [rad/s]. factors: of each rotor in roll, pitch and yaw.
    """

    roll: RollParameters
    pitch: PitchParameters
    yaw: YawParameters
    attitude: AttitudeParameters
    position: PositionParameters
    motors: MotorParameters
    full_speed: Number = gain(
        lambda model: model.fastest,
        "rad/s",
        "speed of a rotor at full command; default: the vehicle's",
        tunable=False,
        group=BELIEF,
    )
    hover_speed: Number = given(lambda model: sqrt(model.mass * model.gravity / (model.rotors * model.per_speed)))
    factors: Matrix = given(factors_of)


class ArduPilotCascadeMemory(NamedTuple):
    """What is left for the next sample.

    gyro, felt: delays of the sensors' filters, a row for each axis. roll, pitch, yaw: of the rate loops; wanted: their target
    [rad/s]. climb, acceleration: of the loops of vertical velocity and acceleration. push: of that of the horizontal velocity,
    its error, slope, integral, and what was beyond the lean's limit. throttle: filtered; asked: for the filter; average: up to
    which the mixer may raise it. lean: limit that keeps the height [rad]. limits: of roll and pitch, of yaw, of throttle up
    and down, 1 or 0. begun: 1 after a first sample.
    """

    gyro: Matrix
    felt: Matrix
    roll: PidMemory
    pitch: PidMemory
    yaw: PidMemory
    wanted: Vector
    climb: PidMemory
    acceleration: PidMemory
    push: Matrix
    target: Target
    throttle: Number
    asked: Number
    average: Number
    lean: Number
    limits: Vector
    begun: Number


NOTHING = PidMemory(0.0, 0.0, 0.0, 0.0)


def hover_of(g: ArduPilotCascadeGains) -> Number:
    """The hover's throttle as the law takes it: learnt, within what is learnt at all, or said."""
    m = g.motors
    command = (g.hover_speed / g.full_speed - m.spin_min) / (m.spin_max - m.spin_min)
    return where(m.learn > 0.5, clip(thrust_of_command(command, m.expo), LEAST_HOVER, MOST_HOVER), m.hover)


def filtered(cut: Number, delays: Matrix, values: Vector, begun: Number, period: Number) -> tuple[Vector, Matrix]:
    """Of a sensor's three axes. cut: of the filter [Hz]; 0: none."""
    on = where(cut > 0.0, where(2.0 * cut * period < 1.0, 1.0, 0.0), 0.0)
    by = low_pass(on, where(on > 0.5, cut, 0.25 / period), period)
    smooth, left = [], []
    for value, past in zip(values, delays, strict=True):
        first = Vector(where(begun > 0.5, one, value / (1.0 + by.a1 + by.a2)) for one in past)
        one, after = smoothed(by, first, value)
        smooth.append(one)
        left.append(after)
    return Vector(smooth), Matrix(left)


def attitude_gains(g: ArduPilotCascadeGains) -> AttitudeGains:
    """Of the attitude loop."""
    a, centi = g.attitude, CENTI * RADIANS
    return AttitudeGains(
        vector(a.roll, a.pitch, a.yaw), centi * vector(a.roll_acc, a.pitch_acc, a.yaw_acc),
        RADIANS * vector(a.roll_most, a.pitch_most, a.yaw_most), centi * a.slew, a.constant, g.yaw.p, a.ahead,
    )  # fmt: skip


def lean_limit(g: ArduPilotCascadeGains, memory: ArduPilotCascadeMemory) -> Number:
    """The largest lean [rad]."""
    p = g.position
    return minimum(memory.lean, RADIANS * where(p.lean > 0.0, p.lean, CENTI * p.copter_lean))


def horizontal(
    g: ArduPilotCascadeGains, m: ArduPilotCascadeMemory, measured: Measured, reference: Reference, period: Number
) -> tuple[Vector, Matrix]:
    """The acceleration wanted in the plane [m/s^2], and the new memory of its loop."""
    p, brake = g.position, CENTI * g.position.brake
    error, slope, integral, beyond = m.push
    away = plane(reference.position - measured.position)
    correction = rooted(shortened(away, unrooted(CENTI * p.speed, p.xy, brake)), p.xy, brake)
    aim = correction + plane(reference.velocity)
    raw = aim - plane(measured.velocity)
    some = m.begun > 0.5
    new = either(some, error + share_of(p.xy_error, period) * (raw - error), raw)
    change = (new - error) / period
    slope = either(some, slope + share_of(p.xy_slope, period) * (change - slope), 0.0 * raw)
    step = (period * p.xy_i) * new
    grown = integral + step
    before = integral @ integral
    leaning = beyond @ beyond > LEAST_BEYOND
    held = where(leaning, where(step @ beyond > 0.0, 1.0, 0.0), 0.0)
    longer = where(held > 0.5, where(grown @ grown > before, 1.0, 0.0), 0.0)
    size = grown @ grown
    back = where(longer > 0.5, sqrt(before / where(size > 0.0, size, 1.0)), 1.0)
    integral = shortened(back * grown, CENTI * p.xy_most)
    asked = p.xy_p * new + integral + p.xy_d * slope + p.xy_ff * aim + plane(reference.acceleration)
    lean = lean_limit(g, m)
    most = GRAVITY * sin(lean) / cos(lean)
    made = across_first(asked, plane(reference.velocity), most)
    over = asked @ asked > most * most
    return made, Matrix([new, slope, integral, either(over, asked, 0.0 * asked)])


def plane(v: Vector) -> Vector:
    """The horizontal parts."""
    return vector(v[0], v[1])


def either(condition: object, yes: Vector, no: Vector) -> Vector:
    """One of two vectors."""
    return Vector(where(condition, one, other) for one, other in zip(yes, no, strict=True))  # type: ignore[arg-type]


def across_first(acceleration: Vector, velocity: Vector, most: Number) -> Vector:
    """An acceleration of at most this length, what is across a velocity kept first."""
    speed = velocity @ velocity
    moving = speed > 0.0
    unit = (1.0 / sqrt(where(moving, speed, 1.0))) * velocity
    along = unit @ acceleration
    across = shortened(acceleration - along * unit, most)
    left = sqrt(maximum(most * most - across @ across, 0.0))
    over = acceleration @ acceleration > most * most
    turned = across + clip(along, -left, left) * unit
    return either(over, either(moving, turned, shortened(acceleration, most)), acceleration)


def vertical(
    g: ArduPilotCascadeGains, m: ArduPilotCascadeMemory, measured: Measured, reference: Reference, up: Number, period: Number
) -> tuple[Number, PidMemory, PidMemory]:
    """The throttle of the height's controller, and the new memories of its loops. up: measured acceleration [m/s^2]."""
    p, brake = g.position, CENTI * g.position.brake_z
    away = clip(
        reference.position[2] - measured.position[2],
        -unrooted(CENTI * p.down, p.z, brake), unrooted(CENTI * p.up, p.z, brake),
    )  # fmt: skip
    aim = root(away, p.z, brake) + reference.velocity[2]
    climbing = PidGains(p.z_p, p.z_i, p.z_d, p.z_ff, 0.0, CENTI * p.z_most, 0.0, 0.0, p.z_error, p.z_slope)
    asked, ahead, climb = pid(climbing, m.climb, aim, measured.velocity[2], Held(m.limits[3], m.limits[2]), m.begun, period)
    wanted = asked + ahead + reference.acceleration[2]
    hover = hover_of(g)
    most = maximum(p.acc_most, 1000.0 * hover)
    accelerating = PidGains(
        p.acc_p, p.acc_i, p.acc_d, p.acc_ff, p.acc_d_ff, most, p.acc_pd, p.acc_target, p.acc_error, p.acc_slope
    )
    held = shrinking(maximum(m.limits[2], m.limits[3]), m.acceleration)
    throttle, more, acceleration = pid(accelerating, m.acceleration, wanted / CENTI, up / CENTI, held, m.begun, period)
    return 0.001 * (throttle + more) + hover, climb, acceleration


@dataclass(frozen=True)
class ArduPilotCascade(Controller[ArduPilotCascadeMemory, Measured, ArduPilotCascadeGains, RotorSpeeds]):
    """The autopilot's cascade, on any number of rotors."""

    name = "ardupilot-cascade"
    label = "ArduPilot's cascade"
    source = "ArduPilot Copter 4.6"
    Gains = ArduPilotCascadeGains
    commands = RotorSpeeds
    also_measures = ("specific_force",)
    rates: ClassVar = {"law": 0.002}
    stock = True
    parameter_file = "ardupilot"
    supported: ClassVar = {"FRAME_CLASS": (1.0, 2.0, 3.0, 4.0, 5.0, 7.0, 12.0, 14.0)}
    renamed: ClassVar = RENAMED
    ordered = ("MOT_SPIN_MIN < MOT_SPIN_MAX",)

    def start(self, measured: Measured, gains: ArduPilotCascadeGains) -> ArduPilotCascadeMemory:
        """In the air: nothing integrated, the throttle that of a hover."""
        hover, still, flat = hover_of(gains), Matrix([vector(0.0, 0.0)] * 3), Matrix([vector(0.0, 0.0)] * 4)
        loops = (NOTHING, NOTHING, NOTHING, ZERO, NOTHING, NOTHING)
        lean = RADIANS * CENTI * gains.position.copter_lean
        target = Target(measured.attitude, ZERO)
        return ArduPilotCascadeMemory(
            still, still, *loops, flat, target, hover, hover, hover, lean, vector(0.0, 0.0, 0.0, 0.0), 0.0
        )

    def law(
        self, memory: ArduPilotCascadeMemory, measured: Measured, reference: Reference, gains: ArduPilotCascadeGains,
        t: Number, period: Number,
    ) -> tuple[RotorSpeeds, ArduPilotCascadeMemory]:  # fmt: skip
        """Rate loops, mixer and motors; then what position and attitude make of the same measurement."""
        m, g = memory, gains
        rates, gyro = filtered(g.motors.gyro_cut, m.gyro, measured.rates, m.begun, period)
        loops = zip(
            (g.roll, g.pitch, g.yaw), (m.roll, m.pitch, m.yaw), m.wanted, rates, (m.limits[0], m.limits[0], m.limits[1]),
            strict=True,
        )  # fmt: skip
        found = [
            pid(PidGains(*own), past, aim, rate, shrinking(limited, past), m.begun, period)
            for own, past, aim, rate, limited in loops
        ]
        torque = Vector(output + ahead for output, ahead, _ in found)
        throttle = clip(m.throttle + share_of(THROTTLE_CUT, period) * (m.asked - m.throttle), 0.0, 1.0)
        made = mixed(g.factors, torque, throttle, m.average, 0.001 * g.motors.headroom)
        speeds = made.thrusts.map(lambda thrust: g.full_speed * command_of(g.motors, thrust))
        roll, pitch, yaw = (left for _, _, left in found)
        after = m._replace(
            gyro=gyro, roll=roll, pitch=pitch, yaw=yaw, throttle=throttle,
            limits=vector(made.tilting, made.turning, made.upper, made.lower),
        )  # fmt: skip
        after = outer(after, measured, rates, reference, g, period)
        return RotorSpeeds(speeds, yaw_pitch_roll(after.target.attitude)), after._replace(begun=1.0)


def command_of(motors: MotorParameters, thrust: Number) -> Number:
    """A motor's command."""
    return motors.spin_min + (motors.spin_max - motors.spin_min) * command_of_thrust(clip(thrust, 0.0, 1.0), motors.expo)


def outer(
    m: ArduPilotCascadeMemory,
    measured: Measured,
    rates: Vector,
    reference: Reference,
    g: ArduPilotCascadeGains,
    period: Number,
) -> ArduPilotCascadeMemory:
    """Position and attitude: the memory with the rates and the throttle for the next sample."""
    force, felt = filtered(g.motors.acc_cut, m.felt, measured.specific_force, m.begun, period)
    up = rotate(measured.attitude, force)[2] - GRAVITY
    asked, push = horizontal(g, m, measured, reference, period)
    lift, climb, acceleration = vertical(g, m, measured, reference, up, period)
    level = rotation_matrix(measured.attitude)[2, 2]
    boosted = lift * clip(10.0 * level, 0.0, 1.0) / clip(level, 0.1, 1.0)
    boosted = where(g.attitude.boost > 0.5, boosted, lift)
    hover, mix, high = hover_of(g), g.attitude.mix, clip(maximum(boosted, lift), 0.0, 1.0)
    average = maximum(high, high * maximum(0.0, 1.0 - mix) + hover * mix)
    lean = m.lean + period / (period + g.attitude.lean_constant) * (lean_that_lifts(lift) - m.lean)
    wanted = multiply(tilt_to(vector(asked[0], asked[1], GRAVITY)), from_rotation_vector(vector(0.0, 0.0, reference.yaw)))
    attitude = attitude_gains(g)
    target = shaped_target(attitude, m.target, wanted, reference.yaw_rate, period)
    turning, target = attitude_loop(attitude, target, measured.attitude, rates, period)
    return m._replace(
        felt=felt, push=push, climb=climb, acceleration=acceleration, lean=lean, asked=boosted, average=average,
        target=turned(target, period), wanted=turning,
    )  # fmt: skip


def lean_that_lifts(throttle: Number) -> Number:
    """At which LEAN_SHARE of full throttle keeps the height [rad]."""
    cosine = clip(throttle / LEAN_SHARE, 0.0, 1.0)
    return atan2(sqrt(maximum(1.0 - cosine * cosine, 1e-12)), cosine)


def tilt_to(force: Vector) -> Vector:
    """The shortest turn that lifts along an upward force."""
    x, y, z = normalised(force)
    return normalised(vector(1.0 + z, -y, x, 0.0))

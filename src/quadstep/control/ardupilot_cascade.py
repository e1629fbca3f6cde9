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
    IntegratorLimits,
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
from quadstep.control.autopilot_parameters import (
    PITCH,
    RENAMED,
    ROLL,
    YAW,
    ArduPilotAttitudeParameters,
    ArduPilotPositionParameters,
    MotorParameters,
)
from quadstep.control.filters import low_pass, share_of, smoothed
from quadstep.control.mixers import (
    FULL_SPEED,
    HOVER_SPEED,
    ardupilot_factors,
    ardupilot_mixed,
    command_of_thrust,
    thrust_of_command,
)
from quadstep.control.vectoring import ZERO
from quadstep.interfaces.controller import Controller, Measured, RotorSpeeds
from quadstep.interfaces.gain import given, nested
from quadstep.interfaces.plant import Reference
from quadstep.numbers import Matrix, Number, Vector, atan2, clip, cos, either, maximum, minimum, sin, sqrt, vector, where
from quadstep.numbers.rotations import from_rotation_vector, multiply, normalised, rotate, rotation_matrix, yaw_pitch_roll

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


class ArduPilotCascadeGains(NamedTuple):
    """ArduPilot's parameters, what the law believes of the motors, and the vehicle's own mixer.

    hover_speed: of a rotor that carries its share [rad/s]. factors: of each rotor in roll, pitch and yaw.
    """

    roll: PidGains = ROLL
    pitch: PidGains = PITCH
    yaw: PidGains = YAW
    attitude: ArduPilotAttitudeParameters = nested()
    position: ArduPilotPositionParameters = nested()
    motors: MotorParameters = nested()
    full_speed: Number = FULL_SPEED
    hover_speed: Number = HOVER_SPEED
    factors: Matrix = given(ardupilot_factors)


class ArduPilotCascadeMemory(NamedTuple):
    """What is left for the next sample.

    gyro, felt: delays of the sensors' filters, a row for each axis. roll, pitch, yaw: of the rate loops; wanted: their target
    [rad/s]. climb, acceleration: of the loops of vertical velocity and acceleration. push: of that of the horizontal velocity,
    its error, slope, integral, and what was beyond the lean's limit. throttle: filtered; asked: for the filter; average: up to
    which the mixer may raise it. level: cosine of the last sample's tilt. lean: limit that keeps the height [rad]. limits: of
    roll and pitch, of yaw, of throttle up and down, 1 or 0. begun: 1 after a first sample.
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
    level: Number
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
    asked, ahead, climb = pid(
        climbing, m.climb, aim, measured.velocity[2], IntegratorLimits(m.limits[3], m.limits[2]), m.begun, period
    )
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
        level = rotation_matrix(measured.attitude)[2, 2]
        return ArduPilotCascadeMemory(
            still, still, *loops, flat, target, hover, hover, hover, level, lean, vector(0.0, 0.0, 0.0, 0.0), 0.0
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
            pid(own, past, aim, rate, shrinking(limited, past), m.begun, period) for own, past, aim, rate, limited in loops
        ]
        torque = Vector(output + ahead for output, ahead, _ in found)
        throttle = clip(m.throttle + share_of(THROTTLE_CUT, period) * (m.asked - m.throttle), 0.0, 1.0)
        made = ardupilot_mixed(g.factors, torque, throttle, m.average, 0.001 * g.motors.headroom)
        speeds = made.thrusts.map(lambda thrust: g.full_speed * command_of(g.motors, thrust))
        roll, pitch, yaw = (left for _, _, left in found)
        after = m._replace(
            gyro=gyro, roll=roll, pitch=pitch, yaw=yaw, throttle=throttle,
            limits=vector(made.tilting, made.turning, made.upper, made.lower),
        )  # fmt: skip
        after = outer(after, measured, rates, reference, g, period)
        return RotorSpeeds(speeds, yaw_pitch_roll(after.target.attitude)), after._replace(begun=1.0)


def command_of(motors: MotorParameters, thrust: Number) -> Number:
    return motors.spin_min + (motors.spin_max - motors.spin_min) * command_of_thrust(clip(thrust, 0.0, 1.0), motors.expo)


def outer(
    m: ArduPilotCascadeMemory, measured: Measured, rates: Vector, reference: Reference,
    g: ArduPilotCascadeGains, period: Number,
) -> ArduPilotCascadeMemory:  # fmt: skip
    """Position and attitude: the memory with the rates and the throttle for the next sample."""
    force, felt = filtered(g.motors.acc_cut, m.felt, measured.specific_force, m.begun, period)
    up = rotate(measured.attitude, force)[2] - GRAVITY
    asked, push = horizontal(g, m, measured, reference, period)
    lift, climb, acceleration = vertical(g, m, measured, reference, up, period)
    level = rotation_matrix(measured.attitude)[2, 2]
    boosted = lift * clip(10.0 * level, 0.0, 1.0) / clip(m.level, 0.1, 1.0)
    boosted = where(g.attitude.boost > 0.5, boosted, lift)
    hover, mix, high = hover_of(g), g.attitude.mix, clip(maximum(boosted, lift), 0.0, 1.0)
    average = maximum(high, high * maximum(0.0, 1.0 - mix) + hover * mix)
    lean = m.lean + period / (period + g.attitude.lean_constant) * (lean_that_lifts(lift) - m.lean)
    wanted = multiply(tilt_to(vector(asked[0], asked[1], GRAVITY)), from_rotation_vector(vector(0.0, 0.0, reference.yaw)))
    attitude = attitude_gains(g)
    target = shaped_target(attitude, m.target, wanted, reference.yaw_rate, period)
    turning, target = attitude_loop(attitude, target, measured.attitude, rates, period)
    return m._replace(
        felt=felt, push=push, climb=climb, acceleration=acceleration, level=level, lean=lean, asked=boosted,
        average=average, target=turned(target, period), wanted=turning,
    )  # fmt: skip


def lean_that_lifts(throttle: Number) -> Number:
    """At which LEAN_SHARE of full throttle keeps the height [rad]."""
    cosine = clip(throttle / LEAN_SHARE, 0.0, 1.0)
    return atan2(sqrt(maximum(1.0 - cosine * cosine, 1e-12)), cosine)


def tilt_to(force: Vector) -> Vector:
    """The shortest turn that lifts along an upward force."""
    x, y, z = normalised(force)
    return normalised(vector(1.0 + z, -y, x, 0.0))

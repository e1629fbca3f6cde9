"""The Crazyflie's own cascade of PID loops (firmware 2026.08): position, velocity, attitude, body rates, one inside the other.

Angles are in degrees, pitch is nose up, and horizontal loops turn with the heading, as in the firmware. Each loop is

    u = kp e + ki I + kd D + kff w,    e = w - y,    I <- clip(I + e dt, +-limit),    D = low_pass(-(y - y_before) / dt)

at 100 Hz for position and velocity, at 500 Hz for attitude and rates. Feed-forward of a path's velocity and acceleration is
none: the firmware follows absolute setpoints by their position alone.
"""

import math
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

from quadstep.control.filters import LowPass, low_pass, smoothed
from quadstep.control.mixers import COUNTS, FULL, OnQuarters, crazyflie_thrusts
from quadstep.interfaces.controller import Controller, Measured, RotorThrusts
from quadstep.interfaces.gain import parameter, switch
from quadstep.interfaces.plant import Reference
from quadstep.numbers import Number, Vector, atan2, clip, cos, maximum, sin, vector, where
from quadstep.numbers.rotations import yaw_pitch_roll

DEGREES = 180.0 / math.pi
OVERHEAD = 1.1
"""Of the limits of commanded speed and tilt, inside the loops that command them."""

SLOWEST = 0.5
"""Least limit of the commanded vertical speed [m/s]."""

PER_RAW = 1000.0
"""Counts of thrust for one of the vertical velocity loop's."""

MOST_CLIMB, MOST_TURN = 32.767, 32767.0
"""Of the vertical velocity loop, and of the three rate loops [counts]: half of all counts."""

CUT_OFF = 20.0
"""Of the D parts' filters in the loops of position and velocity [Hz]."""

INTEGRALS = {"outer": 5000.0, "roll": 20.0, "yaw": 360.0, "roll_rate": 33.3, "yaw_rate": 166.7}
"""Limits of the integrals, in the unit of each loop's error times seconds; those of pitch are those of roll."""


class CrazyflieRateParameters(NamedTuple):
    """Group `pid_rate`: from deg/s to counts."""

    roll_kp: Number = parameter("pid_rate.roll_kp", 250.0, "counts/(deg/s)", "P gain of the roll rate")
    roll_ki: Number = parameter("pid_rate.roll_ki", 500.0, "counts/deg", "I gain of the roll rate")
    roll_kd: Number = parameter("pid_rate.roll_kd", 2.5, "counts/(deg/s^2)", "D gain of the roll rate")
    roll_kff: Number = parameter("pid_rate.roll_kff", 0.0, "counts/(deg/s)", "feed-forward gain of the roll rate")
    pitch_kp: Number = parameter("pid_rate.pitch_kp", 250.0, "counts/(deg/s)", "P gain of the pitch rate")
    pitch_ki: Number = parameter("pid_rate.pitch_ki", 500.0, "counts/deg", "I gain of the pitch rate")
    pitch_kd: Number = parameter("pid_rate.pitch_kd", 2.5, "counts/(deg/s^2)", "D gain of the pitch rate")
    pitch_kff: Number = parameter("pid_rate.pitch_kff", 0.0, "counts/(deg/s)", "feed-forward gain of the pitch rate")
    yaw_kp: Number = parameter("pid_rate.yaw_kp", 120.0, "counts/(deg/s)", "P gain of the yaw rate")
    yaw_ki: Number = parameter("pid_rate.yaw_ki", 16.7, "counts/deg", "I gain of the yaw rate")
    yaw_kd: Number = parameter("pid_rate.yaw_kd", 0.0, "counts/(deg/s^2)", "D gain of the yaw rate")
    yaw_kff: Number = parameter("pid_rate.yaw_kff", 0.0, "counts/(deg/s)", "feed-forward gain of the yaw rate")
    filtered: Number = switch("pid_rate.rateFiltEn", 0.0, "1: the rates' D parts are filtered")
    roll_cut: Number = parameter("pid_rate.omxFiltCut", 30.0, "Hz", "cut-off of roll's D part", zero=False, tunable=False)
    pitch_cut: Number = parameter("pid_rate.omyFiltCut", 30.0, "Hz", "cut-off of pitch's D part", zero=False, tunable=False)
    yaw_cut: Number = parameter("pid_rate.omzFiltCut", 30.0, "Hz", "cut-off of yaw's D part", zero=False, tunable=False)


class CrazyflieAttitudeParameters(NamedTuple):
    """Group `pid_attitude`: from deg to deg/s."""

    roll_kp: Number = parameter("pid_attitude.roll_kp", 6.0, "1/s", "P gain of roll")
    roll_ki: Number = parameter("pid_attitude.roll_ki", 3.0, "1/s^2", "I gain of roll")
    roll_kd: Number = parameter("pid_attitude.roll_kd", 0.0, "-", "D gain of roll")
    roll_kff: Number = parameter("pid_attitude.roll_kff", 0.0, "1/s", "feed-forward gain of roll")
    pitch_kp: Number = parameter("pid_attitude.pitch_kp", 6.0, "1/s", "P gain of pitch")
    pitch_ki: Number = parameter("pid_attitude.pitch_ki", 3.0, "1/s^2", "I gain of pitch")
    pitch_kd: Number = parameter("pid_attitude.pitch_kd", 0.0, "-", "D gain of pitch")
    pitch_kff: Number = parameter("pid_attitude.pitch_kff", 0.0, "1/s", "feed-forward gain of pitch")
    yaw_kp: Number = parameter("pid_attitude.yaw_kp", 6.0, "1/s", "P gain of yaw")
    yaw_ki: Number = parameter("pid_attitude.yaw_ki", 1.0, "1/s^2", "I gain of yaw")
    yaw_kd: Number = parameter("pid_attitude.yaw_kd", 0.35, "-", "D gain of yaw")
    yaw_kff: Number = parameter("pid_attitude.yaw_kff", 0.0, "1/s", "feed-forward gain of yaw")
    filtered: Number = switch("pid_attitude.attFiltEn", 0.0, "1: the angles' D parts are filtered")
    cut: Number = parameter("pid_attitude.attFiltCut", 15.0, "Hz", "cut-off of the angles' D parts", zero=False, tunable=False)


class VelocityParameters(NamedTuple):
    """Group `velCtlPid`: from m/s to deg, vertically to thousands of counts."""

    x_kp: Number = parameter("velCtlPid.vxKp", 25.0, "deg/(m/s)", "P gain of the forward velocity")
    x_ki: Number = parameter("velCtlPid.vxKi", 1.0, "deg/m", "I gain of the forward velocity")
    x_kd: Number = parameter("velCtlPid.vxKd", 0.0, "deg/(m/s^2)", "D gain of the forward velocity")
    x_kff: Number = parameter("velCtlPid.vxKFF", 0.0, "deg/(m/s)", "feed-forward gain of the forward velocity")
    y_kp: Number = parameter("velCtlPid.vyKp", 25.0, "deg/(m/s)", "P gain of the leftward velocity")
    y_ki: Number = parameter("velCtlPid.vyKi", 1.0, "deg/m", "I gain of the leftward velocity")
    y_kd: Number = parameter("velCtlPid.vyKd", 0.0, "deg/(m/s^2)", "D gain of the leftward velocity")
    y_kff: Number = parameter("velCtlPid.vyKFF", 0.0, "deg/(m/s)", "feed-forward gain of the leftward velocity")
    z_kp: Number = parameter("velCtlPid.vzKp", 25.0, "1000 counts/(m/s)", "P gain of the vertical velocity")
    z_ki: Number = parameter("velCtlPid.vzKi", 15.0, "1000 counts/m", "I gain of the vertical velocity")
    z_kd: Number = parameter("velCtlPid.vzKd", 0.0, "1000 counts/(m/s^2)", "D gain of the vertical velocity")
    z_kff: Number = parameter("velCtlPid.vzKFF", 0.0, "1000 counts/(m/s)", "feed-forward gain of the vertical velocity")


class CrazyfliePositionParameters(NamedTuple):
    """Group `posCtlPid`: from m to m/s, and limits."""

    x_kp: Number = parameter("posCtlPid.xKp", 2.0, "1/s", "P gain of the forward position")
    x_ki: Number = parameter("posCtlPid.xKi", 0.0, "1/s^2", "I gain of the forward position")
    x_kd: Number = parameter("posCtlPid.xKd", 0.0, "-", "D gain of the forward position")
    x_kff: Number = parameter("posCtlPid.xKff", 0.0, "1/s", "feed-forward gain of the forward position")
    y_kp: Number = parameter("posCtlPid.yKp", 2.0, "1/s", "P gain of the leftward position")
    y_ki: Number = parameter("posCtlPid.yKi", 0.0, "1/s^2", "I gain of the leftward position")
    y_kd: Number = parameter("posCtlPid.yKd", 0.0, "-", "D gain of the leftward position")
    y_kff: Number = parameter("posCtlPid.yKff", 0.0, "1/s", "feed-forward gain of the leftward position")
    z_kp: Number = parameter("posCtlPid.zKp", 2.0, "1/s", "P gain of the height")
    z_ki: Number = parameter("posCtlPid.zKi", 0.5, "1/s^2", "I gain of the height")
    z_kd: Number = parameter("posCtlPid.zKd", 0.0, "-", "D gain of the height")
    z_kff: Number = parameter("posCtlPid.zKff", 0.0, "1/s", "feed-forward gain of the height")
    hover: Number = parameter("posCtlPid.thrustBase", 36000.0, "counts", "hover thrust", zero=False)
    least: Number = parameter("posCtlPid.thrustMin", 20000.0, "counts", "least thrust", zero=False, tunable=False)
    roll: Number = parameter("posCtlPid.rLimit", 20.0, "deg", "largest commanded roll", zero=False, tunable=False)
    pitch: Number = parameter("posCtlPid.pLimit", 20.0, "deg", "largest commanded pitch", zero=False, tunable=False)
    x_speed: Number = parameter("posCtlPid.xVelMax", 1.0, "m/s", "largest forward speed", zero=False, tunable=False)
    y_speed: Number = parameter("posCtlPid.yVelMax", 1.0, "m/s", "largest speed to the left", zero=False, tunable=False)
    z_speed: Number = parameter("posCtlPid.zVelMax", 1.0, "m/s", "largest vertical speed", zero=False, tunable=False)


class CrazyfliePidGains(NamedTuple):
    """The firmware's parameters by their groups, and the thrust of a rotor at full command [N]."""

    rates: CrazyflieRateParameters
    attitude: CrazyflieAttitudeParameters
    velocity: VelocityParameters
    position: CrazyfliePositionParameters
    full_thrust: Number = FULL


class LoopMemory(NamedTuple):
    """integral: of the error. before: the last measured value. delays: of the D part's filter, shape (2,)."""

    integral: Number
    before: Number
    delays: Vector


class CrazyfliePidMemory(NamedTuple):
    """A memory of each loop. tilt [deg]: roll and pitch that the outer ones command. thrust [counts]: that they command."""

    x: LoopMemory
    y: LoopMemory
    z: LoopMemory
    vx: LoopMemory
    vy: LoopMemory
    vz: LoopMemory
    roll: LoopMemory
    pitch: LoopMemory
    yaw: LoopMemory
    roll_rate: LoopMemory
    pitch_rate: LoopMemory
    yaw_rate: LoopMemory
    tilt: Vector
    thrust: Number


def began(value: Number) -> LoopMemory:
    return LoopMemory(0.0, value, vector(0.0, 0.0))


def pid(
    gains: tuple[Number, ...], memory: LoopMemory, wanted: Number, measured: Number, most_integral: float,
    filtered: LowPass, period: Number, turns: bool = False,
) -> tuple[Number, LoopMemory]:  # fmt: skip
    """One sample of a loop. gains: kp, ki, kd, kff. turns: whether it is a heading [deg], which goes the short way."""
    kp, ki, kd, kff = gains
    error, change = wanted - measured, -(measured - memory.before)
    if turns:
        error, change = short_way(error), short_way(change)
    slope, delays = smoothed(filtered, memory.delays, change / period)
    integral = clip(memory.integral + error * period, -most_integral, most_integral)
    output = kp * error + kd * slope + ki * integral + kff * wanted
    return output, LoopMemory(integral, measured, delays)


def short_way(angle: Number) -> Number:
    """An angle [deg] a turn nearer to zero."""
    return where(angle > 180.0, angle - 360.0, where(angle < -180.0, angle + 360.0, angle))


def angles(attitude: Vector) -> tuple[Number, Number, Number]:
    """Roll, pitch (nose up) and yaw [deg]."""
    yaw, pitch, roll = yaw_pitch_roll(attitude)
    return DEGREES * roll, -DEGREES * pitch, DEGREES * yaw


def along(heading: Number, x: Number, y: Number) -> tuple[Number, Number]:
    """A horizontal vector, ahead and to the left."""
    c, s = cos(heading / DEGREES), sin(heading / DEGREES)
    return x * c + y * s, -x * s + y * c


@dataclass(frozen=True)
class CrazyfliePid(OnQuarters, Controller[CrazyfliePidMemory, Measured, CrazyfliePidGains, RotorThrusts]):
    """The firmware's cascade."""

    name = "crazyflie-pid"
    label = "Crazyflie's PID"
    source = "Crazyflie firmware 2026.08"
    Gains = CrazyfliePidGains
    commands = RotorThrusts
    rates: ClassVar = {"guide": 0.01, "law": 0.002}
    parameter_file = "crazyflie"
    unmodelled = ("pid_attitude.yawMaxDelta",)
    ordered = ("posCtlPid.thrustMin <= posCtlPid.thrustBase",)

    def start(self, measured: Measured, gains: CrazyfliePidGains) -> CrazyfliePidMemory:
        """As after a change of the setpoint's mode: nothing integrated."""
        roll, pitch, yaw = angles(measured.attitude)
        x, y, z = (began(one) for one in measured.position)
        m_roll, m_pitch, m_yaw, still = (began(one) for one in (roll, pitch, yaw, 0.0))
        tilt, hover = vector(roll, pitch), gains.position.hover
        return CrazyfliePidMemory(x, y, z, still, still, still, m_roll, m_pitch, m_yaw, still, still, still, tilt, hover)

    def guide(
        self, memory: CrazyfliePidMemory, measured: Measured, reference: Reference, gains: CrazyfliePidGains,
        t: Number, period: Number,
    ) -> CrazyfliePidMemory:  # fmt: skip
        """The position loops give a velocity, the velocity loops a tilt and a thrust."""
        p, v = gains.position, gains.velocity
        _, _, yaw = angles(measured.attitude)
        smooth, most = low_pass(1.0, CUT_OFF, period), INTEGRALS["outer"]
        goal, place, speed = (along(yaw, one[0], one[1]) for one in (reference.position, measured.position, measured.velocity))
        asked_x, x = pid(p[0:4], memory.x, goal[0], place[0], most, smooth, period)
        asked_y, y = pid(p[4:8], memory.y, goal[1], place[1], most, smooth, period)
        asked_z, z = pid(p[8:12], memory.z, reference.position[2], measured.position[2], most, smooth, period)
        asked_x, asked_y = clip_symmetric(asked_x, OVERHEAD * p.x_speed), clip_symmetric(asked_y, OVERHEAD * p.y_speed)
        asked_z = clip_symmetric(asked_z, OVERHEAD * maximum(p.z_speed, SLOWEST))
        ahead, vx = pid(v[0:4], memory.vx, asked_x, speed[0], most, smooth, period)
        left, vy = pid(v[4:8], memory.vy, asked_y, speed[1], most, smooth, period)
        climb, vz = pid(v[8:12], memory.vz, asked_z, measured.velocity[2], most, smooth, period)
        tilt = vector(clip_symmetric(-left, p.roll), clip_symmetric(-ahead, p.pitch))
        thrust = clip(maximum(clip_symmetric(climb, MOST_CLIMB) * PER_RAW + p.hover, p.least), 0.0, COUNTS)
        return memory._replace(x=x, y=y, z=z, vx=vx, vy=vy, vz=vz, tilt=tilt, thrust=thrust)

    def law(
        self, memory: CrazyfliePidMemory, measured: Measured, reference: Reference, gains: CrazyfliePidGains,
        t: Number, period: Number,
    ) -> tuple[RotorThrusts, CrazyfliePidMemory]:  # fmt: skip
        """The attitude loops give body rates, the rate loops counts."""
        a, r, m = gains.attitude, gains.rates, memory
        roll, pitch, yaw = angles(measured.attitude)
        p, q, turn = DEGREES * measured.rates
        heading = DEGREES * atan2(sin(reference.yaw), cos(reference.yaw))
        smooth = low_pass(a.filtered, a.cut, period)
        asked_p, m_roll = pid(a[0:4], m.roll, m.tilt[0], roll, INTEGRALS["roll"], smooth, period)
        asked_q, m_pitch = pid(a[4:8], m.pitch, m.tilt[1], pitch, INTEGRALS["roll"], smooth, period)
        asked_r, m_yaw = pid(a[8:12], m.yaw, heading, yaw, INTEGRALS["yaw"], smooth, period, turns=True)
        smooth = low_pass(r.filtered, r.roll_cut, period)
        u_roll, roll_rate = pid(r[0:4], m.roll_rate, asked_p, p, INTEGRALS["roll_rate"], smooth, period)
        smooth = low_pass(r.filtered, r.pitch_cut, period)
        u_pitch, pitch_rate = pid(r[4:8], m.pitch_rate, asked_q, -q, INTEGRALS["roll_rate"], smooth, period)
        smooth = low_pass(r.filtered, r.yaw_cut, period)
        u_yaw, yaw_rate = pid(r[8:12], m.yaw_rate, asked_r, turn, INTEGRALS["yaw_rate"], smooth, period)
        turning = (clip_symmetric(u_roll, MOST_TURN), clip_symmetric(u_pitch, MOST_TURN), clip_symmetric(u_yaw, MOST_TURN))
        thrusts = crazyflie_thrusts((m.thrust, *turning), self.rotors, self.mirrored, gains.full_thrust)
        command = RotorThrusts(thrusts, vector(reference.yaw, -m.tilt[1] / DEGREES, m.tilt[0] / DEGREES))
        return command, m._replace(
            roll=m_roll, pitch=m_pitch, yaw=m_yaw, roll_rate=roll_rate, pitch_rate=pitch_rate, yaw_rate=yaw_rate
        )


def clip_symmetric(value: Number, most: Number) -> Number:
    return clip(value, -most, most)

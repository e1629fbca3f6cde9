"""PX4's loops for multirotors (v1.15), one function each: position, attitude, rates, and the filters of its gyro.

Written from PX4's documentation and behaviour, which `tests/test_control_px4.py` compares with the autopilot itself. In this
package's axes; thrust and torques are shares of what the rotors have, as in PX4.
"""

import math
from typing import NamedTuple

from quadstep.control.filters import LowPass, smoothed
from quadstep.interfaces.plant import Reference
from quadstep.numbers import Matrix, Number, Vector, atan2, clip, cos, either, maximum, minimum, sin, sqrt, vector, where
from quadstep.numbers.rotations import conjugate, cross, multiply, normalised, quaternion_of, unrotate

GRAVITY = 9.80665
"""PX4's own [m/s^2]."""

STEEPEST = 89.0
"""Largest tilt limit [deg]."""


# Position


class PositionGains(NamedTuple):
    """By their parameters' names: MPC_XY_P and MPC_Z_P, and so on. Vectors are (horizontal, horizontal, vertical).

    up, down: largest climb and descent [m/s]. tilt [deg]. hover: output that carries the vehicle. margin: of horizontal
    thrust. decoupled: MPC_ACC_DECOUPLE.
    """

    p: Vector
    vel_p: Vector
    vel_i: Vector
    vel_d: Vector
    speed: Number
    up: Number
    down: Number
    tilt: Number
    least: Number
    most: Number
    hover: Number
    margin: Number
    decoupled: Number


class MotionNow(NamedTuple):
    """position [m], velocity [m/s], acceleration [m/s^2]: measured, the last one filtered."""

    position: Vector
    velocity: Vector
    acceleration: Vector


def planar(v: Vector) -> tuple[Number, Number, Number]:
    """The horizontal parts, and the sum of their squares."""
    return v[0], v[1], v[0] * v[0] + v[1] * v[1]


def shortened(square: Number, most: Number) -> Number:
    """The factor that brings a vector of this squared length to at most `most`."""
    over = square > most * most
    return where(over, most / sqrt(where(over, square, 1.0)), 1.0)


def within_speed(first: Vector, second: Vector, most: Number) -> tuple[Number, Number]:
    """The horizontal sum of two velocities, at most `most` [m/s]; the second gives way to the first."""
    (x, y, square), (u, v, other) = planar(first), planar(second)
    total = (x + u) * (x + u) + (y + v) * (y + v)
    short = shortened(square, most)
    along = 1.0 / sqrt(where(other > 0.0, other, 1.0))
    u1, v1 = along * u, along * v
    part = u1 * x + v1 * y
    room = most * most - square
    reach = where(room > 0.0, -part + sqrt(part * part + where(room > 0.0, room, 0.0)), 0.0)
    inside = total <= most * most
    return where(inside, x + u, short * x + reach * u1), where(inside, y + v, short * y + reach * v1)


def position_loop(
    g: PositionGains, integral: Vector, now: MotionNow, wanted: Reference, period: Number
) -> tuple[Vector, Vector]:
    """The thrust wanted, along the world's axes, and the new integral of the velocity loop [m/s^2].

    A path's velocity and acceleration are fed forward, as of a trajectory setpoint. Vertical thrust goes before horizontal,
    but for the margin. Anti-windup: tracking in the plane (Rundqwist 1990), clamping vertically.
    """
    correction = g.p * (wanted.position - now.position)
    vx, vy = within_speed(correction, wanted.velocity, g.speed)
    climb = clip(correction[2] + wanted.velocity[2], -g.down, g.up)
    integral = vector(integral[0], integral[1], clip(integral[2], -GRAVITY, GRAVITY))
    error = vector(vx, vy, climb) - now.velocity
    asked = wanted.acceleration + (g.vel_p * error + integral - g.vel_d * now.acceleration)
    thrust = thrust_of(g, asked)
    low, high = thrust[2] <= g.least, thrust[2] >= g.most
    rise = where(low, maximum(error[2], 0.0), error[2])
    rise = where(high, minimum(rise, 0.0), rise)
    tx, ty, square = planar(thrust)
    whole = g.most * g.most
    up = minimum(thrust[2], sqrt(whole - minimum(square, g.margin * g.margin)))
    short = shortened(square, sqrt(maximum(whole - up * up, 0.0)))
    tx, ty = short * tx, short * ty
    per = GRAVITY / g.hover
    made_x, made_y = per * tx, per * ty
    ax, ay, asked_square = planar(asked)
    missed = asked_square > made_x * made_x + made_y * made_y
    back = 2.0 / g.vel_p[0]
    ex = error[0] - back * where(missed, ax - made_x, 0.0)
    ey = error[1] - back * where(missed, ay - made_y, 0.0)
    return vector(tx, ty, up), integral + g.vel_i * vector(ex, ey, rise) * period


def thrust_of(g: PositionGains, acceleration: Vector) -> Vector:
    """The thrust for an acceleration [m/s^2]: its direction within the tilt limit, its vertical part that of the hover's."""
    ax, ay, az = acceleration
    lifted = normalised(vector(ax, ay, GRAVITY + where(g.decoupled > 0.5, 0.0, az)))
    most = math.pi / 180.0 * minimum(g.tilt, STEEPEST)
    c, s = cos(most), sin(most)
    x, y, square = planar(lifted)
    over = lifted[2] < c
    side = where(over, s / sqrt(where(over, maximum(square, 1e-12), 1.0)), 1.0)
    up = maximum(lifted[2], c)
    collective = maximum((az * (g.hover / GRAVITY) + g.hover) / up, g.least)
    return collective * vector(side * x, side * y, up)


def attitude_of(thrust: Vector, yaw: Number) -> Vector:
    """The attitude whose third axis is along a thrust and whose first lies above the heading [rad]."""
    up = normalised(thrust)
    ahead = normalised(cross(vector(-sin(yaw), cos(yaw), 0.0), up))
    return quaternion_of(Matrix([ahead, cross(up, ahead), up]).T)


# Attitude


def attitude_loop(p: Vector, weight: Number, most: Vector, wanted: Vector, attitude: Vector, turn: Number) -> Vector:
    """Body rates wanted [rad/s] (Brescianini, Hehn, D'Andrea 2013): tilt by the shortest turn, yaw by a part of its error.

    p: MC_ROLL_P, MC_PITCH_P, MC_YAW_P. weight: of yaw. most: largest rates [rad/s]. turn: of the wanted heading [rad/s].
    """
    up, goal = third_axis(attitude), third_axis(wanted)
    about, cosine = cross(up, goal), up @ goal
    apart = 1.0 + cosine
    opposite = apart < 1e-9
    tilt = normalised(Vector((where(opposite, 1.0, apart), *about)))
    reduced = multiply(tilt, attitude)
    reduced = either(opposite, wanted, reduced)
    heading = multiply(conjugate(reduced), wanted)
    sign = where(heading[0] < 0.0, -1.0, 1.0)
    angle = weight * atan2(sign * heading[3], sign * heading[0])
    goal_attitude = multiply(reduced, vector(cos(angle), 0.0, 0.0, sin(angle)))
    w, x, y, z = multiply(conjugate(attitude), goal_attitude)
    twice = where(w < 0.0, -2.0, 2.0)
    some = weight > 1e-4
    gains = vector(p[0], p[1], where(some, p[2] / where(some, weight, 1.0), p[2]))
    rates = gains * (twice * vector(x, y, z)) + turn * unrotate(attitude, vector(0.0, 0.0, 1.0))
    return Vector(clip(rate, -limit, limit) for rate, limit in zip(rates, most, strict=True))


def third_axis(q: Vector) -> Vector:
    """Of the body, in the world."""
    w, x, y, z = q
    return vector(2.0 * (w * y + x * z), 2.0 * (y * z - w * x), w * w - x * x - y * y + z * z)


# Gyro


class NotchFilter(NamedTuple):
    """A filter that stops a band. on: above 0.5, or it does nothing."""

    on: Number
    b0: Number
    b1: Number
    a2: Number


def notch(centre: Number, band: Number, period: Number) -> NotchFilter:
    """centre, band: of what it stops [Hz]; nothing if either is 0."""
    on = where(centre > 0.0, where(band > 0.0, where(2.0 * centre * period < 1.0, 1.0, 0.0), 0.0), 0.0)
    some = on > 0.5
    angle, about = math.pi * period * where(some, band, 20.0), 2.0 * math.pi * period * where(some, centre, 100.0)
    alpha = sin(angle) / cos(angle)
    over = 1.0 / (alpha + 1.0)
    return NotchFilter(on, over, -2.0 * cos(about) * over, (1.0 - alpha) * over)


def notched(by: NotchFilter, past: Vector, value: Number) -> tuple[Number, Vector]:
    """One sample, and the new past: the last two values in and out."""
    x1, x2, y1, y2 = past
    out = by.b0 * value + by.b1 * x1 + by.b0 * x2 - by.b1 * y1 - by.a2 * y2
    return where(by.on > 0.5, out, value), vector(value, x1, out, y1)


class GyroFilters(NamedTuple):
    """IMU_GYRO_NF0_*, IMU_GYRO_NF1_*, IMU_GYRO_CUTOFF; share: of a new sample in the filtered derivative, 1 for all."""

    first: NotchFilter
    second: NotchFilter
    smooth: LowPass
    share: Number


class GyroMemory(NamedTuple):
    """Of one axis. first, second: last two values into and out of a notch [rad/s]. delays: states of the low-pass.

    rate [rad/s], acceleration [rad/s^2]: filtered.
    """

    first: Vector
    second: Vector
    delays: Vector
    rate: Number
    acceleration: Number


STILL = GyroMemory(vector(0.0, 0.0, 0.0, 0.0), vector(0.0, 0.0, 0.0, 0.0), vector(0.0, 0.0), 0.0, 0.0)


def of_gyro(by: GyroFilters, memory: GyroMemory, value: Number, begun: Number, period: Number) -> GyroMemory:
    """One sample [rad/s]. begun: 0 for the first one, before which the axis is taken to have turned as fast for ever."""
    some = begun > 0.5

    def since(past: Vector, value: Number) -> Vector:
        return Vector(where(some, one, value) for one in past)

    one, first = notched(by.first, since(memory.first, value), value)
    two, second = notched(by.second, since(memory.second, one), one)
    rate, delays = smoothed(by.smooth, since(memory.delays, two / (1.0 + by.smooth.a1 + by.smooth.a2)), two)
    slope = where(some, (rate - memory.rate) * (1.0 / period), 0.0)
    acceleration = memory.acceleration + by.share * (slope - memory.acceleration)
    return GyroMemory(first, second, delays, rate, acceleration)


# Rates


class Px4RateGains(NamedTuple):
    """About the three axes: MC_ROLLRATE_P times MC_ROLLRATE_K, and so on. most: of the integral, MC_RR_INT_LIM."""

    p: Vector
    i: Vector
    d: Vector
    ff: Vector
    most: Vector


def rate_loop(
    g: Px4RateGains, integral: Vector, wanted: Vector, rates: Vector, acceleration: Vector, missed: Vector, period: Number
) -> tuple[Vector, Vector]:
    """Torques, and the new integral. missed: 1 or -1 where the rotors could not make a torque of that sign: there the
    integral only shrinks. It grows slowly where the error is large, and not at all beyond 400 deg/s.
    """
    error = wanted - rates
    torque = g.p * error + integral - g.d * acceleration + g.ff * wanted
    grown = []
    for e, i, gain, most, side in zip(error, integral, g.i, g.most, missed, strict=True):
        kept = where(side > 0.5, minimum(e, 0.0), where(side < -0.5, maximum(e, 0.0), e))
        part = kept / math.radians(400.0)
        slower = maximum(0.0, 1.0 - part * part)
        grown.append(clip(i + slower * gain * kept * period, -most, most))
    return torque, Vector(grown)

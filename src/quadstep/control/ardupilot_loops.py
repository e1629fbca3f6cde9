"""ArduPilot's loops for multirotors (Copter 4.6), one function each: PID, square-root controller, input shaping, attitude.

Facts of its documentation, parameters and behaviour, which `tests/test_control_ardupilot.py` compares with the autopilot
itself. In this package's axes and SI units; thrust and torques are shares of what the rotors have.
"""

import math
from typing import NamedTuple

from quadstep.control.filters import share_of
from quadstep.numbers import Number, Vector, absolute, atan2, clip, cos, either, maximum, minimum, sin, sqrt, vector, where
from quadstep.numbers.rotations import conjugate, from_rotation_vector, multiply, normalised, rotation_vector, unrotate

UP = vector(0.0, 0.0, 1.0)

LARGE = math.radians(30.0)
"""Error of the thrust's direction beyond which yaw gives way [rad]."""

MOST_HEADING = math.radians(45.0)
"""Of the heading's error [rad]."""

TILTING, TURNING = (math.radians(40.0), math.radians(720.0)), (math.radians(10.0), math.radians(120.0))
"""Limits of the acceleration that the attitude loop counts with, of roll and pitch, and of yaw [rad/s^2]."""


# PID


class PidGains(NamedTuple):
    """By the endings of their parameters' names: P, I, D, FF, D_FF, IMAX, PDMX, FLTT, FLTE, FLTD."""

    p: Number
    i: Number
    d: Number
    ff: Number
    d_ff: Number
    most: Number
    most_pd: Number
    target_cut: Number
    error_cut: Number
    slope_cut: Number


class PidMemory(NamedTuple):
    """Filtered target, error and its slope; the integral."""

    target: Number
    error: Number
    slope: Number
    integral: Number


class IntegratorLimits(NamedTuple):
    """1 where the integral may not fall, and where it may not rise; else 0."""

    low: Number
    high: Number


def shrinking(limited: Number, memory: PidMemory) -> IntegratorLimits:
    """At a limit the integral may only shrink."""
    return IntegratorLimits(where(memory.integral > 0.0, 0.0, limited), where(memory.integral < 0.0, 0.0, limited))


def pid(
    g: PidGains, memory: PidMemory, target: Number, measured: Number, held: IntegratorLimits, begun: Number, period: Number
) -> tuple[Number, Number, PidMemory]:
    """Output, feed-forward, and the new memory. begun: 0 for the first sample, at which the filters start."""
    some = begun > 0.5
    aim = where(some, memory.target + share_of(g.target_cut, period) * (target - memory.target), target)
    raw = aim - measured
    error = where(some, memory.error + share_of(g.error_cut, period) * (raw - memory.error), raw)
    change = (error - memory.error) / period
    slope = where(some, memory.slope + share_of(g.slope_cut, period) * (change - memory.slope), 0.0)
    kept = where(error < 0.0, held.low, where(error > 0.0, held.high, 0.0))
    grown = where(kept > 0.5, memory.integral, clip(memory.integral + (error * g.i) * period, -g.most, g.most))
    integral = where(g.i > 0.0, grown, 0.0)
    proportional, derivative = error * g.p, slope * g.d
    size = absolute(proportional + derivative)
    over = where(g.most_pd > 0.0, where(size > g.most_pd, 1.0, 0.0), 0.0)
    scale = where(over > 0.5, g.most_pd / where(over > 0.5, size, 1.0), 1.0)
    ahead = aim * g.ff + where(some, (aim - memory.target) / period, 0.0) * g.d_ff
    output = proportional * scale + derivative * scale + integral
    return output, ahead, PidMemory(aim, error, slope, integral)


# Square-root controller


def root(error: Number, p: Number, most: Number) -> Number:
    """A rate that brings an error to zero: p times it near zero, further away as fast as a deceleration `most` can stop.

    most: 0 for no limit.
    """
    some = most > 0.0
    near = where(some, most, 1.0) / (p * p)
    size = absolute(error)
    beyond = where(some, where(size > near, 1.0, 0.0), 0.0)
    far = sqrt(2.0 * most * maximum(size - 0.5 * near, 0.0))
    return where(beyond > 0.5, where(error < 0.0, -far, far), error * p)


def root_within(error: Number, p: Number, most: Number, period: Number) -> Number:
    """The same, and no more than the error itself in a sample."""
    reach = absolute(error) / period
    return clip(root(error, p, most), -reach, reach)


def unrooted(rate: Number, p: Number, most: Number) -> Number:
    """The error of which `root` makes this rate, not negative."""
    return where(rate < most / p, rate / p, 0.5 * most / (p * p) + rate * rate / (2.0 * most))


def rooted(error: Vector, p: Number, most: Number) -> Vector:
    """`root` of a vector's length, along it."""
    square = error @ error
    near = most / (p * p)
    beyond = square > near * near
    size = sqrt(where(beyond, square, 1.0))
    return where(beyond, sqrt(2.0 * most * maximum(size - 0.5 * near, 0.0)) / size, p) * error


def shortened(v: Vector, most: Number) -> Vector:
    square = v @ v
    over = square > most * most
    return where(over, most / sqrt(where(over, square, 1.0)), 1.0) * v


def shaped(
    error: Number, constant: Number, most: Number, rate: Number, wanted: Number, fastest: Number, period: Number
) -> Number:
    """The next rate of a target [rad/s] that is `error` [rad] away: it speeds up and slows down by at most `most` [rad/s^2].

    constant: ATC_INPUT_TC [s]. rate: its last one; wanted: to be fed forward. fastest: 0 for no limit.
    """
    aim = wanted + root_within(error, 1.0 / maximum(constant, 0.01), most, period)
    aim = where(fastest > 0.0, clip(aim, -fastest, fastest), aim)
    step = most * period
    return where(most > 0.0, clip(aim, rate - step, rate + step), aim)


# Attitude


def within_rates(rates: Vector, most: Vector) -> Vector:
    """Roll and pitch within an ellipse, yaw within its limit [rad/s]; 0 for no limit."""
    x, y, z = rates
    roll, pitch = where(most[0] > 0.0, most[0], 1.0), where(most[1] > 0.0, most[1], 1.0)
    both = where(most[0] > 0.0, where(most[1] > 0.0, 1.0, 0.0), 0.0)
    square = (x / roll) * (x / roll) + (y / pitch) * (y / pitch)
    out = where(both > 0.5, where(square > 1.0, 1.0, 0.0), 0.0)
    scale = where(out > 0.5, 1.0 / sqrt(where(out > 0.5, square, 1.0)), 1.0)
    alone_x = where(both > 0.5, scale * x, where(most[0] > 0.0, clip(x, -most[0], most[0]), x))
    alone_y = where(both > 0.5, scale * y, where(most[1] > 0.0, clip(y, -most[1], most[1]), y))
    return vector(alone_x, alone_y, where(most[2] > 0.0, clip(z, -most[2], most[2]), z))


class AttitudeError(NamedTuple):
    """How far an attitude is from a wanted one. error: about its axes, tilt by the shortest turn, then heading [rad]. tilt:
    that turn. angle: of it [rad].
    """

    error: Vector
    tilt: Vector
    angle: Number


def attitude_error(attitude: Vector, wanted: Vector) -> AttitudeError:
    turn = multiply(conjugate(attitude), wanted)
    x, y, z = unrotate(conjugate(turn), UP)
    opposite = 1.0 + z < 1e-9
    tilt = normalised(Vector((where(opposite, 0.0, 1.0 + z), where(opposite, 1.0, -y), x, 0.0)))
    across = rotation_vector(tilt)
    along = rotation_vector(multiply(conjugate(tilt), turn))
    return AttitudeError(vector(across[0], across[1], along[2]), tilt, atan2(sqrt(x * x + y * y + 1e-30), z))


class AttitudeGains(NamedTuple):
    """p: ATC_ANG_*_P [1/s]. acceleration: ATC_ACCEL_*_MAX [rad/s^2]. most: ATC_RATE_*_MAX [rad/s]. slew: ATC_SLEW_YAW [rad/s].
    constant: ATC_INPUT_TC [s]. yaw_p: ATC_RAT_YAW_P. ahead: ATC_RATE_FF_ENAB.
    """

    p: Vector
    acceleration: Vector
    most: Vector
    slew: Number
    constant: Number
    yaw_p: Number
    ahead: Number


class Target(NamedTuple):
    """attitude: that is followed. rates [rad/s]: of it, in its own axes."""

    attitude: Vector
    rates: Vector


def turned(target: Target, period: Number) -> Target:
    """The target a sample later."""
    return target._replace(attitude=normalised(multiply(target.attitude, from_rotation_vector(period * target.rates))))


def shaped_target(g: AttitudeGains, target: Target, wanted: Vector, turn: Number, period: Number) -> Target:
    """The target, on its way to a wanted attitude; the wanted one itself without ATC_RATE_FF_ENAB.

    turn: of its heading [rad/s].
    """
    away = attitude_error(target.attitude, wanted).error
    none, still = 0.0 * turn, Vector(0.0 * one for one in target.rates)
    yaw_most = where(g.most[2] > 0.0, minimum(g.most[2], g.slew), g.slew)
    turning = where(yaw_most > 0.0, clip(turn, -yaw_most, yaw_most), turn)
    parts = zip(away, g.acceleration, target.rates, (none, none, turning), (none, none, yaw_most), strict=True)
    rates = Vector(shaped(e, g.constant, a, rate, ahead, most, period) for e, a, rate, ahead, most in parts)
    rates = within_rates(rates, vector(g.most[0], g.most[1], yaw_most))
    on = g.ahead > 0.5
    return Target(either(on, target.attitude, wanted), either(on, rates, still))


def attitude_loop(g: AttitudeGains, target: Target, attitude: Vector, rates: Vector, period: Number) -> tuple[Vector, Target]:
    """Body rates wanted [rad/s], and the target, its heading within reach. rates: measured."""
    off = attitude_error(attitude, target.attitude)
    yaw = clip(0.5 * g.acceleration[2], *TURNING)
    some = g.yaw_p > 0.0
    most = where(some, minimum(unrooted(1.0 / where(some, g.yaw_p, 1.0), g.p[2], yaw), MOST_HEADING), 10.0)
    heading = clip(off.error[2], -most, most)
    far = absolute(off.error[2]) > most
    near = multiply(multiply(attitude, off.tilt), vector(cos(0.5 * heading), 0.0, 0.0, sin(0.5 * heading)))
    kept = either(far, near, target.attitude)
    limits = [
        where(a > 0.0, clip(0.5 * a, *reach), 0.0)
        for a, reach in zip(g.acceleration, (TILTING, TILTING, TURNING), strict=True)
    ]
    errors = (off.error[0], off.error[1], heading)
    asked = Vector(root_within(e, p, a, period) for e, p, a in zip(errors, g.p, limits, strict=True))
    x, y, z = within_rates(asked, g.most)
    ahead = unrotate(multiply(conjugate(kept), attitude), target.rates)
    part = clip(2.0 - off.angle / LARGE, 0.0, 1.0)
    return vector(
        x + part * ahead[0], y + part * ahead[1], where(part > 0.0, (1.0 - part) * rates[2] + part * (z + ahead[2]), rates[2])
    ), Target(kept, target.rates)

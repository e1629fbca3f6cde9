"""Filters of laws, sampled: autopilots' low-passes, chains, biquads and notches, and an observer of the unexplained.

PX4, ArduPilot and Crazyflie filter gyros and D parts of first order or by Butterworth's of second (`LowPass`); Betaflight
(release 4.5) by chains of first-order low-passes, and by biquads.

Command filters: the desired attitude and its rate, which Eq. 28 needs and the paper does not define.

The exact rate of theta_d and phi_d contains eta_dd and so the torque itself; a critically damped second-order filter
gives both without that loop. On the rotation group it needs no Euler angles: its stiffness acts along the shortest turn to the
command. There what the rotors cannot make slows it down (pseudo-control hedging, Johnson and Calise 2003), so that it asks for
no more than the vehicle can follow, and errors from saturation are not learnt.
"""

import math
from typing import NamedTuple

from quadstep.control.vectoring import DesiredAttitude
from quadstep.numbers import Number, Vector, absolute, cos, exp, maximum, sin, vector, where
from quadstep.numbers.rotations import (
    conjugate,
    cross,
    from_rotation_vector,
    multiply,
    normalised,
    quaternion_of,
    rotation_matrix,
    rotation_vector,
)


def share_of(cut: Number, period: Number) -> Number:
    """Of a new sample in a low-pass filter of first order. cut: its cut-off [Hz]; 0: no filter."""
    some = cut > 0.0
    return where(some, period / (period + 1.0 / (2.0 * math.pi * where(some, cut, 1.0))), 1.0)


class LowPass(NamedTuple):
    """Coefficients by the bilinear transform, right at the cut-off. on: above 0.5, or it does nothing."""

    on: Number
    b: Number
    a1: Number
    a2: Number


def low_pass(on: Number, cut: Number, period: Number) -> LowPass:
    """cut: its cut-off [Hz]."""
    angle = math.pi * cut * period
    tangent = sin(angle) / cos(angle)
    square = tangent * tangent
    over = 1.0 + math.sqrt(2.0) * tangent + square
    return LowPass(on, square / over, 2.0 * (square - 1.0) / over, (1.0 - math.sqrt(2.0) * tangent + square) / over)


def smoothed(by: LowPass, delays: Vector, value: Number) -> tuple[Number, Vector]:
    """One sample, and the new delays, shape (2,): direct form II."""
    first, second = delays
    new = value - first * by.a1 - second * by.a2
    smooth = new * by.b + first * (2.0 * by.b) + second * by.b
    return where(by.on > 0.5, smooth, value), vector(new, first)


SHARPER = {2: 1.553773974, 3: 1.961459177}
"""What the cut-off of a chain of two or three is multiplied with, so that it damps by 3 dB there: 1 / sqrt(2^(1/n) - 1)."""

BUTTERWORTH = 1.0 / math.sqrt(2.0)
"""Quality of the low-pass biquad."""


def share_in_a_sample(hertz: Number, period: Number) -> Number:
    """Of the way to its input that a first-order low-pass goes in a sample."""
    omega = 2.0 * math.pi * hertz * period
    return omega / (omega + 1.0)


def twice(memory: Vector, value: Number, rate: Number, period: Number) -> tuple[Number, Vector]:
    """Two first-order low-passes in a chain. rate: cut-off of each [rad/s]. memory: of both, shape (2,)."""
    omega = rate * period
    k = omega / (omega + 1.0)
    first = memory[0] + k * (value - memory[0])
    second = memory[1] + k * (first - memory[1])
    return second, vector(first, second)


def biquad(b: Vector, a: Vector, memory: Vector, value: Number) -> tuple[Number, Number, Number]:
    """A sample of b0 y + b1 .. over 1 + a1 .., in the transposed direct form II: what comes out, and both memories."""
    result = b[0] * value + memory[0]
    return result, b[1] * value - a[0] * result + memory[1], b[2] * value - a[1] * result


def low_passed(kind: Number, hertz: Number, memory: Vector, value: Number, period: Number) -> tuple[Number, Vector]:
    """kind: PT1, BIQUAD, PT2 or PT3, as a number from 0. hertz: 0 for none; so is a biquad beyond half the rate. memory:
    shape (3,).
    """
    of_two, of_three = share_in_a_sample(hertz * SHARPER[2], period), share_in_a_sample(hertz * SHARPER[3], period)
    k = where(kind > 2.5, of_three, where(kind > 1.5, of_two, share_in_a_sample(hertz, period)))
    first = memory[0] + k * (value - memory[0])
    second = memory[1] + k * (first - memory[1])
    third = memory[2] + k * (second - memory[2])
    omega = 2.0 * math.pi * hertz * period
    sine, cosine = sin(omega), cos(omega)
    alpha = sine / (2.0 * BUTTERWORTH)
    over, whole = 1.0 + alpha, 1.0 - cosine
    b, a = vector(whole * 0.5 / over, whole / over, whole * 0.5 / over), vector(-2.0 * cosine / over, (1.0 - alpha) / over)
    result, x1, x2 = biquad(b, a, memory, value)
    square = absolute(kind - 1.0) < 0.5
    chained = where(kind > 2.5, third, where(kind > 1.5, second, first))
    made = where(square, where(hertz * period < 0.5, result, value), chained)
    kept = vector(where(square, x1, first), where(square, x2, second), third)
    return where(hertz > 0.0, made, value), kept


def notch(hertz: Number, lower: Number, memory: Vector, value: Number, period: Number) -> tuple[Number, Vector]:
    """hertz: its centre, 0 for none; lower: where it damps by 3 dB, below the centre. memory: shape (2,)."""
    centre, edge = where(hertz > 0.0, hertz, 1.0), where(lower > 0.0, lower, 0.5)
    quality = centre * edge / maximum(centre * centre - edge * edge, 1e-6)
    omega = 2.0 * math.pi * centre * period
    cosine, alpha = cos(omega), sin(omega) / (2.0 * quality)
    over = 1.0 + alpha
    b, a = vector(1.0 / over, -2.0 * cosine / over, 1.0 / over), vector(-2.0 * cosine / over, (1.0 - alpha) / over)
    result, x1, x2 = biquad(b, a, memory, value)
    made = where(hertz > 0.0, where(lower > 0.0, where(centre * period < 0.5, result, value), value), value)
    return made, vector(x1, x2)


def cut_off(static: Number, least: Number, most: Number, expo: Number, throttle: Number) -> Number:
    """A low-pass's cut-off [Hz], which goes with throttle, 0 to 1, unless its least is 0."""
    curve = throttle * (1.0 - throttle) * (expo / 10.0) + throttle
    straight = maximum(throttle * (1.0 - (throttle * throttle) / 3.0) * 1.5 * most, least)
    return where(least > 0.0, where(expo > 0.0, (most - least) * curve + least, straight), static)


def observed(
    value: Vector, unexplained: Vector, measured: Vector, rate: Vector, bandwidth: Number, period: Number
) -> tuple[Vector, Vector]:
    """What moves a vehicle beside what the model explains, by an observer of second order (Gao 2003): estimates of a value and
    of what its rate has beside `rate`, one period [s] later, both poles at -bandwidth [1/s].
    """
    error = measured - value
    value = value + period * (rate + unexplained + (2.0 * bandwidth) * error)
    return value, unexplained + (period * (bandwidth * bandwidth)) * error


class Filtered(NamedTuple):
    """value: filtered command [rad]. rate: its rate [rad/s]."""

    value: Vector
    rate: Vector


def command_filter(filtered: Filtered, command: Vector, frequency: Number, period: Number) -> Filtered:
    """The filter `period` [s] later, with `command` [rad] held: x_dd = w^2 (command - x) - 2 w x_dot, w = frequency [rad/s].

    This is the exact solution, so it is stable at any sample rate.
    """
    decay = exp(-(frequency * period))
    offset = filtered.value - command
    slope = filtered.rate + frequency * offset
    return Filtered(
        value=command + decay * (offset + period * slope), rate=decay * (filtered.rate - (frequency * period) * slope)
    )


class FilteredAttitude(NamedTuple):
    """attitude: unit quaternion, filter's axes to world. rates [rad/s], acceleration [rad/s^2]: in the filter's own axes.

    The acceleration is the one asked for, without the hedge: feeding forward what the rotors cannot make would ask for it
    again.
    """

    attitude: Vector
    rates: Vector
    acceleration: Vector


def attitude_filter(
    filtered: FilteredAttitude, command: Vector, lead: Vector, frequency: Vector, hedge: Vector, period: Number
) -> FilteredAttitude:
    """The filter `period` [s] later. command: unit quaternion, which turns at `lead` in its own axes [rad/s]. frequency:
    natural, about each axis [rad/s]. hedge: as in `led_filter`.
    """
    away = rotation_vector(multiply(conjugate(filtered.attitude), command))
    return led_filter(filtered, frequency * (frequency * away + 2.0 * (lead - filtered.rates)), hedge, period)


class LedAttitude(NamedTuple):
    """A wanted attitude with its motion: attitude, a unit quaternion; rates [rad/s], turning [rad/s^2]: in its own axes."""

    attitude: Vector
    rates: Vector
    turning: Vector


def led_by(wanted: DesiredAttitude) -> LedAttitude:
    return LedAttitude(quaternion_of(wanted.rotation), wanted.rates, wanted.acceleration)


def led_acceleration(filtered: FilteredAttitude, led: LedAttitude, stiffness: Vector, damping: Vector) -> Vector:
    """Of a filter that is told how its command moves, in the filter's own axes [rad/s^2]: it follows without lag."""
    ahead = multiply(conjugate(filtered.attitude), led.attitude)  # from the wanted axes into the filter's
    across = rotation_matrix(ahead)
    rates = across @ led.rates
    feed_forward = across @ led.turning - cross(filtered.rates, rates)
    return feed_forward + stiffness * rotation_vector(ahead) + damping * (rates - filtered.rates)


def led_filter(filtered: FilteredAttitude, acceleration: Vector, hedge: Vector, period: Number) -> FilteredAttitude:
    """The filter `period` [s] later. acceleration: of `led_acceleration`; critically damped with stiffness w^2, damping 2 w.

    hedge: angular acceleration that the rotors could not make [rad/s^2], taken off. Stable for w period below about 0.8.
    """
    rates = filtered.rates + period * (acceleration - hedge)
    attitude = multiply(filtered.attitude, from_rotation_vector(period * rates))
    return FilteredAttitude(normalised(attitude), rates, acceleration)

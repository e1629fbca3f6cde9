"""Command filters: the desired attitude and its rate, which Eq. 28 needs and the paper does not define.

The exact rate of theta_d and phi_d contains eta_dd and so the torque itself; a critically damped second-order filter
gives both without that loop. On the rotation group it needs no Euler angles: its stiffness acts along the shortest turn to the
command. There what the rotors cannot make slows it down (pseudo-control hedging, Johnson and Calise 2003), so that it asks for
no more than the vehicle can follow, and errors from saturation are not learnt.
"""

from typing import NamedTuple

from quadstep.numbers import Number, Vector, exp
from quadstep.numbers.rotations import (
    conjugate,
    cross,
    from_rotation_vector,
    multiply,
    normalised,
    rotation_matrix,
    rotation_vector,
)


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
        value=command + decay * (offset + period * slope),
        rate=decay * (filtered.rate - (frequency * period) * slope),
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
    filtered: FilteredAttitude, command: Vector, frequency: Vector, hedge: Vector, period: Number
) -> FilteredAttitude:
    """The filter `period` [s] later. command: unit quaternion. frequency: natural, about each axis [rad/s].

    hedge: angular acceleration that the rotors could not make [rad/s^2], taken off. Stable for frequency * period below
    about 0.8.
    """
    away = rotation_vector(multiply(conjugate(filtered.attitude), command))
    acceleration = frequency * (frequency * away - 2.0 * filtered.rates)
    rates = filtered.rates + period * (acceleration - hedge)
    attitude = multiply(filtered.attitude, from_rotation_vector(period * rates))
    return FilteredAttitude(normalised(attitude), rates, acceleration)


class LedAttitude(NamedTuple):
    """A wanted attitude with its motion: attitude, a unit quaternion; rates [rad/s], turning [rad/s^2]: in its own axes."""

    attitude: Vector
    rates: Vector
    turning: Vector


def led_acceleration(filtered: FilteredAttitude, led: LedAttitude, stiffness: Vector, damping: Vector) -> Vector:
    """Of a filter that is told how its command moves, in the filter's own axes [rad/s^2]: it follows without lag."""
    ahead = multiply(conjugate(filtered.attitude), led.attitude)  # from the wanted axes into the filter's
    across = rotation_matrix(ahead)
    rates = across @ led.rates
    feed_forward = across @ led.turning - cross(filtered.rates, rates)
    return feed_forward + stiffness * rotation_vector(ahead) + damping * (rates - filtered.rates)


def led_filter(filtered: FilteredAttitude, acceleration: Vector, hedge: Vector, period: Number) -> FilteredAttitude:
    """The filter `period` [s] later. acceleration: of `led_acceleration`. hedge: as in `attitude_filter`."""
    rates = filtered.rates + period * (acceleration - hedge)
    attitude = multiply(filtered.attitude, from_rotation_vector(period * rates))
    return FilteredAttitude(normalised(attitude), rates, acceleration)

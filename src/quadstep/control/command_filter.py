"""Command filter: the desired attitude and its rate, which Eq. 28 needs and the paper does not define.

The exact rate of theta_d and phi_d contains eta_dd and so the torque itself; a critically damped second-order filter
gives both without that loop.
"""

from typing import NamedTuple

from quadstep.numbers import Number, Vector, exp


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

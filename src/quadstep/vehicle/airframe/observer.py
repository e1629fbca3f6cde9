"""What a prediction of a real vehicle takes from measurements; part of a fitted vehicle's file."""

from typing import NamedTuple

from quadstep.numbers import Number, Vector


class Observer(NamedTuple):
    """How a prediction uses measurements, and how it continues without them. Pairs: one value for x and y, one for z.

    rates, attitude, velocity: shares of the difference from the measured one taken over at a sample. torque, force: what the
    unexplained angular acceleration [rad/s^2] and specific force [m/s^2] gain a sample from the difference in rates [rad/s]
    and in velocity [m/s]; torque_fade, force_fade [1/s]: their decay rates. trend: the same for an angular acceleration that
    persists.

    The commands of a vehicle under control respond to disturbances that a prediction cannot see, so their torque is trusted in
    only in part (authority) and later (delay [s]), the rates decay to zero (leak [1/s]) and the vehicle to the tilt of an
    acceleration (spring [1/s^2]): path [1/s^2] times the distance to the logged setpoint, at most reach [m/s^2], less drift
    [1/s] times the velocity; its tangent is at most steepest. With 1, 0, 0, 0 a prediction is the vehicle alone.
    """

    rates: Vector
    attitude: Vector
    velocity: Vector
    torque: Vector
    torque_fade: Vector
    trend: Vector
    force: Vector
    force_fade: Vector
    authority: Vector
    leak: Vector
    spring: Number
    path: Number
    drift: Number
    delay: Number
    reach: Number
    steepest: Number

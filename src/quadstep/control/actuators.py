"""What a law believes that the rotors make now: what they were asked for, after a lag of first order, or by their speeds."""

from typing import NamedTuple

from quadstep.control.vectoring import ZERO, BelievedBody, angular_of, followed
from quadstep.control.wanted_attitude import up_axis
from quadstep.interfaces.controller import Measured
from quadstep.numbers import Number, Vector, vector, where
from quadstep.numbers.rotations import rotation_matrix


class AchievedCommand(NamedTuple):
    """thrust [N], torque [N m] about the body's axes."""

    thrust: Number
    torque: Vector


def at_rest(body: BelievedBody) -> AchievedCommand:
    return AchievedCommand(body.mass * body.gravity, ZERO)


def commanded(measured: Measured) -> AchievedCommand:
    """What the rotors are asked for at present, once it is made."""
    return AchievedCommand(measured.thrust, measured.torque)


def lagged(made: AchievedCommand, measured: Measured, lag: Number, t: Number, period: Number) -> AchievedCommand:
    """At time t [s], a period [s] later, by what the rotors have been asked for since; lag: their time constant [s].

    At t = 0 nothing has been asked for yet.
    """
    share = where(t > 0.0, followed(1.0 / lag, period), 0.0)
    thrust = made.thrust + share * (measured.thrust - made.thrust)
    return AchievedCommand(thrust, made.torque + share * (measured.torque - made.torque))


def of_speeds(speeds: Vector, per_speed: Number, mixing: tuple[Vector, ...]) -> AchievedCommand:
    """Of rotors that turn at `speeds` [rad/s]. per_speed, mixing: as in `Model`."""
    thrust, *torque = (row @ (per_speed * (speeds * speeds)) for row in mixing)
    return AchievedCommand(thrust, Vector(torque))


def accelerations(made: AchievedCommand, measured: Measured, body: BelievedBody) -> tuple[Vector, Vector]:
    """What the rotors and gravity alone would do: acceleration [m/s^2], world; angular acceleration [rad/s^2], body axes."""
    axis = up_axis(rotation_matrix(measured.attitude))
    upward = (made.thrust / body.mass) * axis - vector(0.0, 0.0, body.gravity)
    return upward, angular_of(made.torque, measured, body)

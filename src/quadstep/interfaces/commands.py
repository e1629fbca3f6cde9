"""Commands of real vehicles other than thrust and torque: a controller class sets `commands = BodyRates`."""

from typing import NamedTuple

from quadstep.interfaces.controller import NOT_SAID
from quadstep.numbers import Number, Vector


class BodyRates(NamedTuple):
    """Collective thrust [N] and body rates [rad/s], which the rate loop of `control/rate_loop.py` turns into torques.

    desired_attitude: as in `Command`.
    """

    thrust: Number
    rates: Vector
    desired_attitude: Vector = NOT_SAID


class RotorThrusts(NamedTuple):
    """The thrust of every rotor [N], in the order of the vehicle's rotors; each is clipped to its limits."""

    thrusts: Vector
    desired_attitude: Vector = NOT_SAID


class RotorSpeeds(NamedTuple):
    """The commanded speed of every rotor [rad/s], in the order of the vehicle's rotors; each is clipped to its limits."""

    speeds: Vector
    desired_attitude: Vector = NOT_SAID

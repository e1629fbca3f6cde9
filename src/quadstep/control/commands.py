"""What else a controller of a real vehicle may command than thrust and torque: its class says `commands = BodyRates`."""

from typing import NamedTuple

from quadstep.control.controller import NOT_SAID
from quadstep.numbers import Number, Vector


class BodyRates(NamedTuple):
    """Collective thrust [N] and body rates [rad/s], which the rate loop of `control/rate_loop.py` makes torques of.

    desired_attitude: as in `Command`.
    """

    thrust: Number
    rates: Vector
    desired_attitude: Vector = NOT_SAID


class RotorThrusts(NamedTuple):
    """The thrust of every rotor [N], in the order of the vehicle's rotors; each is held within its limits."""

    thrusts: Vector
    desired_attitude: Vector = NOT_SAID


class RotorSpeeds(NamedTuple):
    """How fast every rotor should turn [rad/s], in the order of the vehicle's rotors; each is held within its limits."""

    speeds: Vector
    desired_attitude: Vector = NOT_SAID

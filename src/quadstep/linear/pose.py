"""Position and heading of the vehicle: what a loop has to hold, whether or not its law looks at it."""

from typing import NamedTuple, cast

from quadstep.engines.loop import Loop, Numbers
from quadstep.linear.states import Array, Flown, states, with_states
from quadstep.numbers import Number, Structure
from quadstep.numbers.dual import Seeds, slopes_of
from quadstep.numbers.rotations import yaw_pitch_roll
from quadstep.vehicle.airframe.motion import Motion
from quadstep.vehicle.paper import State
from quadstep.vehicle.plants.lagrange import Lagrange
from quadstep.vehicle.plants.multirotor import Multirotor


class Pose(NamedTuple):
    """names: the plant's axes, then its yaw if it has one. rows: their slopes [m or rad] over the states of a period."""

    names: tuple[str, ...]
    rows: Array


def pose(loop: Loop, p: Numbers, flown: Flown, time: float) -> Pose:
    """The pose of the vehicle at this time [s]."""
    values, _ = states(flown)
    plant, state = loop.plant, with_states(flown, Seeds(len(values), 1.0).seeded(values, 0)).cycle.state
    outputs: list[Number] = [-one for one in plant.error(state, loop.wanted(time, p))]
    names = tuple(plant.axes)
    if isinstance(plant, Multirotor | Lagrange):
        outputs.append(heading(plant, state))
        names += ("yaw",)
    return Pose(names, slopes_of(outputs, len(values))[1])


def heading(plant: Multirotor | Lagrange, state: Structure) -> float:
    """Yaw [rad]."""
    attitude = cast("Motion | State", state).attitude
    angles = yaw_pitch_roll(attitude) if isinstance(plant, Multirotor) else attitude
    return angles[0]

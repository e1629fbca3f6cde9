"""Where a loop is opened: between the controller's command and the actuators, one channel at a time."""

from collections.abc import Sequence
from typing import NamedTuple, cast

from quadstep.engines.loop import Loop
from quadstep.interfaces.commands import RotorSpeeds, RotorThrusts
from quadstep.interfaces.controller import Command
from quadstep.numbers import Number, Structure, Vector, flatten, leaf_names, rebuild
from quadstep.vehicle.airframe.allocation import thrusts_of
from quadstep.vehicle.plants.multirotor import AirframeParameters, Multirotor

BODY = "thrust", "roll", "pitch", "yaw"
PAPER = "thrust", "yaw", "pitch", "roll"
"""Channels of a `Command`: the paper's generalised torques are in the order of its angles (psi, theta, phi)."""


class Channel(NamedTuple):
    """One channel. name: as in tables. unit: of its size."""

    name: str
    unit: str


def channels(loop: Loop, command: Structure) -> tuple[Channel, ...]:
    """The channels of a controller that has just given this command, in its own order."""
    if isinstance(command, Command | RotorThrusts | RotorSpeeds):
        names = BODY if isinstance(loop.plant, Multirotor) else PAPER
        return tuple(Channel(name, "N" if name == "thrust" else "N m") for name in names)
    return tuple(Channel(name, "") for name in leaf_names(command))


def commanded(loop: Loop, p: object, command: Structure) -> list[Number]:
    """The size of each channel; for a command to the rotors, the thrust and torques that it should produce."""
    if isinstance(loop.plant, Multirotor):
        command = loop.plant.asked(cast(AirframeParameters, p), cast("Command | RotorThrusts | RotorSpeeds", command))
    if isinstance(command, Command):
        return [command.thrust, *command.torque]
    return flatten(command)


def moved(p: object, command: Structure, by: Sequence[Number]) -> Structure:
    """The command with something added to each channel; the rotors share it as they share any thrust and torque."""
    if isinstance(command, Command):
        return command._replace(thrust=command.thrust + by[0], torque=command.torque + Vector(by[1:]))
    if isinstance(command, RotorThrusts | RotorSpeeds):
        allocation = cast(AirframeParameters, p).allocation
        thrusts = command.thrusts if isinstance(command, RotorThrusts) else thrusts_of(allocation, command.speeds)
        return RotorThrusts(Vector(one + row @ Vector(by) for one, row in zip(thrusts, allocation.matrix, strict=True)))
    return rebuild(command, iter([leaf + more for leaf, more in zip(flatten(command), by, strict=True)]))

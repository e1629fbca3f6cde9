"""The state of a loop from tick to tick, and its numbers: everything that can deviate; where it is opened, between command
and actuators, one channel at a time; the pose, which it has to hold.

Slopes of a loop where it bends: those that hold on one side of all its edges.

Where two pieces of a law meet, as at a limit or at the tip of a norm, there is no single slope but a set of them: the
generalised Jacobian (Clarke, "Optimization and Nonsmooth Analysis", 1983, section 2.6), spanned by the slopes of smooth points
nearby. Each is had by following a small deviation of the state from tick to tick: at every edge it decides the side.
"""

import re
from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from quadstep.engines.loop import Cycle, Loop, Numbers
from quadstep.interfaces.controller import Command, RotorSpeeds, RotorThrusts
from quadstep.interfaces.plant import Plant
from quadstep.io.errors import UserError
from quadstep.numbers import Number, Structure, Vector, flatten, leaf_names, rebuild
from quadstep.numbers.dual import NotDifferentiableError, Seeds, slopes_of
from quadstep.numbers.rotations import yaw_pitch_roll
from quadstep.report.units import listed
from quadstep.vehicle.allocation import thrusts_of
from quadstep.vehicle.lagrange import Lagrange
from quadstep.vehicle.multirotor import AirframeParameters, Multirotor
from quadstep.vehicle.paper import State
from quadstep.vehicle.rigid_body import Motion

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
        command = loop.plant.logged_command(cast(AirframeParameters, p), cast("Command | RotorThrusts | RotorSpeeds", command))
    if isinstance(command, Command):
        return [command.thrust, *command.torque]
    return flatten(command)


def with_addition(p: object, command: Structure, by: Sequence[Number]) -> Structure:
    """The command with something added to each channel; the rotors share it as they share any thrust and torque."""
    if isinstance(command, Command):
        return command._replace(thrust=command.thrust + by[0], torque=command.torque + Vector(by[1:]))
    if isinstance(command, RotorThrusts | RotorSpeeds):
        allocation = cast(AirframeParameters, p).allocation
        thrusts = command.thrusts if isinstance(command, RotorThrusts) else thrusts_of(allocation, command.speeds)
        return RotorThrusts(Vector(one + row @ Vector(by) for one, row in zip(thrusts, allocation.matrix, strict=True)))
    return rebuild(command, iter([leaf + more for leaf, more in zip(flatten(command), by, strict=True)]))


Array = NDArray[np.float64]


class LoopState(NamedTuple):
    """The state from tick to tick. asked: the command that the actuators hold, by channel; line: commands under way."""

    cycle: Cycle
    line: tuple[Vector, ...]
    asked: Vector


def states(flown: LoopState) -> list[float]:
    """Everything that can deviate: the whole state, except for the command as logged."""
    return flatten(flown._replace(cycle=flown.cycle._replace(command=())))


def names_of(flown: LoopState) -> list[str]:
    return [name.removeprefix("cycle.") for name in leaf_names(flown._replace(cycle=flown.cycle._replace(command=())))]


def with_states(flown: LoopState, values: Sequence[Number]) -> LoopState:
    bare = rebuild(flown._replace(cycle=flown.cycle._replace(command=())), iter(values))
    return bare._replace(cycle=bare.cycle._replace(command=flown.cycle.command))


def short(names: Sequence[str]) -> list[str]:
    """Names without the part of the cycle that they belong to, unless another is the same or nothing else is left."""
    found: dict[str, None] = {}
    whole = set(names)
    for name in names:
        brief = name.partition(".")[2]
        found[name if brief in found or brief in whole or not brief[:1].isalpha() else brief] = None
    return list(found)


TURNS = "yaw", "pitch", "roll"
WHOLE = {
    "weights_1": "weights of the first net", "weights_2": "weights of the second net", "integral_1": "the integral of r1",
    "integral_2": "the integral of r2", "speeds": "rotor speeds", "filtered.value": "filtered attitude command",
    "filtered.rate": "rate of the filtered attitude command", "asked_thrust": "commanded thrust",
    "asked_torque": "commanded torque",
}  # fmt: skip
"""What is said without its entries: they are many, or not of the same axes in every law."""

INDICES = re.compile(r"(\.\d+)+$")
"""Of an entry of a vector or a matrix."""


def quantity(name: str) -> str:
    """What a state is an entry of, in words: weights of the first net, roll rate integral for `roll_rate.integral.0`."""
    kind = INDICES.sub("", re.sub(r"^queued\.\d+\.", "delayed ", name))
    return WHOLE.get(kind) or kind.replace(".", " ").replace("_", " ")


def in_words(states: Iterable[str], names: Sequence[str], pose: Sequence[str], most: int = 4) -> str:
    """States as people say them, those of one kind together: velocity along x and y for `velocity.0` and `velocity.1`, and
    those that only their law knows as quantities. names: of all states; pose: of what the loop has to hold; most: kinds.
    """
    along = [name for name in pose if name != "yaw"]
    kinds: dict[str, tuple[str, Sequence[str]]] = {
        "position": ("position along", along), "velocity": ("velocity along", along),
        "integral": ("the law's integral along", along), "outer.integral": ("the outer loop's integral along", along),
        "integral_1": ("the integral of r1 along", along), "rate_integral": ("the rate loop's integral about", "xyz"),
        "speeds": ("speed of rotor", "12345678"),
    }  # fmt: skip
    if "attitude.3" in names:  # a quaternion; its first entry is that of no axis
        kinds |= {"attitude": ("attitude about", ("", *"xyz")), "rates": ("body rate about", "xyz")}
    elif "yaw" in pose:
        kinds |= {"attitude": ("", TURNS), "rates": ("rate of", TURNS)}
    words = {f"{kind}.{i}": (word, axis) for kind, (word, axes) in kinds.items() for i, axis in enumerate(axes) if axis}
    found: dict[str, list[str]] = {}
    for name in states:
        word, axis = words.get(name) or (quantity(name), "")
        found.setdefault(word, []).extend([axis] if axis else [])
    every = [f"{word} {listed(sorted(axes))}".strip() for word, axes in found.items()]
    *first, last = [*every[:most], *([f"{len(every) - most} more"] if len(every) > most else [])]
    return f"{', '.join(first)}{',' * any(' and ' in one for one in every)} and {last}" if first else last


def pose_names(plant: Plant) -> tuple[str, ...]:
    """What a loop has to hold: the plant's axes, then its yaw if it has one."""
    return (*plant.axes, "yaw") if isinstance(plant, Multirotor | Lagrange) else tuple(plant.axes)


class Pose(NamedTuple):
    """names: see `pose_names`. rows: their slopes [m or rad] over the states of a period."""

    names: tuple[str, ...]
    rows: Array


def pose(loop: Loop, p: Numbers, flown: LoopState, time: float) -> Pose:
    """The pose of the vehicle at this time [s]."""
    values = states(flown)
    plant, state = loop.plant, with_states(flown, Seeds(len(values), 1.0).seeded(values, 0)).cycle.state
    outputs: list[Number] = [-one for one in plant.error(state, loop.reference(time, p))]
    if isinstance(plant, Multirotor | Lagrange):
        outputs.append(heading(plant, state))
    return Pose(pose_names(plant), slopes_of(outputs, len(values))[1])


def heading(plant: Multirotor | Lagrange, state: Structure) -> float:
    """Yaw [rad]."""
    attitude = cast("Motion | State", state).attitude
    angles = yaw_pitch_roll(attitude) if isinstance(plant, Multirotor) else attitude
    return angles[0]


SAME = 1e-9
"""Slopes on both sides of an edge, and states of two ticks, count as equal if they differ by less than this relative to 1."""


class NotLinearError(UserError):
    """The loop cannot be linearised about this motion; says what fails, and where."""


class NoSlopeError(NotLinearError):
    """There is no slope just here: a jump, or a slope without bound."""


class EdgeSide:
    """The side on which a loop is differentiated.

    names: of what is differentiated. way: a small deviation of the state; None where the loop bends nowhere, which is then
    found out unless rough. bends: the places where it does after all, with the slopes of one side. broken: why there is no
    slope, if there is none: then it counts as zero.
    """

    def __init__(self, names: Sequence[str], way: Array | None = None, rough: bool = False) -> None:
        self.names, self.way, self.rough = names, way, rough
        self.bends: dict[str, None] = {}
        self.broken = ""

    def moved(self, slopes: Array) -> None:
        """The deviation after something with these slopes."""
        if self.way is not None:
            way = slopes @ self.way
            self.way = way / max(float(np.abs(way).max()), np.finfo(float).tiny)

    def slopes(self, time: float, count: int, made: Callable[[Seeds], Sequence[Number]]) -> Array:
        """Slopes of a function at a time [s] by `count` seeds, of which the states are the first. Raises NotLinearError."""
        if self.way is not None:
            return self.checked(made, Seeds(count, 1.0, np.append(self.way, np.zeros(count - len(self.way)))))[1]
        seeds = Seeds(count, 1.0)
        values, found = self.checked(made, seeds)
        if seeds.edges and not self.rough:
            others, other = self.checked(made, Seeds(count, -1.0))
            if relative_difference(values, others) > SAME:
                self.broken = f"the loop jumps at t = {time:g} s, on the boundary at {' or '.join(seeds.edges)}"
            if relative_difference(found, other) > SAME:
                self.bends |= seeds.edges
        return found

    def checked(self, made: Callable[[Seeds], Sequence[Number]], seeds: Seeds) -> tuple[Array, Array]:
        """Values and slopes. Raises NotLinearError for a law that has no equations."""
        try:
            values, found, lost = slopes_of(made(seeds), seeds.count)
        except NotDifferentiableError as error:
            raise NotLinearError(str(error)) from None
        for name, place in zip(self.names, lost, strict=True):
            if place:
                self.broken = self.broken or f"{name} has no derivative: {place}"
        return values, found


def relative_difference(a: Array, b: Array) -> float:
    """The difference between numbers, relative to 1."""
    return float((np.abs(a - b) / (1.0 + np.abs(a))).max(initial=0.0))

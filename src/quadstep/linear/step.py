"""How the linear loop follows a step of its path: a metre along each axis, a radian of yaw."""

import math
from typing import NamedTuple

import numpy as np

from quadstep.linear.equilibrium import Rest
from quadstep.linear.poles import poles
from quadstep.linear.sampled import WANTED, Array, states
from quadstep.numbers import Number, Structure, Vector, rebuild
from quadstep.numbers.dual import Seeds, slopes_of
from quadstep.numbers.rotations import yaw_pitch_roll
from quadstep.plants.lagrange import Lagrange
from quadstep.plants.multirotor import Multirotor

SHORTEST, LONGEST = 2.0, 40.0
"""Shortest and longest time shown of a step [s]."""

CONSTANTS = 6.0
"""The time shown, in multiples of the slowest time constant."""

SETTLED = 0.02
"""Share of the step within which the response has settled."""


class Step(NamedTuple):
    """One step. t [s]; value, name, unit: of the stepped quantity."""

    name: str
    unit: str
    t: Array
    value: Array

    @property
    def overshoot(self) -> float:
        """Overshoot as a share of the step."""
        return max(0.0, float(self.value.max()) - 1.0)

    @property
    def settling(self) -> float:
        """Time after which it stays within 2 % of the step [s]; infinite if it does not within the time shown."""
        outside = np.flatnonzero(np.abs(self.value - 1.0) > SETTLED)
        last = int(outside[-1]) + 1 if len(outside) else 0
        return math.inf if last >= len(self.t) else float(self.t[last])


def steps(rest: Rest) -> list[Step]:
    """The step responses of each axis of the plant, and of its yaw if it has one."""
    loop, plant = rest.period, rest.loops.loop.plant
    names = [*(f"{axis}" for axis in plant.axes), *(["yaw"] if isinstance(plant, Multirotor | Lagrange) else [])]
    rows = seen(rest)[:, loop.places]
    inputs = [WANTED.index(name) for name in names]
    slowest = poles(loop)[0].time_constant
    duration = min(max(SHORTEST, CONSTANTS * slowest), LONGEST)
    x = np.zeros((len(loop.places), len(inputs)))
    made = [rows @ x]
    for _ in range(math.ceil(duration / loop.period.length)):
        for tick in loop.period.ticks:
            x = tick.step @ (tick.tasks @ x + tick.path[:, inputs])
        made.append(rows @ x)
    t = np.array([k * loop.period.length for k in range(len(made))])
    values = np.array(made)
    return [
        Step(name, "rad" if name == "yaw" else "m", t, np.ascontiguousarray(values[:, i, i])) for i, name in enumerate(names)
    ]


def seen(rest: Rest) -> Array:
    """Slopes of position along the plant's axes, and of yaw, over all states."""
    values, _ = states(rest.flown)
    seeds = Seeds(len(values), 1.0)
    flown = rebuild(rest.flown._replace(cycle=rest.flown.cycle._replace(command=())), iter(seeds.seeded(values, 0)))
    plant, state = rest.loops.loop.plant, flown.cycle.state
    wanted = rest.loops.loop.wanted(0.0, rest.loops.p)
    outputs: list[Number] = [-one for one in plant.error(state, wanted)]
    if isinstance(plant, Multirotor | Lagrange):
        outputs.append(heading(plant, state))
    return slopes_of(outputs, len(values))[1]


def heading(plant: Structure, state: Structure) -> float:
    """Yaw [rad]."""
    angles: Vector = yaw_pitch_roll(state.attitude) if isinstance(plant, Multirotor) else state.attitude
    return angles[0]

"""How the linear loop follows a step of its path: a metre along each axis, a radian of yaw."""

import math
from typing import NamedTuple

import numpy as np

from quadstep.linear.modes import Pole
from quadstep.linear.reduced import Reduced
from quadstep.linear.sampled import WANTED
from quadstep.linear.states import Array

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


def steps(loop: Reduced, poles: list[Pole]) -> list[Step]:
    """The step responses of each part of the pose."""
    names, rows = loop.period.pose
    inputs = [WANTED.index(name) for name in names]
    slowest = poles[0].time_constant
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

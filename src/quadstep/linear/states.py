"""The state of a loop from tick to tick, and its numbers: everything that can deviate."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadstep.engines.loop import Cycle
from quadstep.numbers import Number, Vector, flatten, leaf_names, rebuild

Array = NDArray[np.float64]


class Flown(NamedTuple):
    """The state from tick to tick. asked: the command that the actuators hold, by channel; line: commands under way."""

    cycle: Cycle
    line: tuple[Vector, ...]
    asked: Vector


def states(flown: Flown) -> tuple[list[float], list[str]]:
    """Everything that can deviate: the whole state, except for the command as logged."""
    kept = flown._replace(cycle=flown.cycle._replace(command=()))
    return flatten(kept), [name.removeprefix("cycle.") for name in leaf_names(kept)]


def with_states(flown: Flown, values: Sequence[Number]) -> Flown:
    """The same with these in their place."""
    bare = rebuild(flown._replace(cycle=flown.cycle._replace(command=())), iter(values))
    return bare._replace(cycle=bare.cycle._replace(command=flown.cycle.command))


def short(names: Sequence[str]) -> list[str]:
    """Names without the part of the cycle that they belong to, unless an earlier name is the same or nothing else is left."""
    found: dict[str, None] = {}
    for name in names:
        brief = name.partition(".")[2]
        found[name if brief in found or not brief[:1].isalpha() else brief] = None
    return list(found)

"""Slopes of a loop near its rest: a law that bends there, though not at rest, has other slopes than those at rest.

The slopes at all states within a small distance are the set of Goldstein ("Optimization of Lipschitz continuous functions",
Mathematical Programming 13, 1977), of which Clarke's generalised Jacobian is the limit. Central differences over that distance
tell whether the set has more than one element: of a smooth loop they are its slopes, but for the square of the distance.
"""

from copy import copy
from typing import cast

import numpy as np
from numpy.typing import NDArray

from quadstep.linear.modes import Reduced, reduced, scales
from quadstep.linear.sampled import Loops, approached
from quadstep.linear.side import SAME, apart
from quadstep.linear.states import Array, LoopState, states, with_states
from quadstep.numbers import Number

NEAR = 1e-4
"""Distance: 0.1 mm, 0.1 mm/s, 0.1 mrad/s and a quaternion's entry by as much; relative to 1 and to a state's size."""

STRAIGHT = 1e-4
"""Largest difference from the slopes at rest, in balanced coordinates and relative to the largest slope, of a loop that does
not bend near its rest.
"""

MOVED, SEED = 4, 5
"""States near rest at which a loop that bends is linearised, and what they are drawn from."""

LATER = 4
"""Instants, evenly up to the end of the flight, at which a loop is compared with what it was before."""


def bending(loops: Loops, flown: LoopState, first: int, period: Reduced) -> tuple[str, ...]:
    """The states whose slopes over a period are others near the rest `flown` at tick `first`."""
    missed = missing(period.map, differences(loops, flown, first, period.places, NEAR)).max(axis=1)
    return tuple(period.period.names[place] for place in np.flatnonzero(~(missed <= STRAIGHT)))


def missing(exact: Array, other: Array) -> Array:
    """How far maps are apart in balanced coordinates, relative to the largest slope if that is above 1."""
    units = scales(exact)
    ratio = units / units[:, None]
    found: Array = np.abs((other - exact) * ratio) / max(1.0, float(np.abs(exact * ratio).max()))
    return found


def differences(loops: Loops, flown: LoopState, first: int, places: NDArray[np.intp], size: float) -> Array:
    """The map of a period between these states, by central differences of flights, all of them flown as one of arrays."""
    values = np.array(states(flown))
    count = len(places)
    steps = size * (1.0 + np.abs(values[places]))
    columns = np.repeat(values[:, None], 2 * count, axis=1)
    columns[places, np.arange(count)] += steps
    columns[places, count + np.arange(count)] -= steps
    after = states(loops.fly(with_states(flown, list(columns)), first, first + loops.count))
    ends = np.array([np.broadcast_to(after[place], 2 * count) for place in places])
    found: Array = (ends[:, :count] - ends[:, count:]) / (2.0 * steps)
    return found


def nearby(loops: Loops, flown: LoopState, first: int, places: NDArray[np.intp]) -> list[Reduced]:
    """The loop linearised at states near its rest, without those where slopes do not exist. What is at these places is moved
    before the last step of a period, so that what has to have length one does.
    """
    last = first + loops.count - 1
    before = loops.tasks(loops.fly(flown, first, last), last, loops.p)[0]
    values = np.array(states(before))
    found = []
    for share in np.random.default_rng(SEED).uniform(-NEAR, NEAR, (MOVED, len(places))):
        moved = values.copy()
        moved[places] += share * (1.0 + np.abs(values[places]))
        found.append(approached(loops, loops.step(with_states(before, moved.tolist()), last), last + 1))
    return [reduced(one) for one in found if not one.broken]


def keeping(left: Array, length: float) -> NDArray[np.bool_]:
    """Which states keep time: by their changes over so long [s]."""
    found: NDArray[np.bool_] = np.abs(left - length) < SAME
    return found


def changed(loops: Loops, flown: LoopState, first: int, ticks: list[int]) -> tuple[int, LoopState] | None:
    """The first of some later ticks at which a loop at rest at tick `first` is another one, and the loop at rest there; None
    where it is the same. Periods from all ticks on, from states near rest, are flown as one of arrays.
    """
    values, whole = np.array(states(flown))[:, None], loops.count
    clocks = keeping(np.array(states(loops.fly(flown, first, first + whole)))[:, None] - values, whole * loops.h)
    near = values + np.random.default_rng(SEED).uniform(-NEAR, NEAR, (len(values), MOVED)) * (1.0 + np.abs(values))
    ahead = copy(loops)
    later = np.repeat([0.0, *(tick - first for tick in ticks)], MOVED)
    ahead.ahead = cast("Number", later)
    passed = clocks * later * loops.h
    begun = with_states(flown, list(np.tile(near, 1 + len(ticks)) + passed))
    ends = [np.broadcast_to(end, passed.shape[1]) for end in states(ahead.fly(begun, first, first + whole))]
    same, *others = np.hsplit(np.array(ends) - passed, 1 + len(ticks))
    for tick, other in zip(ticks, others, strict=True):
        if not apart(same, other) <= SAME:
            return tick, with_states(flown, (values + clocks * (tick - first) * loops.h)[:, 0].tolist())
    return None


def later_ticks(loops: Loops, first: int) -> list[int]:
    """`LATER` instants, whole periods after tick `first`; fewer in a flight of fewer periods."""
    periods = (loops.plan.ticks.last - first) // loops.count
    counts = dict.fromkeys(i * periods // LATER for i in range(1, LATER + 1))
    return [first + count * loops.count for count in counts if count > 0]

"""Slopes of a loop near its rest: a law that bends there, though not at rest, has other slopes than those at rest.

The slopes at all states within a small distance are the set of Goldstein ("Optimization of Lipschitz continuous functions",
Mathematical Programming 13, 1977), of which Clarke's generalised Jacobian is the limit. Central differences over that distance
tell whether the set has more than one element: of a smooth loop they are its slopes, but for the square of the distance.
"""

from copy import copy
from typing import cast

import numpy as np
from numpy.typing import NDArray

from quadstep.linear.modes import ReducedPeriod, reduced, scales
from quadstep.linear.sampled import Loops, approached
from quadstep.linear.states import SAME, Array, LoopState, relative_difference, states, with_states
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


def nonlinear_states(loops: Loops, flown: LoopState, first: int, period: ReducedPeriod) -> tuple[str, ...]:
    """The states whose slopes over a period are others near the rest `flown` at tick `first`."""
    moved = movable(period)
    near = differences(loops, flown, first, period.places[moved], NEAR)
    missed = map_difference(period.map[np.ix_(moved, moved)], near).max(axis=1)
    return tuple(period.period.names[moved[place]] for place in np.flatnonzero(~(missed <= STRAIGHT)))


def movable(period: ReducedPeriod) -> NDArray[np.intp]:
    """Which states are moved: all but an estimator's covariance, which would be none then, with negative variances."""
    return np.flatnonzero(["covariance" not in period.period.names[place] for place in range(len(period.places))])


def map_difference(exact: Array, other: Array) -> Array:
    """How far maps are apart in balanced coordinates, relative to the largest slope if that is above 1."""
    units = scales(exact)
    ratio = units / units[:, None]
    return np.abs((other - exact) * ratio) / max(1.0, float(np.abs(exact * ratio).max()))


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
    return (ends[:, :count] - ends[:, count:]) / (2.0 * steps)


def nearby(loops: Loops, flown: LoopState, first: int, period: ReducedPeriod) -> list[ReducedPeriod]:
    """The loop linearised at states near its rest, without those where slopes do not exist. States are moved before the last
    step of a period, so that what has to have length one does.
    """
    places = period.places[movable(period)]
    last = first + loops.count - 1
    before = loops.tasks(loops.fly(flown, first, last), last, loops.p)[0]
    values = np.array(states(before))
    found = []
    for share in np.random.default_rng(SEED).uniform(-NEAR, NEAR, (MOVED, len(places))):
        moved = values.copy()
        moved[places] += share * (1.0 + np.abs(values[places]))
        found.append(approached(loops, loops.step(with_states(before, moved.tolist()), last), last + 1))
    return [reduced(one) for one in found if not one.broken]


ALONE = 1e-6
"""Largest part of a change that a state which goes on by itself leaves unexplained; differences leave 1e-7 of small ones."""

GOES_ON = 1e-3
"""The same long afterwards, which what was left unexplained has reached by then."""


def passed(loops: Loops, flown: LoopState, first: int, periods: Array) -> tuple[Array, Array]:
    """By how much each state has gone on by itself after so many periods, shape (states, counts of periods), and by which
    factor its change grows in one, shape (states, 1).

    What acts on nothing near rest may do so: clocks, counters, and all that goes from period to period as m' = a m + b. Two
    periods tell a and b of each state, a third whether it is so.
    """
    ends = [flown]
    for n in range(3):
        ends.append(loops.fly(ends[-1], first + n * loops.count, first + (n + 1) * loops.count))
    values, *_ = found = [np.array(states(end))[:, None] for end in ends]
    one, two, three = np.diff(found, axis=0)
    goes = np.abs(one) > SAME * (1.0 + np.abs(values))
    a = np.where(goes, two / np.where(goes, one, 1.0), 1.0)
    steady = np.abs(a - 1.0) < SAME
    with np.errstate(over="ignore", invalid="ignore"):
        changes = np.where(steady, periods, (a**periods - 1.0) / np.where(steady, 1.0, a - 1.0))
        gone: Array = np.where(goes & (np.abs(three - a * two) < ALONE * np.abs(one)), one * changes, 0.0)
    return gone, a


def stops(a: Array, gone: Array, begun: Array, ends: Array) -> NDArray[np.bool_]:
    """Which states that went on by themselves do not at all instants, as one that is held at a limit or counts round does not;
    the first instant is now. Shapes as of `passed`, those of a period's start and end (states, instants, `MOVED`).
    """
    change = ends - begun
    expected = change[:, :1] + (a[..., None] - 1.0) * (begun - begun[:, :1])
    wrong = np.abs(change - expected) > GOES_ON * np.abs(expected) + SAME * (1.0 + np.abs(begun))
    return np.logical_and(gone.any(axis=1), wrong.any(axis=(1, 2)))


def changed(loops: Loops, flown: LoopState, first: int, ticks: list[int]) -> tuple[int, LoopState] | None:
    """The first of some later ticks at which a loop at rest at tick `first` is another one, and the loop at rest there; None
    where it is the same. Periods from all ticks on, from states near rest, are flown as one of arrays.
    """
    values, whole = np.array(states(flown))[:, None], loops.count
    near = values + np.random.default_rng(SEED).uniform(-NEAR, NEAR, (len(values), MOVED)) * (1.0 + np.abs(values))
    ahead = copy(loops)
    later = np.repeat([0.0, *(tick - first for tick in ticks)], MOVED)
    ahead.ahead = cast("Number", later)
    gone, a = passed(loops, flown, first, later / whole)

    def flights() -> tuple[Array, Array]:
        begun = np.tile(near, 1 + len(ticks)) + gone
        after = states(ahead.fly(with_states(flown, list(begun)), first, first + whole))
        return begun, np.array([np.broadcast_to(end, gone.shape[1]) for end in after])

    begun, ends = flights()
    if (over := stops(a, gone, *(one.reshape(len(values), -1, MOVED) for one in (begun, ends)))).any():
        gone[over] = 0.0
        _, ends = flights()
    same, *others = np.hsplit(np.where(gone.any(axis=1, keepdims=True), 0.0, ends), 1 + len(ticks))
    for place, (tick, other) in enumerate(zip(ticks, others, strict=True), 1):
        if not relative_difference(same, other) <= SAME:
            return tick, with_states(flown, (values[:, 0] + gone[:, place * MOVED]).tolist())
    return None


def later_ticks(loops: Loops, first: int) -> list[int]:
    """`LATER` instants, whole periods after tick `first`; fewer in a flight of fewer periods."""
    periods = (loops.plan.ticks.last - first) // loops.count
    counts = dict.fromkeys(i * periods // LATER for i in range(1, LATER + 1))
    return [first + count * loops.count for count in counts if count > 0]

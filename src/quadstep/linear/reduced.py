"""A period without the states that play no part in the loop: constants, and states on which neither a command nor the pose
ever depends.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadstep.linear.sampled import Period, Tick
from quadstep.linear.states import Array


class Reduced(NamedTuple):
    """A period of fewer states, and their indices among all states. commands: rows of the channels' commands among them."""

    period: Period
    places: NDArray[np.intp]
    commands: NDArray[np.intp]

    @property
    def map(self) -> Array:
        return self.period.map


def reduced(period: Period) -> Reduced:
    """The channels that act, and the states on which they and the pose depend, even through others, without constants."""
    count = len(period.names)
    commands = np.arange(count - len(period.channels), count)
    influence = np.zeros((count, count), dtype=bool)
    constant = np.ones(count, dtype=bool)
    unit = np.eye(count)
    for tick in period.ticks:
        influence |= (tick.step != 0.0) | (tick.tasks != 0.0)
        constant &= (tick.tasks == unit).all(axis=1) & (tick.step == unit).all(axis=1)
    seen = (period.pose.rows != 0.0).any(axis=0)
    seen[commands] = True
    while True:
        more = seen | influence[seen].any(axis=0)
        if (more == seen).all():
            break
        seen = more
    places = np.flatnonzero(seen & ~constant)
    grid = np.ix_(places, places)
    acting = np.flatnonzero(np.any([tick.acting.any(axis=0) for tick in period.ticks], axis=0))
    shown = {id(tick): tick_of(tick, places, grid, acting) for tick in period.ticks}
    return Reduced(
        period._replace(
            ticks=tuple(shown[id(tick)] for tick in period.ticks),
            names=tuple(period.names[place] for place in places),
            channels=tuple(period.channels[place] for place in acting),
            values=period.values[places],
            after=period.after[places],
            pose=period.pose._replace(rows=period.pose.rows[:, places]),
        ),
        places,
        np.searchsorted(places, commands[acting]),
    )


def tick_of(tick: Tick, places: NDArray[np.intp], grid: tuple[NDArray[np.intp], ...], acting: NDArray[np.intp]) -> Tick:
    """A tick restricted to these states and channels."""
    return tick._replace(
        tasks=tick.tasks[grid],
        path=tick.path[places],
        step=tick.step[grid],
        acting=tick.acting[np.ix_(places, acting)],
    )

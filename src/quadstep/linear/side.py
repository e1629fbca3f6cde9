"""Slopes of a loop where it bends: those that hold on one side of all its edges.

Where two pieces of a law meet, as at a limit or at the tip of a norm, there is no single slope but a set of them: the
generalised Jacobian (Clarke, "Optimization and Nonsmooth Analysis", 1983, section 2.6), spanned by the slopes of smooth points
nearby. Each is had by following a small deviation of the state from tick to tick: at every edge it decides the side.
"""

from collections.abc import Callable, Sequence

import numpy as np

from quadstep.io.errors import UserError
from quadstep.linear.states import Array
from quadstep.numbers import Number
from quadstep.numbers.dual import NotDifferentiableError, Seeds, slopes_of

SAME = 1e-9
"""Slopes on both sides of an edge, and states of two ticks, count as equal if they differ by less than this relative to 1."""


class NotLinearError(UserError):
    """The loop cannot be linearised about this motion; says what fails, and where."""


class NoSlopeError(NotLinearError):
    """There is no slope just here: a jump, or a slope without bound."""


class EdgeSide:
    """The side on which a loop is differentiated.

    names: of what is differentiated. way: a small deviation of the state; None where the loop bends nowhere, which is then
    found out. bends: the places where it does after all, with the slopes of one side. broken: why there is no slope, if there
    is none: then it counts as zero.
    """

    def __init__(self, names: Sequence[str], way: Array | None = None) -> None:
        self.names, self.way = names, way
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
        if seeds.edges:
            others, other = self.checked(made, Seeds(count, -1.0))
            if apart(values, others) > SAME:
                self.broken = f"the loop jumps at t = {time:g} s, on the boundary at {' or '.join(seeds.edges)}"
            if apart(found, other) > SAME:
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


def apart(a: Array, b: Array) -> float:
    """The difference between numbers, relative to 1."""
    return float((np.abs(a - b) / (1.0 + np.abs(a))).max(initial=0.0))

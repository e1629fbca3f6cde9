"""What a figure shows, as numbers: panels over time, or a flight in space."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

LOG, SIGNED_LOG, STACKED = "log", "symlog", "stacked"
COMMANDED, SETPOINT, DESIRED = "commanded", "setpoint", "desired"
ASKED_FOR = (COMMANDED, SETPOINT, DESIRED)
"""Names of lines that are drawn as a band below what comes of them."""

UNJUDGED = "not judged"
"""Name of a line that is drawn in grey, below all others."""

FAINT = 0.01
"""Share of the highest stack below which none is seen."""


def seen_from(parts: ArrayLike) -> int:
    """The first sample at which a stack of these parts (parts, samples) can be seen."""
    values = np.asarray(parts)
    size = np.maximum(np.maximum(values, 0.0).sum(axis=0), np.maximum(-values, 0.0).sum(axis=0))
    return int(np.argmax(size > FAINT * size.max()))


class Panel(NamedTuple):
    """One set of axes over time: what is drawn, its unit, and the lines by legend entry.

    scale: `LOG`, `SIGNED_LOG`, `STACKED` (areas upon one another, and their sum), or nothing: linear, unless a short peak
    would flatten all the rest. reach: the largest value of panels that are shown in the same unit.
    band: low and high of an area around the line.
    """

    label: str
    unit: str
    lines: dict[str, NDArray[np.float64]]
    scale: str = ""
    reach: float = 0.0
    band: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None


class EventMark(NamedTuple):
    """When something happens in a flight [s]. what: happens to the vehicle, in the past tense, or nothing. word: for a figure,
    or nothing where it is the end of what one has. until: it lasts [s]. named: whether a figure writes the word.
    """

    time: float
    what: str
    word: str = ""
    until: float = 0.0
    named: bool = True


ROOM = 1.0
"""Margin around the desired path, in sizes of it: a flight that diverges leaves the view, and the path stays visible."""


FLAT = 0.05
"""Share of a view that a line is not broader than."""


def breadth(points: NDArray[np.float64]) -> float:
    """Of points in a plane, across the direction along which they are spread most."""
    (_, across) = np.linalg.svd(np.cov((points - points.mean(axis=0)).T))[2]
    return float(np.ptp(points @ across))


@dataclass(frozen=True)
class Track:
    """A flight in space. distance [m]: from its path, counts from `begin` [s] on; wanted, flown: points [m], (samples, 3).
    before: the same flight with other gains, perhaps shorter or longer.
    """

    distance: NDArray[np.float64]
    wanted: NDArray[np.float64]
    flown: NDArray[np.float64]
    begin: float = 0.0
    before: "Track | None" = None

    @property
    def points(self) -> NDArray[np.float64]:
        """All that is drawn of it."""
        return np.concatenate([self.wanted, self.flown, *([self.before.points] if self.before else [])])

    @cached_property
    def view(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Lower and upper corner [m] of what is drawn: a cube around both paths, as far as they are near the desired one."""
        size = max(float(np.ptp(self.wanted, axis=0).max()), 0.5)
        least, most = self.wanted.min(axis=0) - ROOM * size, self.wanted.max(axis=0) + ROOM * size
        both = np.clip(self.points, least, most)
        middle, half = 0.5 * (both.min(axis=0) + both.max(axis=0)), 0.54 * max(float(np.ptp(both, axis=0).max()), 1e-3)
        return middle - half, middle + half

    @cached_property
    def views(self) -> list[tuple[int, int]]:
        """Axes of the view from above, and of that from the side, along the longer of x and y; without those in which it is a
        dot or a straight line.
        """
        low, high = self.view
        points = np.clip(self.points, low, high)
        across = int(np.argmax(np.ptp(self.wanted[:, :2], axis=0)))
        return [pair for pair in ((0, 1), (across, 2)) if breadth(points[:, pair]) > FLAT * float(high[0] - low[0])]

    @property
    def beyond(self) -> list[str]:
        """Axes along which the end is out of view."""
        low, high = self.view
        return [axis for axis, a, end, b in zip("xyz", low, self.flown[-1], high, strict=True) if not a <= end <= b]

"""How a quantity over a flight becomes numbers: of a log at once, and of a flight sample by sample, next to each other.

What can be summed is a NamedTuple of its sums so far: `start` makes the first of them, `add` the next, `values` the numbers.
Its `of`, like the functions of all that cannot, takes a log.
"""

import math
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import NamedTuple, Protocol, Self, TypeAlias

import numpy as np
from numpy.typing import NDArray

from quadstep.numbers import Number, Vector, absolute, maximum

Numbers = NDArray[np.float64]

SETTLING_BAND = 0.005
"""Half-width of the band that an angle must stay in to count as settled [rad]."""


Reduction: TypeAlias = Callable[[Numbers, Numbers], Sequence[float | None]]
"""Of rows of shape (samples, entries), at times t [s]. One number an entry, or one of all of them."""


class Sums(Protocol):
    """A reduction that can be summed while flying. now: the quantity at a sample. known: 1 once there was a sample, else 0."""

    @classmethod
    def start(cls, now: Vector) -> Self: ...

    def add(self, now: Vector, known: Number) -> Self: ...

    def values(self, samples: Numbers) -> Sequence[Numbers]:
        """From sums that are arrays, one element a flight."""
        ...


def rmse(errors: Numbers) -> float:
    return float(np.sqrt(np.mean(np.square(errors))))


def zeros(now: Vector) -> Vector:
    return Vector([0.0] * len(now))


class RmsLength(NamedTuple):
    """Root mean square of a vector's length."""

    squares: Number

    @staticmethod
    def of(rows: Numbers, t: Numbers) -> list[float]:  # noqa: ARG004
        return [rmse(np.linalg.norm(rows, axis=1))]

    @classmethod
    def start(cls, now: Vector) -> Self:  # noqa: ARG003
        return cls(0.0)

    def add(self, now: Vector, known: Number) -> Self:
        return self._replace(squares=self.squares + now @ now)

    def values(self, samples: Numbers) -> list[Numbers]:
        return [np.sqrt(np.asarray(self.squares) / samples)]


class LargestLength(NamedTuple):
    square: Number

    @staticmethod
    def of(rows: Numbers, t: Numbers) -> list[float]:  # noqa: ARG004
        return [float(np.linalg.norm(rows, axis=1).max())]

    @classmethod
    def start(cls, now: Vector) -> Self:  # noqa: ARG003
        return cls(0.0)

    def add(self, now: Vector, known: Number) -> Self:
        return self._replace(square=maximum(now @ now, self.square))

    def values(self, samples: Numbers) -> list[Numbers]:
        return [np.sqrt(np.asarray(self.square))]


class Rms(NamedTuple):
    """Root mean square of each entry."""

    squares: Vector

    @staticmethod
    def of(rows: Numbers, t: Numbers) -> list[float]:  # noqa: ARG004
        return [rmse(entry) for entry in rows.T]

    @classmethod
    def start(cls, now: Vector) -> Self:
        return cls(zeros(now))

    def add(self, now: Vector, known: Number) -> Self:
        return self._replace(squares=self.squares + now * now)

    def values(self, samples: Numbers) -> list[Numbers]:
        return [np.sqrt(np.asarray(entry) / samples) for entry in self.squares]


class Variation(NamedTuple):
    """Sum of |changes| of each entry from sample to sample. last: at the last sample."""

    sums: Vector
    last: Vector

    @staticmethod
    def of(rows: Numbers, t: Numbers) -> list[float]:  # noqa: ARG004
        return [float(np.abs(np.diff(entry)).sum()) for entry in rows.T]

    @classmethod
    def start(cls, now: Vector) -> Self:
        return cls(zeros(now), zeros(now))

    def add(self, now: Vector, known: Number) -> Self:
        changes = Vector([known * absolute(entry - last) for entry, last in zip(now, self.last, strict=True)])
        return self._replace(sums=self.sums + changes, last=now)

    def values(self, samples: Numbers) -> list[Numbers]:
        return [np.asarray(entry) for entry in self.sums]


class Largest(NamedTuple):
    """The largest magnitude of each entry; while flying, of entries that are not negative."""

    so_far: Vector

    @staticmethod
    def of(rows: Numbers, t: Numbers) -> list[float]:  # noqa: ARG004
        return [float(np.abs(entry).max()) for entry in rows.T]

    @classmethod
    def start(cls, now: Vector) -> Self:
        return cls(zeros(now))

    def add(self, now: Vector, known: Number) -> Self:
        pairs = zip(now, self.so_far, strict=True)
        return self._replace(so_far=Vector([maximum(entry, largest) for entry, largest in pairs]))

    def values(self, samples: Numbers) -> list[Numbers]:
        return [np.asarray(entry) for entry in self.so_far]


def final(rows: Numbers, _t: Numbers) -> list[float]:
    """The last magnitude of each entry."""
    return [float(np.abs(entry)) for entry in rows[-1]]


def mean(rows: Numbers, _t: Numbers) -> list[float]:
    return [float(entry.mean()) for entry in rows.T]


def length_of_mean(rows: Numbers, _t: Numbers) -> list[float]:
    return [float(np.linalg.norm(rows.mean(axis=0)))]


def least(rows: Numbers, _t: Numbers) -> list[float]:
    return [float(rows.min())]


def greatest(rows: Numbers, _t: Numbers) -> list[float]:
    return [float(rows.max())]


def rms_share(rows: Numbers, _t: Numbers) -> list[float | None]:
    """Root mean square of the first entry as a share of that of the second; None where that is zero."""
    whole = rmse(rows[:, 1])
    return [rmse(rows[:, 0]) / whole if whole > 0.0 else None]


def rms_beyond_twice(rows: Numbers, _t: Numbers) -> list[float]:
    """What the root mean square of the first entry has, in squares, beyond twice that of the second."""
    swung, asked = rmse(rows[:, 0]), 2.0 * rmse(rows[:, 1])
    return [math.sqrt(max(swung * swung - asked * asked, 0.0))]


GROWTH_PARTS, GROWTH_FLOOR = 8, 1e-4
"""A flight is cut into so many equal parts; errors below this share of their scale do not grow."""

END_PARTS, END_FLOOR = 64, 5e-4
"""The last of so many equal parts is the end; what was before counts as at least this share of its scale."""

ASKED = 0.02
"""A path that asks for less acceleration asks for nothing [m/s^2]: an eighth of a degree of tilt."""


def late_growth(rows: Numbers, _t: Numbers) -> list[float]:
    """How many times the first entry grows towards the end of the flight, steadily or at once, whichever is more.

    Steadily: the cube of the least ratio of root mean squares in successive eighths of the last four; 0 where the last is
    below `GROWTH_FLOOR` of the second entry. It is 1.5 for growth in proportion to time, and above 2 for faster than
    t^1.62. At once: the largest value of the last 64th divided by the largest before the last eighth, from `alike` on, or by
    `END_FLOOR` of the second entry if that is more; 0 where the last eighth has a larger one earlier, as after a late step.
    The third entry is the acceleration that the path asks for [m/s^2].
    """
    count = len(rows)
    if count < GROWTH_PARTS:
        return [0.0]
    edges = [count * part // GROWTH_PARTS for part in range(GROWTH_PARTS // 2, GROWTH_PARTS + 1)]
    parts = [rmse(rows[a:b, 0]) for a, b in pairwise(edges)]
    ratio = min(later / earlier if earlier > 0.0 else 1.0 for earlier, later in pairwise(parts))
    steady = ratio * ratio * ratio if parts[-1] > GROWTH_FLOOR * rows[0, 1] else 0.0
    cuts = [alike(rows[:, 2], edges[-2]), edges[-2], count - max(1, count // END_PARTS)]
    _, before, late, end = (float(part.max(initial=0.0)) for part in np.split(rows[:, 0], cuts))
    return [max(steady, end / (max(before, END_FLOOR * rows[0, 1]) or math.inf) if end > late else 0.0)]


def alike(asked: Numbers, last: int) -> int:
    """The row from which on to the row `last` a flight is like its end: of a path that rests in its second half, halfway
    from there to `last`; else the first.
    """
    busy = np.flatnonzero(asked > ASKED)
    since = int(busy[-1]) + 1 if len(busy) else 0
    return (since + last) // 2 if since <= len(asked) // 2 else 0


def overturned(rows: Numbers, _t: Numbers) -> list[float]:
    """The largest of the values after the first that is at most a right angle; of all, where none is."""
    upright = np.flatnonzero(rows[:, 0] <= 0.5 * math.pi)
    return [float(rows[upright[0] if len(upright) else 0 :, 0].max())]


def activity(rows: Numbers, t: Numbers) -> list[float]:
    """Sum of |changes| of all entries a second."""
    return [float(np.abs(np.diff(rows, axis=0)).sum() / (t[-1] - t[0]))]


def settling(rows: Numbers, t: Numbers) -> list[float | None]:
    """When each entry is within `SETTLING_BAND` for good [s], None if it is outside at the end."""
    return [settling_time(t, entry) for entry in rows.T]


def settling_time(t: Numbers, values: Numbers) -> float | None:
    """Time from which |values| stays within SETTLING_BAND [s]; None if it is outside at the end."""
    outside = np.flatnonzero(np.abs(values) > SETTLING_BAND)
    if not len(outside):
        return float(t[0])
    return float(t[outside[-1] + 1]) if outside[-1] + 1 < len(t) else None

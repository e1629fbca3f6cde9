"""Modes of the sampled loop: by what factor each changes in a period, the states that take part, and which of them stay.

All is computed in balanced coordinates (Parlett and Reinsch, "Balancing a matrix for calculation of eigenvalues and
eigenvectors", 1969), in which it does not matter that one state is in metres and another in revolutions of a rotor.

A deviation stays where the map of a period has the eigenvalue 1. The map is known up to rounding, and 1 is an eigenvalue of a
map within that error exactly where the least singular value of the balanced map less 1 is no larger (Trefethen and Embree,
"Spectra and Pseudospectra", 2005, section 2): a slow mode counts as 1 only where rounding alone could make it so.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadstep.linear.sampled import Period, Tick, product
from quadstep.linear.states import Array, short


@dataclass(frozen=True)
class ReducedPeriod:
    """A period of fewer states, and their indices among all states. commands: rows of the channels' commands among them."""

    period: Period
    places: NDArray[np.intp]
    commands: NDArray[np.intp]

    @cached_property
    def map(self) -> Array:
        return self.period.map

    @cached_property
    def modes(self) -> "Modes":
        return Modes(self)


def reduced(period: Period) -> ReducedPeriod:
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
    return ReducedPeriod(
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
        tasks=tick.tasks[grid], path=tick.path[places], step=tick.step[grid], acting=tick.acting[np.ix_(places, acting)]
    )


ROUNDED = 1e-12
"""Error of the map, relative to the product of its ticks' absolute values."""

FELT = 1e-6
"""Least share of a direction that stays, in balanced coordinates, in a part of the pose for that part to be not held."""

SWEEPS, GAIN, ALONE = 50, 0.95, 2.0**-10
"""Most sweeps of balancing; a unit is changed if that reduces its row and column to this share; size that the row or column
has of a state that acts on no other, or that no other acts on.
"""


def scales(matrix: Array) -> Array:
    """Units, powers of 2, in which the rows and columns of a square matrix are about equally large."""
    found, sizes = np.ones(len(matrix)), np.abs(matrix)
    np.fill_diagonal(sizes, 0.0)
    for _ in range(SWEEPS):
        still = True
        for i in range(len(sizes)):
            column, row = float(np.linalg.norm(sizes[:, i])), float(np.linalg.norm(sizes[i]))
            if column and row:
                factor = 2.0 ** round(0.5 * np.log2(row / column))
                better = (factor * column) ** 2 + (row / factor) ** 2 < GAIN * (column**2 + row**2)
            elif column or row:
                factor = 2.0 ** round(np.log2(row / ALONE if row else ALONE / column))
                better = factor != 1.0
            else:
                continue
            if better:
                found[i] *= factor
                sizes[:, i] *= factor
                sizes[i] /= factor
                still = False
        if still:
            break
    return found


class Modes:
    """The modes of a linearised period. factors: the eigenvalues of its map."""

    def __init__(self, loop: ReducedPeriod) -> None:
        whole = loop.map
        most, self.pose = np.eye(len(whole)), loop.period.pose
        for tick in loop.period.ticks:
            most = product(np.abs(tick.step), product(np.abs(tick.tasks), most))
        self.units = scales(whole)
        self.balanced = whole * self.units / self.units[:, None]
        self.error = ROUNDED * float(np.linalg.norm(most * self.units / self.units[:, None], 2))
        factors, vectors = np.linalg.eig(self.balanced)
        self.factors, self.vectors = factors.astype(np.complex128), vectors.astype(np.complex128)

    @cached_property
    def shares(self) -> Array:
        """The share of each state in each mode, (states, modes): the sizes of their participation factors, which do not
        depend on units (Perez-Arriaga, Verghese and Schweppe, "Selective modal analysis", 1982); each column has the sum 1.
        """
        sizes = np.abs(self.vectors * np.linalg.pinv(self.vectors, rcond=1e-15).T)
        return sizes / np.maximum(sizes.sum(axis=0), np.finfo(float).tiny)

    @cached_property
    def staying(self) -> Array:
        """Directions in which a deviation stays as it is, (directions, states), of length 1 in balanced coordinates."""
        _, sizes, ways = np.linalg.svd(self.balanced - np.eye(len(self.balanced)))
        return ways[sizes <= self.error]

    @cached_property
    def still(self) -> NDArray[np.bool_]:
        """Which modes neither grow nor decay: those nearest to 1 for as many directions as stay, and those that belong to the
        same drift, to which rounding does the root of its error.
        """
        away = np.abs(self.factors - 1.0)
        count = len(self.staying)
        if not count:
            return np.zeros(len(away), dtype=bool)
        return away <= max(float(np.sort(away)[count - 1]), float(np.sqrt(self.error)))

    @cached_property
    def not_held(self) -> tuple[str, ...]:
        """The parts of the pose in which a deviation stays."""
        rows = self.pose.rows * self.units
        felt, most = np.linalg.norm(rows @ self.staying.T, axis=1), np.linalg.norm(rows, axis=1)
        return tuple(name for name, one, all_ in zip(self.pose.names, felt, most, strict=True) if one > FELT * all_)


GONE = 1e-6
"""A mode that decays to less than this share in a period is not shown: it is gone (as in a delay line)."""

STILL = 1e-9
"""A mode that changes by less than this in a period neither grows nor decays."""

NAMED, LEAST = 3, 0.2
"""Most states named of a mode, and the least share of one that is, relative to the largest."""


class Pole(NamedTuple):
    """log(z) / T, z the factor in a period T: real part [1/s], imaginary part [rad/s]. One stands for a conjugate pair.

    states: that take part in the mode, the most involved first.
    """

    real: float
    imaginary: float
    states: tuple[str, ...]

    @property
    def row(self) -> tuple[float, float, str]:
        """For a table; states separated by spaces."""
        return self.real, self.imaginary, " ".join(self.states)

    @property
    def time_constant(self) -> float:
        """[s]; negative for a growing mode, infinite for a neutral one."""
        return math.inf if self.real == 0.0 else -1.0 / self.real

    @property
    def frequency(self) -> float:
        """Natural frequency [rad/s]."""
        return math.hypot(self.real, self.imaginary)

    @property
    def damping(self) -> float:
        """Damping ratio [-]."""
        return -self.real / self.frequency if self.frequency else 0.0


def poles(loop: ReducedPeriod) -> list[Pole]:
    """The poles, growing ones first, then the slowest first."""
    names, modes = short(loop.period.names), loop.modes
    found = []
    for place, z in enumerate(modes.factors):
        still = modes.still[place] or abs(z - 1.0) < STILL
        if abs(z) > GONE and (z.imag >= 0.0 or still):  # rounding makes pairs of modes that stay
            s = 0.0 if still else np.log(z) / loop.period.length
            states = tuple(names[i] for i in involved(modes.shares[:, place]))
            found.append(Pole(float(np.real(s)), abs(float(np.imag(s))), states))
    return sorted(found, key=lambda one: (-one.real, one.imaginary))


def involved(shares: Array) -> list[int]:
    """The states that make up most of a mode, in order, at most `NAMED`."""
    order = np.argsort(-shares, kind="stable")[:NAMED]
    return [int(place) for place in order if shares[place] >= LEAST * shares[order[0]]]


ALIKE = 1e-4
"""Poles that differ by less than this share are equal up to rounding."""


class Group(NamedTuple):
    """Poles that are equal up to rounding. times: multiplicity; a pair counts as two. states: of any of them."""

    pole: Pole
    times: int
    states: tuple[str, ...]


def grouped(poles: list[Pole]) -> list[Group]:
    """Poles in order, equal ones merged."""
    groups: list[Group] = []
    for pole in poles:
        twice = 2 if pole.imaginary else 1
        for place, (first, count, states) in enumerate(groups):
            if math.hypot(pole.real - first.real, pole.imaginary - first.imaginary) <= ALIKE * first.frequency:
                groups[place] = Group(first, count + twice, tuple(dict.fromkeys((*states, *pole.states))))
                break
        else:
            groups.append(Group(pole, twice, pole.states))
    return groups

"""The log of a flight: its rows, its outcome, and its final cycle.

A metric in your own file, which missions name:

    metrics = ["my_metrics.py:Overshoot"]

It is summed sample by sample, compiled with the flight; for a log it is summed row by row.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadstep.interfaces.closed_loop import Outcome, Ticks
from quadstep.numbers import Number, flatten, leaf_names

SAID = frozenset(("psi_d", "theta_d", "phi_d", "yaw_d", "pitch_d", "roll_d"))
"""Columns of the attitude that a law desires: left out of the log if the law never reports it."""

REASONS = {
    Outcome.NOT_FINITE: "a number was no longer finite",
    Outcome.OFF_PATH: "too far from its path",
    Outcome.SINGULAR: "at a pitch near 90°, where the Euler angles are singular",
    Outcome.SPINNING: "turning too fast",
    Outcome.CRASHED: "it hit the ground",
}
"""Reasons why a flight ended early."""


class Limit(NamedTuple):
    """A limit that a flight passed. name: of the parameter. text: the reason, `{}` being the limit times `factor`."""

    name: str
    text: str
    factor: float = 1.0


LIMITS = {
    Outcome.OFF_PATH: Limit("limits.distance", "more than {} m from its path"),
    Outcome.SINGULAR: Limit("limits.pitch", "pitched beyond {}°, where the Euler angles are singular", math.degrees(1.0)),
    Outcome.SPINNING: Limit("limits.rate", "turning faster than {} rad/s"),
}
"""The reasons with their numbers, where the limits of the flight are known."""


class FlightLog(NamedTuple):
    """The log of a finished flight.

    columns: name and unit of each. rows: (samples, len(columns)), every value finite. outcome, and ended: its time [s].
    final: the cycle of floats at that time (state, controller memory with the weights, command).
    """

    columns: Mapping[str, str]
    rows: NDArray[np.float64]
    outcome: Outcome
    ended: float
    final: Any

    def column(self, name: str) -> NDArray[np.float64]:
        """One column by name. Raises KeyError with the available columns."""
        return self.table(name)[:, 0]

    def table(self, *names: str) -> NDArray[np.float64]:
        """Several columns by name, shape (samples, len(names)). Raises KeyError with the available columns."""
        known = list(self.columns)
        for name in names:
            if name not in self.columns:
                raise KeyError(f"the log has no column {name!r}; it has {', '.join(known)}")
        return self.rows[:, [known.index(name) for name in names]]


def finished(
    columns: Mapping[str, str], rows: NDArray[np.float64], code: float, tick: int, ticks: Ticks, final: object
) -> FlightLog:
    """The log of a flight that ended at `tick` with outcome `code`; rows from that tick on, and broken ones, are cut.

    There are no columns for a desired attitude that the law never reports.
    """
    outcome = Outcome(int(code))
    if outcome is not Outcome.COMPLETED:
        rows = rows[: -(-tick // ticks.log)]
    kept = [i for i, name in enumerate(columns) if not (name in SAID and len(rows) and np.isnan(rows[:, i]).all())]
    if len(kept) < len(columns):
        columns, rows = {name: unit for i, (name, unit) in enumerate(columns.items()) if i in kept}, rows[:, kept]
    broken = np.flatnonzero(~np.isfinite(rows).all(axis=1))
    if len(broken):
        outcome = Outcome.NOT_FINITE if outcome is Outcome.COMPLETED else outcome
        rows = rows[: broken[0]]
    return FlightLog(columns, rows, outcome, tick * ticks.step, final)


@dataclass(frozen=True)
class Metric(ABC):
    """One number of a flight; structure only, so it has no fields. name, unit: as in `metrics.json`.

    A sample holds the columns of `flight.csv` by name, NaN for columns that a law does not provide.

    >>> from quadstep.interfaces.log import Metric
    >>> from quadstep.numbers import maximum
    >>> class Height(Metric):
    ...     name, unit = "greatest_height", "m"
    ...     def start(self):
    ...         return -1e9
    ...     def add(self, sums, sample):
    ...         return maximum(sums, sample["z"])
    ...     def value(self, sums):
    ...         return sums
    >>> Height().add(2.0, {"z": 3.0})
    3.0
    """

    name: ClassVar[str]
    unit: ClassVar[str] = ""

    @abstractmethod
    def start(self) -> Any:
        """The sums before the first sample: a number, a Vector, or a NamedTuple of such."""

    @abstractmethod
    def add(self, sums: Any, sample: Mapping[str, Number]) -> Any:
        """The sums with one more sample."""

    @abstractmethod
    def value(self, sums: Any) -> Number:
        """The metric, once there is a sample."""

    @property
    def full_name(self) -> str:
        return f"{self.name}[{self.unit}]" if self.unit else self.name


class RunningMetric(NamedTuple):
    """A metric so far. value: of the sums."""

    sums: object
    value: Number


def started(metrics: Sequence[Metric]) -> tuple[RunningMetric, ...]:
    return tuple(RunningMetric(one.start(), 0.0) for one in metrics)


def added(
    metrics: Sequence[Metric], before: Sequence[RunningMetric], sample: Mapping[str, Number]
) -> tuple[RunningMetric, ...]:
    """Each metric with one more sample. Raises TypeError, which names method, file and line, for anything but numbers."""
    found = []
    for one, last in zip(metrics, before, strict=True):
        now = one.add(last.sums, sample)
        if leaf_names(now) != leaf_names(last.sums):
            raise TypeError(f"{source(one.add)} should return sums of the shape that `start` returns")
        for method, answer in ((one.start, last.sums), (one.add, now), (one.value, value := one.value(now))):
            if any(leaf is None or isinstance(leaf, str | list | dict) for leaf in flatten(answer)):
                raise TypeError(f"{source(method)} should return numbers, not {answer!r:.60}")
        found.append(RunningMetric(now, value))
    return tuple(found)


def source(method: Callable[..., object]) -> str:
    """How a method of a user's class is called, and where it is."""
    code = method.__code__
    return f"`{method.__qualname__}` ({Path(code.co_filename).name}:{code.co_firstlineno})"

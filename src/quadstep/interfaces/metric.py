"""A metric in your own file, which missions name.

    metrics = ["my_metrics.py:Overshoot"]

It is summed sample by sample, compiled with the flight; for a log it is summed row by row.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

from quadstep.numbers import Number


@dataclass(frozen=True)
class Metric(ABC):
    """One number of a flight; structure only, so it has no fields. name, unit: as in `metrics.json`.

    A sample holds the columns of `flight.csv` by name, NaN for columns that a law does not provide.

    >>> from quadstep.interfaces.metric import Metric
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


class Summed(NamedTuple):
    """A metric so far. value: of the sums."""

    sums: object
    value: Number


def started(metrics: Sequence[Metric]) -> tuple[Summed, ...]:
    """Nothing summed."""
    return tuple(Summed(one.start(), 0.0) for one in metrics)


def added(metrics: Sequence[Metric], before: Sequence[Summed], sample: Mapping[str, Number]) -> tuple[Summed, ...]:
    sums = [one.add(last.sums, sample) for one, last in zip(metrics, before, strict=True)]
    return tuple(Summed(now, one.value(now)) for one, now in zip(metrics, sums, strict=True))

"""The interface to the engines: a closed loop as laws over numbers, and the clock that determines when each is due.

The engines only choose the kind of number, and count the ticks.
"""

from collections.abc import Callable, Mapping
from enum import IntEnum
from typing import NamedTuple, Protocol

from quadstep.numbers import Condition, Number, Structure


class Outcome(IntEnum):
    """How a flight ended."""

    COMPLETED = 0
    NOT_FINITE = 1
    OFF_PATH = 2
    SINGULAR = 3
    SPINNING = 4
    CRASHED = 5


class Clock(NamedTuple):
    """Time as seen by a law. time: t [s]. tick: steps since the start. period: until this law is due again [s]."""

    time: Number
    tick: Number
    period: Number


class Task(NamedTuple):
    """A part of a tick.

    run(cycle, parameters, clock) returns the new cycle, and the `Outcome` that ends the flight here (0: none).
    """

    name: str
    run: Callable[[Structure, Structure, Clock], tuple[Structure, Number]]


class Ticks(NamedTuple):
    """Fixed-step clock. step: of the integrator [s]. every: for each task, the steps from one run to the next.

    log: steps from row to row. last: the final step.
    """

    step: float
    every: tuple[int, ...]
    log: int
    last: int


class ClosedLoop(Protocol):
    """The structure of a flight: which laws are composed. Hashable; its numbers are in the parameters.

    Tick by tick an engine runs the tasks that are due, in order, writes a row where one is due, and advances the vehicle.
    """

    @property
    def columns(self) -> Mapping[str, str]:
        """Name and unit of every logged column, in the order of `row`."""
        ...

    @property
    def tasks(self) -> tuple[Task, ...]:
        """The sampled laws, in order."""
        ...

    def start(self, start: Structure, parameters: Structure) -> Structure:
        """The cycle before the first tick: everything that persists from step to step."""
        ...

    def advance(self, cycle: Structure, parameters: Structure, clock: Clock) -> Structure:
        """The cycle one integrator step later, all commands held."""
        ...

    def row(self, cycle: Structure, parameters: Structure, time: Number) -> list[Number]:
        """One row of the log."""
        ...


def finite(x: Number) -> Condition:
    """Whether a non-negative number is finite; false for NaN."""
    return x < 1e300

"""The interface to the engines: a closed loop as laws over numbers, and the clock that determines when each is due.

The engines only choose the kind of number, and count the ticks.
"""

from collections.abc import Callable, Mapping
from enum import IntEnum
from typing import Any, Generic, NamedTuple, Protocol, TypeAlias

from typing_extensions import TypeVar

from quadstep.numbers import Condition, Number


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


Advance: TypeAlias = Callable[[int], None]
"""Called by an engine with how much was done since the last call: ticks of one flight, or flights of many.

It is called with 0 once the program that flies them is compiled.
"""


Z = TypeVar("Z", default=Any)
"""A cycle: everything that lives from step to step."""

P = TypeVar("P", default=Any)
"""The parameters of a flight."""


class Task(NamedTuple, Generic[Z, P]):
    """A part of a tick.

    run(cycle, parameters, clock) returns the new cycle, and the `Outcome` that ends the flight here (0: none).
    """

    name: str
    run: Callable[[Z, P, Clock], tuple[Z, Number]]


class Ticks(NamedTuple):
    """Fixed-step clock. step: of the integrator [s]. every: for each task, the steps from one run to the next.

    log: steps from row to row. last: the final step.
    """

    step: float
    every: tuple[int, ...]
    log: int
    last: int


class ClosedLoop(Protocol[Z, P]):
    """The structure of a flight: which laws are composed. Hashable; its numbers are in the parameters.

    Tick by tick an engine runs the tasks that are due, in order, writes a row where one is due, and advances the vehicle.
    """

    @property
    def columns(self) -> Mapping[str, str]:
        """Name and unit of every logged column, in the order of `row`."""
        ...

    @property
    def tasks(self) -> tuple[Task[Z, P], ...]:
        """The sampled laws, in order."""
        ...

    def start(self, start: tuple[object, ...], parameters: P) -> Z:
        """The cycle before the first tick: everything that persists from step to step."""
        ...

    def advance(self, cycle: Z, parameters: P, clock: Clock) -> Z:
        """The cycle one integrator step later, all commands held."""
        ...

    def row(self, cycle: Z, parameters: P, time: Number) -> list[Number]: ...


def finite(x: Number) -> Condition:
    """Whether a non-negative number is finite; false for NaN."""
    return x < 1e300

"""The sampled closed loop as a map of one state: the laws that fly, for any kind of number, and which of its results depend
on which inputs.

A sample spans the time until all loops of the controller fall due together again.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from math import lcm
from typing import TypeAlias, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from quadstep.control.opaque import Opaque
from quadstep.engines.fly import FlightPlan, fly
from quadstep.engines.loop import Cycle, Loop, Numbers
from quadstep.interfaces.closed_loop import Clock, Outcome
from quadstep.interfaces.log import REASONS, FlightLog
from quadstep.io.errors import UserError
from quadstep.linear.states import in_words, pose_names, short
from quadstep.numbers import Number, Structure, flatten, leaf_names, rebuild
from quadstep.numbers.enclosure import PLAIN, Enclosure, UndefinedError
from quadstep.numbers.operation import Kind, Operation, Rule
from quadstep.proofs.prove.unknown import Leaf, Unknown, started

Operand: TypeAlias = "Influence | float"


class Influence:
    """The inputs, by place, that a number depends on. A product with zero depends on none."""

    __slots__ = ("of",)
    __array_ufunc__ = None
    functions: Influences

    def __init__(self, of: frozenset[int]) -> None:
        self.of = of

    def with_(self, *others: Operand) -> Influence:
        """The same number, depending on these inputs too."""
        return Influence(self.of.union(*(one.of for one in others if isinstance(one, Influence))))

    def __add__(self, other: Operand) -> Influence:
        return self.with_(other) if isinstance(other, (Influence, *PLAIN)) else NotImplemented

    __radd__ = __sub__ = __rsub__ = __truediv__ = __rtruediv__ = __add__
    __lt__ = __le__ = __gt__ = __ge__ = __add__

    def __mul__(self, other: Operand) -> Operand:
        if isinstance(other, PLAIN) and np.all(np.asarray(other) == 0.0):
            return 0.0
        return self.__add__(other)

    __rmul__ = __mul__
    __and__ = __or__ = __rand__ = __ror__ = __add__

    def __neg__(self) -> Influence:
        return self

    __pos__ = __abs__ = __invert__ = __neg__


class Influences(Kind):
    """The functions of `quadstep.numbers` for them."""

    @staticmethod
    def rule(_: Operation) -> Rule:
        return lambda _, *given: Influence(frozenset()).with_(*given)

    def sqrt(self, x: Operand) -> Operand:
        return x

    def where(self, condition: Operand, yes: Operand, no: Operand) -> Operand:
        if not isinstance(condition, Influence):
            decided = np.asarray(condition)
            if np.all(decided):
                return yes
            if not np.any(decided):
                return no
        return Influence(frozenset()).with_(condition, yes, no)


Influence.functions = Influences()


def of(x: object) -> frozenset[int]:
    """The inputs that a number depends on; none for a constant."""
    return x.of if isinstance(x, Influence) else frozenset()


Array = NDArray[np.float64]

N = TypeVar("N")
"""The kind of number that the loop is evaluated on."""

T = TypeVar("T")
"""The kind of number that its time is."""


@dataclass(frozen=True)
class RecordedLoop(Loop):
    """The same loop; its log has these leaves of the cycle as columns. (Others need not be finite: a command may lack an
    attitude.)
    """

    places: tuple[int, ...] = ()

    @property
    def columns(self) -> Mapping[str, str]:
        return {str(place): "" for place in self.places}

    def row(self, cycle: Structure, p: Numbers, time: Number) -> list[Number]:
        leaves = flatten(cycle)
        return [leaves[place] for place in self.places]


class SampledLoop:
    """A plan's closed loop from sample to sample, each of `span` steps.

    places: of the state's numbers among the leaves of the cycle; names: of these. Leaves on which the vehicle's motion never
    depends (weights of nets that are off) are not states. period [s]; samples: of the flight.
    """

    def __init__(self, plan: FlightPlan) -> None:
        refuse_unprovable(plan)
        self.plan, self.ticks, self.parameters = plan, plan.ticks, plan.parameters
        self.loop: Loop = plan.loop
        self.span = lcm(*self.ticks.every)
        self.samples, self.period = self.ticks.last // self.span, self.span * self.ticks.step
        self.like: Cycle = self.loop.start(plan.start, plan.parameters)
        self.start = [float(leaf) for leaf in flatten(self.like)]
        if not self.samples:
            raise UserError(f"the flight of {self.ticks.last * self.ticks.step:g} s ends before all loops have run once")
        self.places = self.relevant()
        names = short(leaf_names(self.like))
        self.names = [names[place] for place in self.places]
        refuse_displaced(self.loop.plant.axes, self.names)

    def in_words(self, *names: str) -> str:
        """States as people say them."""
        return in_words(names, self.names, pose_names(self.loop.plant))

    def starts(self, unknown: Unknown) -> list[Leaf]:
        """The state over all starts. Raises UserError, UndefinedError."""
        leaves = started(self.loop, self.plan.start, self.parameters, unknown)
        return [leaves[place] for place in self.places]

    def relevant(self) -> list[int]:
        """The leaves that the vehicle's motion depends on, however many samples later."""
        count = len(self.start)
        try:
            after = self.run([Influence(frozenset((i,))) for i in range(count)], np.arange(self.samples) * float(self.span))
        except TypeError as error:
            raise UserError(f"controller: nothing can be proved about it: {error}") from None
        reasons = [of(leaf) for leaf in after]
        found = set(range(len(flatten(self.like.state))))
        found = set().union(*(reasons[i] for i in found))
        while True:
            more = found.union(*(reasons[i] for i in found))
            if more == found:
                return sorted(found)
            found = more

    def run(self, leaves: Sequence[N | float], tick: T, p: Numbers | None = None) -> list[N | T | float]:
        """All leaves of the cycle one sample later. tick: steps since the start. Raises UndefinedError."""
        p = self.parameters if p is None else p
        cycle, begun = rebuild(self.like, iter(leaves)), cast(Number, tick)
        step, tasks = self.ticks.step, self.loop.tasks
        for past in range(self.span):
            now = begun + float(past)
            time = now * step
            for task, every in zip(tasks, self.ticks.every, strict=True):
                if past % every == 0:
                    cycle, code = task.run(cycle, p, Clock(time, now, step * every))
                    refuse_ended(code)
            cycle = self.loop.advance(cycle, p, Clock(time, now, step))
        return flatten(cycle)

    def step(self, x: Sequence[N | float], tick: T, p: Numbers | None = None) -> list[N | T | float]:
        """The state one sample later. Raises UndefinedError."""
        leaves: list[N | float] = [*self.start]
        for place, value in zip(self.places, x, strict=True):
            leaves[place] = value
        after = self.run(leaves, tick, p)
        return [after[place] for place in self.places]

    def flown(self) -> tuple[Array, FlightLog]:
        """The state before every sample of the flight, (samples + 1, states), by the compiled engine."""
        own = {field.name: getattr(self.loop, field.name) for field in fields(Loop)}
        loop = RecordedLoop(**own, places=tuple(self.places))
        log = fly(self.plan._replace(loop=loop, ticks=self.ticks._replace(log=1)))
        if not len(log.rows):
            raise UserError("the flight has no first sample: a number is not finite at t = 0 s")
        moving = sum(place < len(flatten(self.like.state)) for place in self.places)  # the plant's own, which come first
        before = np.vstack([[self.start[place] for place in self.places], log.rows[:-1]])  # sampled values stay until the next
        before[:, :moving] = log.rows[:, :moving]
        return before[:: self.span], log

    def flown_from(self, begun: Sequence[Array | float], first: int, samples: int) -> Array:
        """Flights side by side from these states, whose numbers are arrays, as long as all have one: (samples + 1, states,
        flights). first: sample.
        """
        found = [np.stack(np.broadcast_arrays(*begun))]
        for sample in range(first, first + samples):
            try:
                with np.errstate(all="ignore"):
                    after = self.step([*found[-1]], float(sample * self.span))
            except UndefinedError:
                break
            found.append(np.stack(np.broadcast_arrays(*after, found[-1][0])[:-1]))
        return np.array(found, dtype=np.float64)

    def at_rest(self, cycle: Cycle) -> list[float]:
        """The state's numbers from a cycle."""
        leaves = flatten(cycle)
        return [float(leaves[place]) for place in self.places]


def refuse_unprovable(plan: FlightPlan) -> None:
    """Raises UserError if a flight is more than equations from sample to sample."""
    loop = plan.loop
    if not isinstance(loop, Loop):
        raise UserError("nothing can be proved about this kind of flight")
    law = loop.controller.unwrapped
    if isinstance(law, Opaque):
        raise UserError(f"controller: {law.name} is {law.nature}, which has no equations: nothing can be proved about it")
    if loop.sensing is not None and loop.sensing.noisy:
        raise UserError("sensors: nothing can be proved with unbounded noise; set every noise, bias and walk to 0")
    if loop.air is not None and loop.air.stirs:
        raise UserError("wind: nothing can be proved with turbulence; leave it out")
    if max(plan.ticks.every) > plan.ticks.last:
        raise UserError("simulation: a loop of the controller is slower than the whole flight")


def refuse_displaced(axes: Sequence[str], names: Sequence[str]) -> None:
    """Raises UserError if the state of a plant does not begin with the position along its axes."""
    if [*names[: len(axes)]] != [f"position.{i}" for i in range(len(axes))] or set(axes) - {*"xyz"}:
        raise UserError(
            "vehicle: nothing can be proved about this plant: the first entry of its state should be `position`, a Vector "
            f"along {', '.join(axes)}, and its axes should be among x, y, z"
        )


def refuse_ended(code: object) -> None:
    """Raises UndefinedError if a flight may end."""
    if isinstance(code, Enclosure) or (isinstance(code, float | np.ndarray) and np.any(np.asarray(code) != 0.0)):
        raise UndefinedError(f"the flight may end: {ending(code)}")


def ending(code: Enclosure | float | Array) -> str:
    """The outcomes other than 0 that are possible, in words."""
    most = code.high if isinstance(code, Enclosure) else np.asarray(code)
    return REASONS.get(Outcome(min(int(np.max(most)), max(Outcome))), "a limit of the mission")

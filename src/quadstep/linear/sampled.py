"""The sampled closed loop as linear maps: the effect of each tick on small deviations from a motion.

A tick is what the engines fly: the tasks that are due, then the integrator's step with all commands held. Both are given
dual numbers and yield exact slopes, including latency, rotor lag and every loop at its own rate.
"""

import contextlib
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, cast

import numpy as np

from quadstep.engines.fly import FlightPlan
from quadstep.engines.loop import Numbers
from quadstep.interfaces.closed_loop import Clock
from quadstep.interfaces.plant import PathLaw, Reference
from quadstep.linear.states import (
    SAME,
    Array,
    Channel,
    EdgeSide,
    LoopState,
    NoSlopeError,
    NotLinearError,
    Pose,
    channels,
    commanded,
    names_of,
    pose,
    relative_difference,
    states,
    with_addition,
    with_states,
)
from quadstep.numbers import Number, Structure, Vector, flatten
from quadstep.numbers.dual import Seeds
from quadstep.sensing.sensors import filled, passed

MOST_TICKS = 2000
"""Most ticks of the period after which all loops are due together again."""

WANTED = "x", "y", "z", "yaw"
"""Quantities of the path that can be shifted."""


class NoRestError(NotLinearError):
    """There is no equilibrium, or none that can be flown. left: the largest relative change in a period, if known."""

    def __init__(self, text: str, left: float = math.inf) -> None:
        super().__init__(text)
        self.left = left


@contextlib.contextmanager
def linearising() -> Iterator[None]:
    """A block in which failing arithmetic, or a law that rejects dual numbers, raises NotLinearError; numbers that are no
    longer finite are looked for, so NumPy need not warn of them.
    """
    try:
        with np.errstate(all="ignore"):
            yield
    except (ArithmeticError, np.linalg.LinAlgError) as error:
        raise NotLinearError(f"its numbers cannot be computed: {error}") from None
    except TypeError as error:
        raise NotLinearError(f"a law cannot be evaluated with dual numbers: {error}") from None


class Tick(NamedTuple):
    """One tick for small deviations: x' = tasks x + path r, then x = step (x' + acting d) - acting d, x the state of
    `Period.names`.

    d: what is added to each channel's command while this tick lasts, and no longer. commands: rows of x' that hold the
    commands. sampled: whether the law ran. r: deviations of the path, `WANTED`.
    """

    tasks: Array
    path: Array
    step: Array
    acting: Array
    sampled: bool


def product(matrix: Array, on: Array) -> Array:
    """The product of a map that keeps most states as they are with the first axis of an array."""
    rows = (matrix != np.eye(len(matrix))).any(axis=1)
    columns = matrix[rows].any(axis=0)
    found = on.copy()
    found[rows] = np.tensordot(matrix[np.ix_(rows, columns)], on[columns], 1)
    return found


class Period(NamedTuple):
    """The ticks until all loops are due together again, from time `start` [s]. names: of the states, the channels' commands
    last. values: of the states at the start, and `after` it. pose: at the start. bends: places of the laws where the slopes on
    both sides differ, and these are those of one side. broken: why one does not exist, and counts as zero here.
    """

    ticks: tuple[Tick, ...]
    names: tuple[str, ...]
    channels: tuple[Channel, ...]
    values: Array
    after: Array
    pose: Pose
    step: float
    start: float
    bends: tuple[str, ...] = ()
    broken: str = ""

    @property
    def length(self) -> float:
        """[s]."""
        return len(self.ticks) * self.step

    @property
    def map(self) -> Array:
        """The map of a deviation over a whole period."""
        whole = np.eye(len(self.names))
        for tick in self.ticks:
            whole = product(tick.step, product(tick.tasks, whole))
        return whole


@dataclass(frozen=True)
class MovedPath:
    """A path shifted by a constant. Its parameters are those of the path and the offset `WANTED`."""

    path: PathLaw

    def reference(self, t: float, parameters: object) -> Reference:
        own, offset = cast("tuple[object, Vector]", parameters)
        wanted = self.path.reference(t, own)
        return wanted._replace(position=wanted.position + Vector(offset.entries[:3]), yaw=wanted.yaw + offset[3])


class Loops:
    """The closed loop of a plan, tick by tick, for any numbers."""

    ahead: Number = 0.0
    """Ticks that clocks show more than have been flown; of states that are arrays one for each column."""

    def __init__(self, plan: FlightPlan) -> None:
        self.plan, self.h = plan, plan.ticks.step
        self.loop = replace(plan.loop, path=MovedPath(plan.loop.path))
        self.p = plan.parameters._replace(path=(plan.parameters.path, Vector(0.0 for _ in WANTED)))
        due = [every for every in plan.ticks.every if every <= plan.ticks.last]
        self.count = math.lcm(*due)
        if self.count > MOST_TICKS:
            raise NotLinearError(
                f"the common period of sensors and controller is {self.count * self.h:g} s, that is {self.count} "
                f"steps; allowed: at most {MOST_TICKS}"
            )

    def due(self, k: int) -> tuple[bool, ...]:
        """Which tasks run at tick k."""
        return tuple(k % every == 0 for every in self.plan.ticks.every)

    def clock(self, k: int, every: int = 1) -> Clock:
        return Clock((k + self.ahead) * self.h, k + self.ahead, self.h * every)

    def begin(self) -> LoopState:
        return LoopState(self.loop.start(self.plan.start, self.p), (), Vector(()))

    def tasks(self, flown: LoopState, k: int, p: Numbers) -> tuple[LoopState, Structure]:
        """After the tasks of tick k; the command, () where the law is not due."""
        cycle, line, asked = flown
        command: Structure = ()
        for task, every, due in zip(self.loop.tasks, self.plan.ticks.every, self.due(k), strict=True):
            clock = self.clock(k, every)
            if due and task.name == "law":
                command, memory = self.loop.controller.law(
                    cycle.memory,
                    self.loop.measurement(cycle, p),
                    self.loop.reference(clock.time, p),
                    p.gains,
                    clock.time,
                    clock.period,
                )
                now = Vector(commanded(self.loop, p, command))
                line, asked = passed(line or filled(now, self.loop.late), now)
                waiting, held = passed(cycle.waiting, self.loop.plant.actuate(p, command))
                cycle = cycle._replace(memory=memory, held=held, waiting=waiting)
            elif due:
                cycle, _ = task.run(cycle, p, clock)
        return LoopState(cycle, line, asked), command

    def step(self, flown: LoopState, k: int) -> LoopState:
        return flown._replace(cycle=self.loop.advance(flown.cycle, self.p, self.clock(k)))

    def fly(self, flown: LoopState, first: int, past: int) -> LoopState:
        for k in range(first, past):
            flown = self.step(self.tasks(flown, k, self.p)[0], k)
        return flown


class Moment(NamedTuple):
    """Tick k as flown: the loop before it, the loop after its tasks, and the law's last command."""

    k: int
    flown: LoopState
    after: LoopState
    command: Structure


def linearised(loops: Loops, flown: LoopState, first: int, way: Array | None = None) -> Period:
    """As `approached`. Raises NoSlopeError where a slope does not exist."""
    found = approached(loops, flown, first, way)
    if found.broken:
        raise NoSlopeError(found.broken)
    return found


def approached(loops: Loops, flown: LoopState, first: int, way: Array | None = None, rough: bool = False) -> Period:
    """One period from tick `first` on, a multiple of the period's. flown: once the law has run. way: a deviation of all
    states, to whose side the loop is linearised where it bends. rough: take the slopes of ticks with the same tasks to be
    equal, and those of one side. Raises NotLinearError.
    """
    values, names = states(flown), names_of(flown)
    posed = pose(loops.loop, loops.p, flown, first * loops.h)
    moments: list[Moment] = []
    kinds: tuple[Channel, ...] = ()
    if not loops.due(first)[-1]:
        raise NotLinearError("the law does not run in the common period of the other loops: its own is longer than the flight")
    for k in range(first, first + loops.count):
        after, command = loops.tasks(flown, k, loops.p)
        if command != ():
            kinds = channels(loops.loop, command)
            held = command
        moments.append(Moment(k, flown, after, held))
        flown = loops.step(after, k)
    ticks: dict[int, Tick] = {}
    final = np.array(states(flown))
    side = EdgeSide(names, way, rough)
    if way is None:
        for due in dict.fromkeys(loops.due(one.k) for one in moments):
            ticks |= equal_ticks(loops, [one for one in moments if loops.due(one.k) == due], side)
    else:
        ticks = {one.k: tick_of(loops, one, side, of_tasks(loops, one, side)) for one in moments}
    every = tuple(ticks[k] for k in sorted(ticks))
    return Period(
        every, tuple(names), kinds, np.array(values), final, posed, loops.h, first * loops.h, tuple(side.bends), side.broken
    )


def equal_ticks(loops: Loops, moments: list[Moment], side: EdgeSide) -> dict[int, Tick]:
    """Ticks with the same tasks: one for all if nothing has moved and no task depends on time, or if rough ones do; else each
    by itself. (A task that follows a plan depends on the time since the plan was made.)
    """
    one, last = moments[0], moments[-1]
    tasks = of_tasks(loops, one, side)
    if side.rough:
        return dict.fromkeys([other.k for other in moments], tick_of(loops, one, side, tasks))
    begun = np.array(states(one.flown))
    moved = max(relative_difference(begun, np.array(states(other.flown))) for other in moments)
    if moved <= SAME and (last is one or relative_difference(tasks, of_tasks(loops, last, side)) <= SAME):
        return dict.fromkeys([other.k for other in moments], tick_of(loops, one, side, tasks))
    found: dict[int, Tick] = {}
    for other in moments:
        known = found.get(one.k) if moved <= SAME else None
        found[other.k] = tick_of(loops, other, side, of_tasks(loops, other, side), known)
    return found


def tick_of(loops: Loops, one: Moment, side: EdgeSide, tasks: Array, known: Tick | None = None) -> Tick:
    """The slopes of a tick. tasks: of its tasks. known: another whose step is the same. Raises NotLinearError."""
    n = len(tasks)
    if known is not None:
        return known._replace(tasks=tasks[:, :n], path=tasks[:, n:])
    return Tick(
        tasks[:, :n], tasks[:, n:], of_step(loops, one, side), command_slopes(loops, one, side.names), loops.due(one.k)[-1]
    )


def of_tasks(loops: Loops, one: Moment, side: EdgeSide) -> Array:
    """The tasks' slopes by state and path, (states, states + path)."""
    values = states(one.flown)
    n, r = len(values), len(WANTED)

    def made(seeds: Seeds) -> list[Number]:
        duals = seeds.seeded([*values, *(0.0 for _ in WANTED)], 0)
        p = loops.p._replace(path=(loops.p.path[0], Vector(duals[n:])))
        return list(states(loops.tasks(with_states(one.flown, duals[:n]), one.k, p)[0]))

    found = side.slopes(one.k * loops.h, n + r, made)
    side.moved(found[:, :n])
    return found


def of_step(loops: Loops, one: Moment, side: EdgeSide) -> Array:
    """The slopes of the integrator's step by state, (states, states)."""
    values = states(one.after)

    def made(seeds: Seeds) -> list[Number]:
        return list(states(loops.step(with_states(one.after, seeds.seeded(values, 0)), one.k)))

    found = side.slopes(one.k * loops.h, len(values), made)
    side.moved(found)
    return found


def command_slopes(loops: Loops, one: Moment, names: Sequence[str]) -> Array:
    """The held states' slopes by an addition to each channel's command, (states, channels)."""
    m = len(one.after.asked)

    def made(seeds: Seeds) -> list[Number]:
        return flatten(loops.loop.plant.actuate(loops.p, with_addition(loops.p, one.command, seeds.seeded([0.0] * m, 0))))

    found = np.zeros((len(names), m))
    held = [place for place, name in enumerate(names) if name.startswith("held")]
    found[held] = EdgeSide([names[place] for place in held]).slopes(one.k * loops.h, m, made)
    return found

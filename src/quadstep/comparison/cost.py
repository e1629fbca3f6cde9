"""What a controller costs to compute: time for a sample of its laws alone, as scalar code on one core, and memory."""

import math
import time
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from quadstep.comparison.study import Cell
from quadstep.control.controller import Command, Controller
from quadstep.control.opaque import Opaque
from quadstep.flight.closed_loop import Clock, Task, Ticks
from quadstep.flight.engines import FlightPlan
from quadstep.flight.loop import Cycle, Loop
from quadstep.flight.scored import scored
from quadstep.flight.sweep import Batch, Sweep, prepare
from quadstep.mission.read import check_mission
from quadstep.numbers import Number, Table, flatten, rebuild, vector

SAMPLES, REPEATS = 100_000, 5
"""Samples of the law in one measurement, and measurements, of which the fastest counts."""

A_NUMBER = 8
"""Bytes of a number in f64."""

SHIFT = 1e-9
"""By how much everything measured changes from sample to sample, so that nothing is worked out once and for all."""


class Cost(NamedTuple):
    """nanoseconds: of a sample of the law, its position loop at its own rate included; NaN of a Python function. memory: bytes
    that live from sample to sample; numbers: bytes of gains.
    """

    nanoseconds: float
    memory: int
    numbers: int


@dataclass(frozen=True)
class LawAlone(Loop):
    """A loop in which only the controller runs: what it is told drifts a little, and nothing flies."""

    @property
    def tasks(self) -> tuple[Task, ...]:
        """Position loop and law."""
        return (*((Task("guidance", self.guide),) if self.guided else ()), Task("control", self.control))

    def control(self, cycle: Cycle, p: Any, clock: Clock) -> tuple[Cycle, Number]:
        """The law; every number it gives is kept, so that none is left out."""
        reference = self.path.reference(clock.time, p.path)
        command, memory = self.controller.law(cycle.memory, self.told(cycle), reference, p.gains, clock.time, clock.period)
        return cycle._replace(memory=memory, command=command), 0.0

    def told(self, cycle: Cycle) -> Any:
        """The truth."""
        return self.plant.told(self.plant.truth(cycle.state), cycle.held)

    def advance(self, cycle: Cycle, p: Any, clock: Clock) -> Cycle:
        """Everything a little further, by what the law asked for too."""
        more = SHIFT * sum(flatten(cycle.command)[1:4], start=flatten(cycle.command)[0])
        return cycle._replace(state=rebuild(cycle.state, iter([one + (SHIFT + SHIFT * more) for one in flatten(cycle.state)])))


@dataclass(frozen=True)
class Nothing(Controller):
    """A law that asks for nothing: what measuring costs."""

    name = "nothing"

    def start(self, measured: Any, gains: Any) -> tuple[()]:
        """No memory."""
        return ()

    def law(self, memory: Any, measured: Any, reference: Any, gains: Any, t: Number, period: Number) -> tuple[Command, Any]:
        """What it was told."""
        return Command(measured.position[2] + measured.rates[0], vector(t, measured.velocity[1], reference.position[0])), memory


def cost(plan: FlightPlan) -> Cost:
    """Measure a flight's controller."""
    loop, parameters = plan.loop, plan.parameters
    memory = loop.controller.start(loop.plant.told(loop.plant.truth(plan.start), loop.plant.rest(plan.start, parameters)[1]),
                                   parameters.gains)  # fmt: skip
    sizes = [sum(leaf.size if isinstance(leaf, Table) else 1 for leaf in flatten(one)) for one in (memory, parameters.gains)]
    if isinstance(loop.controller, Opaque):
        return Cost(math.nan, A_NUMBER * sizes[0], A_NUMBER * sizes[1])
    alone = law_alone(plan, loop.controller)
    bare = law_alone(plan.with_controller(Nothing(), parameters.gains), Nothing())
    return Cost(max(0.0, nanoseconds(alone) - nanoseconds(bare)), A_NUMBER * sizes[0], A_NUMBER * sizes[1])


def law_alone(plan: FlightPlan, controller: Any) -> FlightPlan:
    """The plan of nothing but its controller, one step a sample."""
    loop = LawAlone(plan.loop.plant, plan.loop.path, controller, None, None, plan.loop.guided)
    *_, guidance, control = (1, *plan.ticks.every)
    every = (max(1, round(guidance / control)), 1) if plan.loop.guided else (1,)
    ticks = Ticks(control * plan.ticks.step, every, SAMPLES, SAMPLES)
    return plan._replace(loop=loop, ticks=ticks)


class Scalar(Sweep):
    """A sweep of one flight as scalar code, as a flight controller would run it."""

    def __init__(self, plan: FlightPlan) -> None:
        loop, ticks = scored(plan.loop, plan.ticks, SAMPLES * plan.ticks.step)
        Batch.__init__(self, loop, ticks, plan.start, plan.parameters, (), double=True)
        self.width = 1
        self.kernel = prepare(loop, plan.start, plan.parameters, frozenset(), True, 1)


def nanoseconds(plan: FlightPlan) -> float:
    """Of a sample."""
    sweep, took = Scalar(plan), math.inf
    for _ in range(REPEATS):
        started = time.perf_counter()
        sweep.fly(np.zeros((1, 0)), threads=1)
        took = min(took, time.perf_counter() - started)
    return 1e9 * took / SAMPLES


def cost_of(cell: Cell) -> Cost:
    """Of a cell's controller. Raises UserError."""
    mission = check_mission(cell.campaign.content, cell.campaign.source, cell.campaign.folder)
    return cost(mission.plan(cell.campaign.folder, warn=False))

"""What a controller costs to compute: time of its laws alone on one core, instructions on a flight controller, and memory."""

import math
import time
from dataclasses import dataclass, replace
from typing import NamedTuple, cast

import numpy as np

from quadstep.control.opaque import Opaque
from quadstep.engines.fly import FlightPlan
from quadstep.engines.loop import Cycle, Loop, Numbers, SensedNumbers
from quadstep.engines.scored import scored
from quadstep.engines.sweep import Sweep, prepare
from quadstep.export.arm import missing_programs
from quadstep.export.run import measured_standalone
from quadstep.interfaces.closed_loop import Clock, Task, Ticks
from quadstep.interfaces.controller import Measured
from quadstep.interfaces.plant import Reference
from quadstep.io.errors import ToolError, UserError
from quadstep.metrics.statistics import finite
from quadstep.numbers import Number, Structure, Table, flatten, rebuild, total
from quadstep.numbers.structure import replaced
from quadstep.studies.comparison.schema import Content

SAMPLES, REPEATS = 50_000, 12
"""Samples of the law in one measurement, and measurements, of which the fastest counts."""

A_NUMBER = 8
"""Bytes of a number in f64."""

BOARD = "Cortex-M4F"
"""The processor of most flight controllers."""

SHIFT = 1e-9
"""By how much everything measured changes from sample to sample, so that nothing is worked out once and for all."""


class Cost(NamedTuple):
    """nanoseconds: of a sample of the law, its position loop at its own rate included; NaN of a Python function. memory: bytes
    that live from sample to sample; numbers: bytes of gains. instructions: of the worst sample in f32 on `BOARD`, all loops
    due; None where they cannot be counted, and uncounted says why. failed: whether that was because a tool failed.
    """

    nanoseconds: float
    memory: int
    numbers: int
    instructions: int | None = None
    uncounted: str = ""
    failed: bool = False


@dataclass(frozen=True)
class LawAlone(Loop):
    """A loop in which only the controller runs: what it is told and its reference drift a little, and nothing flies.

    The reference at the start stands in the cycle, in place of the air, which there is none of: to evaluate a path is no part
    of a law. idle: whether not even the controller runs, so that nothing is left but the loop itself.
    """

    idle: bool = False

    @property
    def tasks(self) -> tuple[Task, ...]:
        return self.sampled

    def start(self, start: tuple[Structure, ...], p: Numbers) -> Cycle:
        return super().start(start, p)._replace(air=self.reference(0.0, p))

    def measured(self, state: Structure, sensed: Structure, held: Structure, p: Numbers) -> Structure:
        told = self.plant.measurement(self.plant.truth(state), held)
        if not self.controller.also_measures:
            return told
        speeds = self.plant.rotor_speeds(state)
        more = {
            "specific_force": cast(Measured, told).velocity,
            "rotor_speeds": speeds,
            "full_speed": speeds[0],
            "age": 0.01,
            "noise": cast(SensedNumbers, p).key,
        }
        return replaced(told, **{name: more[name] for name in self.controller.also_measures})

    def law(self, cycle: Cycle, p: Numbers, clock: Clock) -> tuple[Cycle, Number]:
        """The law, and nothing of what actuators make of it."""
        if self.idle:
            return cycle, 0.0
        asked, memory = self.controller.law(cycle.memory, *self.law_inputs(cycle, p, clock))
        return cycle._replace(memory=memory, command=self.plant.logged_command(p, asked)), 0.0

    def slower(self, name: str, cycle: Cycle, p: Numbers, clock: Clock) -> tuple[Cycle, Number]:
        """A sample of a slower loop."""
        if self.idle:
            return cycle, 0.0
        return cycle._replace(memory=self.controller.slower(name, cycle.memory, *self.law_inputs(cycle, p, clock))), 0.0

    def law_inputs(self, cycle: Cycle, p: Numbers, clock: Clock) -> tuple[Structure, Reference, Structure, Number, Number]:
        """What every sample of the controller is given besides its memory."""
        return self.measurement(cycle, p), cast(Reference, cycle.air), p.gains, clock.time, clock.period

    def advance(self, cycle: Cycle, p: Numbers, clock: Clock) -> Cycle:
        """Everything a little further, by what the law asked for too, so that none of it is left out."""
        thrust, *others = flatten(cycle.command)
        asked = total((thrust, *others[:3]))
        drift = SHIFT + (SHIFT * SHIFT) * asked
        moved = cycle.state, cycle.air
        state, reference = rebuild(moved, iter([one + drift for one in flatten(moved)]))
        return cycle._replace(state=state, air=reference)


def edition() -> str:
    """How it is measured: a cost measured in another way, or without tools that are there now, is not the one that is kept."""
    return f"a law with its reference given, sines with cosines, counted on {BOARD} without {missing_programs()}"


def cost(plan: FlightPlan) -> Cost:
    """Measure a flight's controller, without a predictor."""
    plan = plan._replace(loop=replace(plan.loop, controller=plan.loop.controller.unwrapped))
    loop, parameters = plan.loop, plan.parameters
    memory = loop.start(plan.start, parameters).memory
    sizes = [sum(leaf.size if isinstance(leaf, Table) else 1 for leaf in flatten(one)) for one in (memory, parameters.gains)]
    found = Cost(math.nan, A_NUMBER * sizes[0], A_NUMBER * sizes[1], *counted(plan))
    if isinstance(loop.controller, Opaque):
        return found
    alone, idle = nanoseconds(law_alone(plan, idle=False), law_alone(plan, idle=True))
    return found._replace(nanoseconds=alone - idle)


def counted(plan: FlightPlan) -> tuple[int | None, str, bool]:
    """Instructions of a flight's law, or why there are none, and whether a tool failed."""
    if lacking := missing_programs():
        return None, f"{' and '.join(lacking)} not found", False
    try:
        with measured_standalone(plan, BOARD) as law:
            return sum(law.worst.values()), "", False
    except UserError as error:
        return None, str(error), isinstance(error, ToolError)


def law_alone(plan: FlightPlan, idle: bool) -> FlightPlan:
    """The plan of nothing but its controller, one step a sample."""
    flown = plan.loop
    loop = LawAlone(plant=flown.plant, path=flown.path, controller=flown.controller, guided=flown.guided, idle=idle)
    every = plan.ticks.every[-len(loop.sampled) :]
    ticks = Ticks(every[-1] * plan.ticks.step, tuple(max(1, round(one / every[-1])) for one in every), SAMPLES, SAMPLES)
    return plan._replace(loop=loop, ticks=ticks)


class Scalar(Sweep):
    """A sweep of one flight as scalar code, as a flight controller would run it."""

    def __init__(self, plan: FlightPlan) -> None:
        loop, ticks = scored(plan.loop, plan.ticks, SAMPLES * plan.ticks.step)
        super().__init__(loop, ticks, plan.start, plan.parameters, (), double=True)

    def compiled(self, start: tuple[object, ...], parameters: Numbers) -> None:
        self.width = 1
        self.kernel = prepare(self.loop, start, parameters, frozenset(), self.double, self.width)


def nanoseconds(*plans: FlightPlan) -> list[float]:
    """Of a sample of each, measured in turn."""
    sweeps, took = [Scalar(plan) for plan in plans], [math.inf] * len(plans)
    for _ in range(REPEATS):
        for place, sweep in enumerate(sweeps):
            started = time.process_time()  # of this process, whatever else the machine does
            sweep.fly(np.zeros((1, 0)), threads=1)
            took[place] = min(took[place], time.process_time() - started)
    return [1e9 * one / SAMPLES for one in took]


def as_json(cost: Cost) -> Content:
    """For a file; no number of nanoseconds is null."""
    return {**cost._asdict(), "nanoseconds": finite(cost.nanoseconds)}


def from_json(content: Content) -> Cost:
    found = Cost._make(content[name] for name in Cost._fields)
    return found if found.nanoseconds is not None else found._replace(nanoseconds=math.nan)

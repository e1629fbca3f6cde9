"""Metrics summed during the flight, so that a flight leaves a handful of numbers instead of a log.

`ScoredLoop` is a closed loop around another: its cycle is the other's plus the sums so far; its last task adds a sample to
them. It flies on every engine.
"""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadstep.engines.eager import always
from quadstep.engines.loop import Cycle, Loop, Numbers
from quadstep.interfaces.closed_loop import Clock, Task, Ticks
from quadstep.interfaces.log import FlightLog, Metric, RunningMetric, added, started
from quadstep.interfaces.plant import Plant
from quadstep.metrics.reductions import Sums
from quadstep.metrics.registry import LARGEST as FARTHEST
from quadstep.metrics.registry import RMSE as MEAN_DISTANCE
from quadstep.metrics.registry import SCORED, score_names_of, with_unit
from quadstep.numbers import Number, Vector, flatten, rebuild, where


def of_log(metrics: Sequence[Metric], log: FlightLog, columns: Mapping[str, str], begin: float) -> dict[str, float | None]:
    """The metrics of a log from `begin` [s] on, None where it is not finite. columns: all that its plant has."""
    summed, silent = started(metrics), dict.fromkeys(columns, float("nan"))
    rows = log.rows[log.column("t") >= begin] if metrics else log.rows[:0]
    add = always(lambda before, row: added(metrics, before, {**silent, **dict(zip(log.columns, row, strict=True))}))
    for row in rows.tolist():
        summed = add(summed, tuple(row))
    values = [float(one.value) if len(rows) and math.isfinite(one.value) else None for one in summed]
    return {one.full_name: value for one, value in zip(metrics, values, strict=True)}


RMSE, LARGEST = with_unit(MEAN_DISTANCE, "m"), with_unit(FARTHEST, "m")
"""The metrics that every plant has, the first two of its scores."""


class Score(NamedTuple):
    """The sums over the samples so far. sums: of each metric of `SCORED`. own: of those that the mission names."""

    samples: Number
    sums: tuple[Sums, ...]
    own: tuple[RunningMetric, ...] = ()


class ScoredCycle(NamedTuple):
    """The cycle of the scored loop, and its score."""

    flight: Cycle
    score: Score


@dataclass(frozen=True)
class ScoredLoop:
    """A loop and the sums over it. begin: the time from which samples count [s]. own: metrics of the user's own.

    What is summed comes from its `position_error`, `inputs` and `weight_norms`.
    """

    loop: Loop
    begin: float = 0.0
    own: tuple[Metric, ...] = ()

    @property
    def columns(self) -> Mapping[str, str]:
        return self.loop.columns

    @property
    def tasks(self) -> tuple[Task, ...]:
        return (*(Task(task.name, lifted_task(task)) for task in self.loop.tasks), Task("score", self.score))

    def start(self, start: tuple[object, ...], parameters: Numbers) -> ScoredCycle:
        cycle = self.loop.start(start, parameters)
        now = {"error": Vector(()), "inputs": self.loop.inputs(cycle), "norms": self.loop.weight_norms(cycle)}
        sums = tuple(one.sums.start(now[one.quantity]) for one in SCORED)
        return ScoredCycle(cycle, Score(0.0, sums, started(self.own)))

    def advance(self, cycle: ScoredCycle, parameters: Numbers, clock: Clock) -> ScoredCycle:
        return cycle._replace(flight=self.loop.advance(cycle.flight, parameters, clock))

    def row(self, cycle: ScoredCycle, parameters: Numbers, time: Number) -> list[Number]:
        return self.loop.row(cycle.flight, parameters, time)

    def score(self, cycle: ScoredCycle, parameters: Numbers, clock: Clock) -> tuple[ScoredCycle, Number]:
        before = cycle.score
        now = {
            "error": self.loop.position_error(cycle.flight, parameters, clock.time),
            "inputs": self.loop.inputs(cycle.flight),
            "norms": self.loop.weight_norms(cycle.flight),
        }
        known = where(before.samples > 0.0, 1.0, 0.0)  # the first sample changes nothing
        score = Score(
            samples=before.samples + 1.0,
            sums=tuple(sums.add(now[one.quantity], known) for one, sums in zip(SCORED, before.sums, strict=True)),
            own=self.own_sums(cycle, parameters, clock) if self.own else (),
        )
        if self.begin > 0.0:
            counts = clock.time >= self.begin
            kept = [where(counts, new, old) for new, old in zip(flatten(score), flatten(before), strict=True)]
            score = rebuild(score, iter(kept))
        return cycle._replace(score=score), 0.0

    def own_sums(self, cycle: ScoredCycle, parameters: Numbers, clock: Clock) -> tuple[RunningMetric, ...]:
        """The user's own metrics, updated with the row that the log would have now."""
        row = self.row(cycle, parameters, clock.time)
        return added(self.own, cycle.score.own, dict(zip(self.columns, row, strict=True)))


def lifted_task(task: Task) -> Callable[[ScoredCycle, Numbers, Clock], tuple[ScoredCycle, Number]]:
    """A task of the loop, applied to the cycle that contains the loop's."""

    def run(cycle: ScoredCycle, parameters: Numbers, clock: Clock) -> tuple[ScoredCycle, Number]:
        flight, code = task.run(cycle.flight, parameters, clock)
        return cycle._replace(flight=flight), code

    return run


def scored(
    loop: Loop, ticks: Ticks, period: float, begin: float = 0.0, own: tuple[Metric, ...] = ()
) -> tuple[ScoredLoop, Ticks]:
    """The loop with a score every `period` [s] from `begin` [s] on, rounded to whole steps, and the clock for both.

    There are no rows but the first.
    """
    every = max(1, round(period / ticks.step))
    begin = max(0.0, begin - 0.5 * ticks.step)
    return ScoredLoop(loop, begin, own), ticks._replace(every=(*ticks.every, every), log=ticks.last + 1)


def score_names(plant: Plant, own: Iterable[Metric] = ()) -> tuple[str, ...]:
    """The names that `metrics` returns for a plant, with units. own: the user's own metrics."""
    return (*score_names_of(plant.efforts, plant.norms), *(one.full_name for one in own))


def names_without_units(names: Iterable[str]) -> dict[str, str]:
    """Metrics by their names without units."""
    return {name.partition("[")[0]: name for name in names}


def metrics(score: Score) -> NDArray[np.float64]:
    """The metrics of many flights, shape (flights, metrics) as `score_names` has them, from a score of arrays.

    NaN where a flight ended before its first sample.
    """
    samples = np.asarray(score.samples, dtype=np.float64)
    with np.errstate(invalid="ignore", divide="ignore"):
        found = [np.asarray(value, dtype=np.float64) for sums in score.sums for value in sums.values(samples)]
    own = [np.asarray(one.value, dtype=np.float64) for one in score.own]
    return np.where(samples > 0, np.stack([*found, *own]), np.nan).T

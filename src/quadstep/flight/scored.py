"""Metrics summed while flying, so that a flight leaves a handful of numbers instead of a log.

`Scored` is a closed loop around another: its cycle is the other's and the sums so far, its last task adds a sample to them.
It flies on every engine.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadstep.flight.closed_loop import Clock, Task, Ticks
from quadstep.flight.loop import Loop
from quadstep.flight.own_metric import Metric, Summed, added, started
from quadstep.flight.plant import Plant
from quadstep.numbers import Number, Vector, absolute, flatten, maximum, rebuild, where

RMSE, LARGEST = "position_rmse[m]", "largest_error[m]"
"""The metrics that every plant has, the first two of its scores."""


class Score(NamedTuple):
    """Sums over the samples so far.

    squares: of the distance from the path [m^2]; largest: of them. efforts: sums of each input's square; variations: of its
    changes' magnitudes; inputs: at the last sample. weight_norms: the largest of each net so far. own: what the
    user's own metrics are so far.
    """

    samples: Number
    squares: Number
    largest: Number
    efforts: Vector
    variations: Vector
    inputs: Vector
    weight_norms: Vector
    own: tuple[Summed, ...] = ()


class ScoredCycle(NamedTuple):
    """The cycle of the loop that is scored, and its score."""

    flight: Any
    score: Score


@dataclass(frozen=True)
class Scored:
    """A loop and the sums over it. begin: the time from which samples count [s]. own: metrics of the user's own.

    What is summed comes from its `position_error`, `inputs` and `weight_norms`.
    """

    loop: Loop
    begin: float = 0.0
    own: tuple[Metric, ...] = ()

    @property
    def columns(self) -> Mapping[str, str]:
        """Those of the loop."""
        return self.loop.columns

    @property
    def tasks(self) -> tuple[Task, ...]:
        """Those of the loop, then the score."""
        return (*(Task(task.name, within(task)) for task in self.loop.tasks), Task("score", self.score))

    def start(self, start: Any, parameters: Any) -> ScoredCycle:
        """Nothing summed."""
        cycle = self.loop.start(start, parameters)
        nothing, inputs, norms = 0.0, self.loop.inputs(cycle), self.loop.weight_norms(cycle)
        none, no_norms = Vector([nothing] * len(inputs)), Vector([nothing] * len(norms))
        return ScoredCycle(cycle, Score(nothing, nothing, nothing, none, none, none, no_norms, started(self.own)))

    def advance(self, cycle: ScoredCycle, parameters: Any, clock: Clock) -> ScoredCycle:
        """The loop's."""
        return cycle._replace(flight=self.loop.advance(cycle.flight, parameters, clock))

    def row(self, cycle: ScoredCycle, parameters: Any, time: Number) -> list[Number]:
        """The loop's."""
        return self.loop.row(cycle.flight, parameters, time)

    def score(self, cycle: ScoredCycle, parameters: Any, clock: Clock) -> tuple[ScoredCycle, Number]:
        """One more sample."""
        before, inputs = cycle.score, self.loop.inputs(cycle.flight)
        error = self.loop.position_error(cycle.flight, parameters, clock.time)
        square = error @ error
        known = where(before.samples > 0.0, 1.0, 0.0)  # the first sample changes nothing
        changes = [known * absolute(now - last) for now, last in zip(inputs, before.inputs, strict=True)]
        norms = zip(self.loop.weight_norms(cycle.flight), before.weight_norms, strict=True)
        score = Score(
            samples=before.samples + 1.0,
            squares=before.squares + square,
            largest=maximum(square, before.largest),
            efforts=before.efforts + inputs * inputs,
            variations=before.variations + Vector(changes),
            inputs=inputs,
            weight_norms=Vector(maximum(norm, largest) for norm, largest in norms),
            own=self.own_sums(cycle, parameters, clock) if self.own else (),
        )
        if self.begin > 0.0:
            counts = clock.time >= self.begin
            kept = [where(counts, new, old) for new, old in zip(flatten(score), flatten(before), strict=True)]
            score = rebuild(score, iter(kept))
        return cycle._replace(score=score), 0.0

    def own_sums(self, cycle: ScoredCycle, parameters: Any, clock: Clock) -> tuple[Summed, ...]:
        """The user's own metrics, told the row that the log would have now."""
        row = self.row(cycle, parameters, clock.time)
        return added(self.own, cycle.score.own, dict(zip(self.columns, row, strict=True)))


def within(task: Task) -> Any:
    """What a task of the loop does to the cycle around it."""

    def run(cycle: ScoredCycle, parameters: Any, clock: Clock) -> tuple[ScoredCycle, Number]:
        flight, code = task.run(cycle.flight, parameters, clock)
        return cycle._replace(flight=flight), code

    return run


def scored(loop: Loop, ticks: Ticks, period: float, begin: float = 0.0, own: tuple[Metric, ...] = ()) -> tuple[Scored, Ticks]:
    """The loop with a score every `period` [s] from `begin` [s] on, rounded to whole steps, and the clock for both.

    There are no rows but the first.
    """
    every = max(1, round(period / ticks.step))
    begin = max(0.0, begin - 0.5 * ticks.step)
    return Scored(loop, begin, own), ticks._replace(every=(*ticks.every, every), log=ticks.last + 1)


def score_names(plant: Plant, own: Iterable[Metric] = ()) -> tuple[str, ...]:
    """What `metrics` gives of a plant, with units. own: metrics of the user's own."""
    inputs = [f"{name}[{unit}]" for name, unit in plant.efforts.items()]
    efforts, variations = ([f"{what}_{name}" for name in inputs] for what in ("effort", "variation"))
    return (
        RMSE,
        LARGEST,
        *efforts,
        *variations,
        *(f"largest_{name}" for name in plant.norms),
        *(one.full_name for one in own),
    )


def bare(names: Iterable[str]) -> dict[str, str]:
    """Metrics by their names without units."""
    return {name.partition("[")[0]: name for name in names}


def metrics(score: Score) -> NDArray[np.float64]:
    """The metrics of many flights, shape (flights, metrics) as `score_names` has them, from a score of arrays.

    position_rmse, largest_error: of the distance from the path. effort: root mean square of an input. variation: sum of
    |changes| of an input from sample to sample. NaN where a flight ended before its first sample.
    """
    samples, squares, largest = (np.asarray(part, dtype=np.float64) for part in score[:3])
    efforts, variations, norms = (np.array(list(part), dtype=np.float64) for part in (score[3], score[4], score[6]))
    own = [np.asarray(one.value, dtype=np.float64) for one in score.own]
    with np.errstate(invalid="ignore", divide="ignore"):
        means = np.sqrt(np.stack([squares, *efforts]) / samples)
        rest = np.where(samples > 0, np.stack([np.sqrt(largest), *variations, *norms, *own]), np.nan)
    return np.concatenate([means[:1], rest[:1], means[1:], rest[1:]]).T

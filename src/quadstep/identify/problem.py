"""Predictions of many starts in the engine, and their errors against the measurements."""

from collections.abc import Sequence
from typing import cast

import numpy as np

from quadstep.engines.loop import Numbers
from quadstep.engines.scored import Scored
from quadstep.engines.sweep import Sweep, places
from quadstep.identify.logs.flight import FlightRecord, Floats
from quadstep.identify.parameters import PREFIX, Free, leaf_values, placed
from quadstep.identify.predictor import Prediction, Predictor, PredictorParameters
from quadstep.identify.starts import Laid, Starts, States, constant, differences, logged, norms
from quadstep.interfaces.closed_loop import Ticks


class PredictionBatch:
    """Predictions from many starts, with some numbers free."""

    def __init__(
        self, loop: Predictor, period: float, starts: Starts, parameters: PredictorParameters, free: Sequence[Free] = ()
    ) -> None:
        self.loop, self.starts, self.parameters, self.free = loop, starts, parameters, free
        names = ["first", "history", *(leaf for one in free for leaf in one.leaves)]
        ticks = Ticks(period, (1,), 10**9, int(starts.history.max()) + max(loop.horizons))
        start: tuple[()] = ()
        scored = cast(Scored, loop)  # its score is the result
        given = cast(Numbers, parameters)  # nor is there a controller
        where = places(start, given, [PREFIX + name for name in names])
        self.sweep = Sweep(scored, ticks, start, given, where, double=True)

    def run(self, points: Sequence[Floats]) -> tuple[Floats, Floats]:
        """States (points, horizons, n, 13) and unexplained angular accelerations, trends and forces (points, n, 9)."""
        base = np.stack([self.starts.first, self.starts.history], axis=1).astype(float)
        count = len(base)
        values = [np.concatenate([base, np.tile(leaf_values(point, self.free), (count, 1))], axis=1) for point in points]
        score = cast(Prediction, self.sweep.fly(np.concatenate(values)).score)
        states = np.array([list(one) for one in score.states]).reshape(len(self.loop.horizons), 13, len(points), count)
        rest = np.array([entry for part in score.unexplained for entry in part]).reshape(9, len(points), count)
        return states.transpose(2, 0, 3, 1), rest.transpose(1, 2, 0)


def as_states(values: Floats) -> States:
    """The 13 numbers of predictions, shape (n, 13)."""
    return States(values[:, :3], values[:, 3:6], values[:, 6:10], values[:, 10:])


class PredictionProblem:
    """Prediction errors by group and horizon, relative to the errors of the baseline "constant".

    by_flight: whether relative to those of each flight, so that calm flights count as much as lively ones; else to the mean.
    """

    def __init__(
        self, loop: Predictor, flights: Sequence[FlightRecord], laid: Laid, starts: Starts,
        parameters: PredictorParameters, free: Sequence[Free], by_flight: bool = False,
    ) -> None:  # fmt: skip
        self.flights, self.starts = flights, starts
        self.period = flights[0].period
        self.batch = PredictionBatch(loop, self.period, starts, parameters._replace(rows=laid.rows), free)
        now = logged(flights, starts, 0)
        self.truth = [logged(flights, starts, horizon) for horizon in loop.horizons]
        plain = [constant(now, horizon * self.period) for horizon in loop.horizons]
        guesses = zip(plain, self.truth, strict=True)
        lengths = np.array([norms(guess, truth) for guess, truth in guesses])
        self.scales = np.broadcast_to(lengths.mean(axis=2, keepdims=True), lengths.shape).copy()
        if by_flight:
            for number in range(len(flights)):
                mine = starts.flight == number
                self.scales[..., mine] = lengths[..., mine].mean(axis=2, keepdims=True)

    def residuals(self, points: Sequence[Floats]) -> Floats:
        """Shape (points, horizons, groups, n, 3)."""
        states, _ = self.batch.run(points)
        found = np.empty((len(points), len(self.truth), 4, states.shape[2], 3))
        for i, one in enumerate(states):
            for h, truth in enumerate(self.truth):
                parts = differences(as_states(one[h]), truth)
                for g, part in enumerate(parts):
                    found[i, h, g] = part / self.scales[h, g][:, None]
        return np.nan_to_num(found, nan=1e3, posinf=1e3, neginf=-1e3).clip(-1e3, 1e3)

    def at(self, point: Floats) -> PredictorParameters:
        return placed(self.batch.parameters, self.batch.free, point)

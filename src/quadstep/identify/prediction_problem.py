"""Predictions of many starts in the engine, and the parameters of least mean distance to what was measured.

By Gauss-Newton with Levenberg-Marquardt damping; derivatives by finite differences in the engine.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple, cast

import numpy as np

from quadstep.engines.loop import Numbers
from quadstep.engines.scored import ScoredLoop
from quadstep.engines.sweep import Sweep, places
from quadstep.identify.logs.flight import FlightRecord, Floats
from quadstep.identify.parameters import PREFIX, Free, leaf_values, leaves_of, placed
from quadstep.identify.prediction import Prediction, Predictor, PredictorParameters
from quadstep.identify.starts import JoinedFlights, Starts, States, constant, differences, logged, norms
from quadstep.interfaces.closed_loop import Ticks
from quadstep.io.errors import UserError

BEGUN = ("first", "history")
"""Leaves that tell the starts apart."""


class PredictionBatch:
    """Predictions from many starts, with some numbers free. To the engine all are: so one code serves whatever a fit frees."""

    def __init__(
        self, loop: Predictor, period: float, starts: Starts, parameters: PredictorParameters, free: Sequence[Free] = ()
    ) -> None:
        self.loop, self.starts, self.parameters, self.free = loop, starts, parameters, free
        self.given = {name: value for name, value in leaves_of(parameters).items() if name not in BEGUN}
        ticks = Ticks(period, (1,), 10**9, int(starts.history.max()) + max(loop.horizons))
        start: tuple[()] = ()
        scored = cast(ScoredLoop, loop)  # its score is the result
        given = cast(Numbers, parameters)  # nor is there a controller
        where = places(start, given, [PREFIX + name for name in (*BEGUN, *self.given)])
        self.sweep = Sweep(scored, ticks, start, given, where, double=True)

    def run(self, points: Sequence[Floats]) -> tuple[Floats, Floats]:
        """States (points, horizons, n, 13) and unexplained angular accelerations, trends and forces (points, n, 9)."""
        base = np.stack([self.starts.first, self.starts.history], axis=1).astype(float)
        count = len(base)
        leaves = [[*(self.given | leaf_values(self.free, point)).values()] for point in points]
        values = [np.concatenate([base, np.tile(one, (count, 1))], axis=1) for one in leaves]
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
        self, loop: Predictor, flights: Sequence[FlightRecord], laid: JoinedFlights, starts: Starts,
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


CORE = 0.15
"""Distances below this share of the error of "constant" count quadratically, larger ones linearly."""

DAMPING = (0.1, 1.0, 10.0, 100.0, 1e3, 1e4)
LARGEST_STEP = 10.0
"""Largest change of one parameter in one step, in its scales."""

ENOUGH = 2e-4
"""Share of the cost by which a step must improve for the search to continue."""


class Prior(NamedTuple):
    """Prior of some parameters: mean on the search's scale, and standard deviation."""

    places: Sequence[int]
    centre: Floats
    deviation: Floats


class ErrorWeights(NamedTuple):
    """Weight of each horizon, and of each group."""

    horizons: Floats
    groups: Floats

    @property
    def table(self) -> Floats:
        """Shape (horizons, groups)."""
        return np.outer(self.horizons, self.groups)


class Curvature(NamedTuple):
    """Around the best point, on the search's scale: gradients (n, parameters) and Hessians (n, parameters, parameters) of each
    start, and the Hessian of all with the prior.
    """

    gradients: Floats
    hessians: Floats
    hessian: Floats


FitProgress = Callable[[int, float], None]


def lengths(residuals: Floats) -> Floats:
    """Smoothed distances sqrt(|r|^2 + core^2), shape (..., n)."""
    return np.sqrt((residuals * residuals).sum(axis=-1) + CORE * CORE)


def cost(residuals: Floats, weights: ErrorWeights) -> float:
    """The weighted mean of the distances of one point."""
    return float((weights.table[..., None] * lengths(residuals)).mean(axis=-1).sum())


def prior_cost(point: Floats, prior: Prior | None, count: int) -> float:
    """The cost of deviating from the prior, relative to `count` starts."""
    if prior is None:
        return 0.0
    off = (point[list(prior.places)] - prior.centre) / prior.deviation
    return float(0.5 * (off * off).sum() / count)


def scales(free: Sequence[Free]) -> Floats:
    return np.array([one.scale for one in free])


def derivatives(problem: PredictionProblem, point: Floats) -> tuple[Floats, Floats]:
    """Residuals (horizons, groups, n, 3), and their derivatives (..., parameters) by each parameter over its scale."""
    size = scales(problem.batch.free)
    share = 1e-4
    points = [point, *(point + share * size * row for row in np.eye(len(point)))]
    found = problem.residuals(points)
    return found[0], np.moveaxis((found[1:] - found[0]) / share, 0, -1)


def normal_equations(residuals: Floats, slopes: Floats, weights: ErrorWeights) -> tuple[Floats, Floats]:
    """Gradient and Hessian of the mean, as in iteratively reweighted least squares."""
    count = residuals.shape[2]
    weight = weights.table[..., None] / lengths(residuals) / count
    flat = slopes.reshape(-1, slopes.shape[-1])
    weighted = np.repeat(weight.reshape(-1), 3)
    gradient = flat.T @ (weighted * residuals.reshape(-1))
    return gradient, flat.T @ (weighted[:, None] * flat)


def search(
    problem: PredictionProblem, point: Floats, weights: ErrorWeights, rounds: int, prior: Prior | None = None,
    told: FitProgress | None = None,
) -> Floats:  # fmt: skip
    size, damping = scales(problem.batch.free), 1e-3
    count = problem.residuals([point]).shape[3]
    for turn in range(rounds):
        residuals, slopes = derivatives(problem, point)
        before = cost(residuals, weights) + prior_cost(point, prior, count)
        gradient, hessian = normal_equations(residuals, slopes, weights)
        if prior is not None:
            for place, centre, deviation in zip(prior.places, prior.centre, prior.deviation, strict=True):
                stiff = (size[place] / deviation) ** 2 / count
                hessian[place, place] += stiff
                gradient[place] += stiff * (point[place] - centre) / size[place]
        diagonal = np.diag(hessian) + 1e-9 * np.trace(hessian)
        tried = [damping * factor for factor in DAMPING]
        candidates = []
        for one in tried:
            step = -solved(hessian + np.diag(one * diagonal), gradient)
            candidates.append(point + size * np.clip(step, -LARGEST_STEP, LARGEST_STEP))
        results = problem.residuals(candidates)
        costs = [cost(one, weights) + prior_cost(x, prior, count) for one, x in zip(results, candidates, strict=True)]
        best = int(np.argmin(costs))
        gained = before - costs[best]
        if gained > 0.0:
            point, damping = candidates[best], max(tried[best], 1e-7)
        else:
            damping *= 100.0
        if told:
            told(turn, min(before, costs[best]))
        if gained < ENOUGH * before and (gained > 0.0 or damping > 1e3) and turn > 3:
            break
    return point


def curvature(problem: PredictionProblem, point: Floats, weights: ErrorWeights, prior: Prior | None = None) -> Curvature:
    """Around a point: exact second derivatives of the distance, the model taken as linear."""
    residuals, slopes = derivatives(problem, point)
    distance = lengths(residuals)
    weight = weights.table[..., None] / distance
    gradients = np.einsum("hgn,hgni,hgnip->np", weight, residuals, slopes, optimize=True)
    along = np.einsum("hgni,hgnip->hgnp", residuals, slopes, optimize=True) / distance[..., None]
    first = np.einsum("hgn,hgnip,hgniq->npq", weight, slopes, slopes, optimize=True)
    second = np.einsum("hgn,hgnp,hgnq->npq", weight, along, along, optimize=True)
    hessians = first - second
    hessian = hessians.sum(axis=0)
    size = scales(problem.batch.free)
    if prior is not None:
        for place, deviation in zip(prior.places, prior.deviation, strict=True):
            hessian[place, place] += (size[place] / deviation) ** 2
    return Curvature(gradients / size, hessians / np.outer(size, size), hessian / np.outer(size, size))


def solved(matrix: Floats, right: Floats) -> Floats:
    """The solution of a linear system. Raises UserError where predictions do not depend on some parameter any more."""
    try:
        return np.asarray(np.linalg.solve(matrix, right), dtype=np.float64)
    except np.linalg.LinAlgError:
        raise UserError(
            "the fit breaks down: predictions no longer depend on the parameters; do --vehicle and its mass suit the vehicle "
            "that flew?"
        ) from None

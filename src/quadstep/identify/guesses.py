"""Where a fit begins: the starts that it predicts from, what averages say, priors, and first values by trial."""

import math
from collections.abc import Sequence
from itertools import product

import numpy as np

from quadstep.identify.averages import AverageEstimate, HalfSeconds, blocks
from quadstep.identify.intervals import FROM_AVERAGES, averaged
from quadstep.identify.logs.flight import FlightRecord, Floats
from quadstep.identify.mean_forces import Variant
from quadstep.identify.parameters import Free, point_of
from quadstep.identify.prediction import Predictor, PredictorParameters
from quadstep.identify.prediction_problem import ErrorWeights, PredictionProblem, Prior, cost
from quadstep.identify.starts import Starts, laid_out, starts_at, usable
from quadstep.io.errors import UserError
from quadstep.mission.airframe import AirframeSection
from quadstep.vehicle.rigid_body import Effects

SHORT, LONG = (1, 3), (1, 3, 10, 25, 50)
"""Horizons [samples] of the vehicle's fit and of the predictor's."""

MOST_STARTS = 800
EFFECTS = Effects(battery=False, ground=False, gyroscopic=True, drag=True)
SURE = ("drag.rotor[0]",)
"""Parameters that averages determine so well that predictions only refine them; lag errors distort axial drag and flapping."""

VAGUE = 1.0
"""Prior standard deviation of a parameter's logarithm if only its start value is known."""


def problem_of(
    flights: Sequence[FlightRecord], vehicle: AirframeSection, p: PredictorParameters, horizons: tuple[int, ...],
    free: Sequence[Free], guided: bool = False,
) -> PredictionProblem:  # fmt: skip
    """Predictions of some flights. Raises UserError if none can be made."""
    laid = laid_out(flights, guided)
    whole = [usable(flight, horizons) for flight in flights]
    stride = max(1, math.ceil(sum(len(rows) for rows in whole) / MOST_STARTS))  # evenly over all flights
    starts: Starts = starts_at(flights, laid, [rows[::stride] for rows in whole])
    if len(starts.row) < 30:
        names = ", ".join(flight.name for flight in flights)
        raise UserError(f"{names}: {len(starts.row)} segments of uninterrupted flight; a fit needs at least 30")
    loop = Predictor(vehicle.geometry(), EFFECTS, horizons, flights[0].speeds)
    return PredictionProblem(loop, flights, laid, starts, p, free, by_flight=horizons == LONG)


def from_averages(
    flights: Sequence[FlightRecord], vehicle: AirframeSection, p: PredictorParameters, given: tuple[str, ...] = ()
) -> tuple[PredictorParameters, dict[str, AverageEstimate], dict[str, str], HalfSeconds | None]:
    """p with the parameters that averages determine; why the others stay; and the averages. given: as in `Variant`."""
    block = blocks(flights, float(p.curve.delay), float(p.airframe.rotor.rise), float(p.airframe.gravity))
    if block is None:
        return p, {}, dict.fromkeys(FROM_AVERAGES, "not enough uninterrupted flight"), None
    return *averaged(block, p, vehicle.geometry(), flights[0].speeds, variant=Variant(given=given)), block


def priors(free: Sequence[Free], p: PredictorParameters, averages: dict[str, AverageEstimate]) -> Prior:
    """Priors: from averages for free parameters that they determine, vague ones at the start for the vehicle's others."""
    places, centres, deviations = [], [], []
    start = point_of(p, free)
    for place, one in enumerate(free):
        if one.key.startswith("prediction.") or not one.logarithmic:
            continue
        places.append(place)
        known = averages.get(one.key) if one.key in SURE else None
        if known and known.value > 0.0 and known.error < known.value:
            centres.append(math.log(known.value))
            deviations.append(max(known.error / known.value, 1e-3))
        else:
            centres.append(float(start[place]))
            deviations.append(VAGUE)
    return Prior(places, np.array(centres), np.array(deviations))


def first_guess(problem: PredictionProblem, point: Floats, weights: ErrorWeights) -> Floats:
    """The best of several lags, delays and inertias, as the start of the search."""
    keys = [one.key for one in problem.batch.free]
    tries = [point]
    for lag, delay, factor in product((0.02, 0.05, 0.12), (0.0, 0.02), (0.6, 1.0, 2.0)):
        guess = point.copy()
        guess[keys.index("rotor.rise_time")] = math.log(lag)
        guess[keys.index("command.delay")] = delay
        guess[[keys.index("inertia[0]"), keys.index("inertia[1]")]] += math.log(factor)
        tries.append(guess)
    residuals = problem.residuals(tries)
    middle = np.median(np.linalg.norm(residuals, axis=-1), axis=-1)
    costs = (weights.table * np.minimum(middle, 1e2)).sum(axis=(1, 2))
    return tries[int(np.argmin(costs))]


def limits_guess(problem: PredictionProblem, point: Floats, weights: ErrorWeights) -> Floats:
    """The point with the best of several limits of acceleration and tilt; with its own where the flights reach none.

    A search alone does not find them: beyond the largest acceleration and tilt their derivatives are zero.
    """
    keys = [one.key for one in problem.batch.free]
    tries = [point]
    for reach, steepest in product((1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0, 10.0, 15.0), (0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.7, 1.0)):
        guess = point.copy()
        guess[keys.index("prediction.reach")] = math.log(reach)
        guess[keys.index("prediction.steepest")] = math.log(steepest)
        tries.append(guess)
    costs = [cost(residuals, weights) for residuals in problem.residuals(tries)]
    return tries[int(np.argmin(costs))]

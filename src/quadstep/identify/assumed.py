"""By how much fitted numbers move with what a fit assumes: lag, delay, exponent and structure of averages, inertia about z."""

import math
from collections.abc import Sequence

import numpy as np

from quadstep.identify.guesses import SHORT, from_averages, problem_of
from quadstep.identify.intervals import UNKNOWN_EXPONENT, by_structure, with_values
from quadstep.identify.logs.flight import FlightRecord, Floats
from quadstep.identify.parameters import Free, point_of
from quadstep.identify.prediction import PredictorParameters
from quadstep.identify.prediction_problem import ErrorWeights, Prior, search
from quadstep.mission.airframe import AirframeSection

SHORT_WEIGHTS = ErrorWeights(np.array([1.0, 1.0]), np.array([0.1, 0.3, 0.3, 3.0]))
"""Of horizons, and of position, velocity, attitude, rates."""

UNSURE = math.log(2.0)
"""Half of a logarithm's interval from which on a parameter counts as undetermined."""

REFITTED = 6
"""Most steps of a search for the other parameters once those that are not determined are back at their values."""

GIVEN_WRONG = 1.0 / 0.75
"""Factor by which the given inertia about z may be wrong for the intervals of the others to hold."""

MOST_DELAY = 0.02
"""Largest half of the delay's interval within which numbers from averages are tried [s]."""


def by_rotors(
    flights: Sequence[FlightRecord], vehicle: AirframeSection, p: PredictorParameters, every: Sequence[Free], halves: Floats
) -> dict[str, float]:
    """By how much numbers from averages move, on the search's scale, within the intervals of the rotors' lag and delay, of the
    command's exponent where flights do not determine it (at another one the same hover has another full speed), and between
    structures that the flights do not tell apart.

    Averages take the commands as the rotors follow them, so that where the vehicle wobbles, what is not known of the lag is
    not known of the thrust's curve either.
    """
    keys = [one.key for one in every]
    lag, delay = (float(halves[keys.index(key)]) for key in ("rotor.rise_time", "command.delay"))
    rise, late = float(p.airframe.rotor.rise), float(p.curve.delay)
    factor = math.exp(min(lag, UNSURE))
    others: list[dict[str, float]] = [
        dict.fromkeys(("airframe.rotor.rise", "airframe.rotor.fall"), rise * factor),
        dict.fromkeys(("airframe.rotor.rise", "airframe.rotor.fall"), rise / factor),
        {"curve.delay": late + min(delay, MOST_DELAY)},
        {"curve.delay": max(late - delay, 0.0)},
    ]
    bent = math.exp(2.0 * UNKNOWN_EXPONENT)
    others += [{"curve.exponent": float(p.curve.exponent) * factor} for factor in (bent, 1.0 / bent)]
    (_, base, _, block), *rest = (from_averages(flights, vehicle, with_values(p, one)) for one in ({}, *others))
    moved = [one[1] for one in rest]
    apart = by_structure(block, p, base, vehicle.geometry(), flights[0].speeds) if block else {}
    told_exponent = "command.exponent" in base or flights[0].speeds
    linear = [one.key for one in every if not one.logarithmic]
    found: dict[str, float] = {}
    for key, told in base.items():
        shifts = [abs(one[key].value - told.value) if key in one else 0.0 for one in moved]
        by_lag, by_delay, by_bend = max(shifts[:2]), max(shifts[2:4]), 0.0 if told_exponent else max(shifts[4:])
        found[key] = (math.hypot(by_lag, by_delay, by_bend) + apart[key]) / (
            1.0 if key in linear else max(abs(told.value), 1e-300)
        )
    return found


def by_yaw_inertia(
    flights: Sequence[FlightRecord], vehicle: AirframeSection, p: PredictorParameters, free: Sequence[Free], prior: Prior
) -> Floats:
    """By how much the best values move beyond proportion, on the search's scale, if the vehicle's inertia about z, which is
    never fitted, is wrong by `GIVEN_WRONG` either way.
    """
    shares = np.array(["J_z" in one.grows for one in free])
    moves = []
    for step in (math.log(GIVEN_WRONG), -math.log(GIVEN_WRONG)):
        other = with_values(p, {"airframe.inertia.2": float(p.airframe.inertia[2]) * math.exp(step)})
        start = point_of(other, free) + step * shares
        problem = problem_of(flights, vehicle, other, SHORT, free)
        moves.append(np.abs(search(problem, start, SHORT_WEIGHTS, REFITTED, prior) - start))
    return np.maximum(*moves)

"""The fit: averages first, then short predictions for the vehicle, then long ones for the predictor."""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from quadstep.identify.averages import AverageEstimate, HalfSeconds
from quadstep.identify.guesses import LONG, SHORT, SURE, first_guess, from_averages, limits_guess, priors, problem_of
from quadstep.identify.intervals import (
    AVERAGED,
    DYNAMIC,
    FROM_AVERAGES,
    IN_STEP,
    UNKNOWN_EXPONENT,
    StandardErrors,
    by_structure,
    noise_bias,
    of_lateness,
    part_of_row,
    standard_errors,
    with_values,
)
from quadstep.identify.logs.flight import FlightRecord, Floats
from quadstep.identify.mean_forces import wind_lean
from quadstep.identify.parameters import ANSWERS, GAINS, GUIDANCE, LIMITS, Free, before_fit, leaves_of, point_of, values_at
from quadstep.identify.prediction import PredictorParameters
from quadstep.identify.prediction_problem import ErrorWeights, Prior, curvature, search
from quadstep.identify.starts import setpoint_of
from quadstep.mission.airframe import AirframeSection
from quadstep.numbers import vector
from quadstep.vehicle.airframe_plant import Observer

SHORT_WEIGHTS = ErrorWeights(np.array([1.0, 1.0]), np.array([0.1, 0.3, 0.3, 3.0]))
LONG_WEIGHTS = ErrorWeights(np.array([1.0, 0.7, 1.0, 0.7, 1.0]), np.array([0.3, 1.0, 1.0, 2.0]))
"""Weights of horizons, and of position, velocity, attitude, rates."""


UNSURE = math.log(2.0)
"""Half of a logarithm's interval from which on a parameter counts as undetermined."""

UNSURE_SCALES = 25.0
"""The same for other parameters, in their scales."""

REFITTED = 6
"""Most steps of a search for the other parameters once those that are not determined are back at their values."""

UNKNOWN_UPRIGHT = 0.3
"""Half of the interval of the logarithm of the given inertia about z: that of an estimate from a data sheet (25 %)."""

LATE = ("rotor.rise_time", "command.delay")
"""What makes a loop late together."""

MOST_DELAY = 0.02
"""Largest half of the delay's interval within which numbers from averages are tried [s]."""

UNDETERMINED = "not determined by these flights"
WINDY = "a light wind would make the vehicle lean in the same way; turn it in flight, or pass --still-air if there was no wind"

CHECKED = ("drag.rotor[2]", "drag.flapping")
"""Parameters from predictions that averages determine too, in another way."""

EXPLAINED = {
    "command.speed": "mean thrust over half a second",
    "command.exponent": "mean thrust over half a second, within flights",
    "command.voltage_exponent": "mean thrust over half a second, within flights",
    "imu.tilt": "mean specific force over half a second",
    "centre_of_gravity": "mean torque over half a second",
}


Say = Callable[[str], None]


class Fitted(NamedTuple):
    """A fitted parameter: value, the ends of its 95 % interval, unit, and source."""

    value: float
    low: float
    high: float
    unit: str
    source: str

    @property
    def either_sign(self) -> bool:
        """Whether not even its sign is determined."""
        return self.low < 0.0 < self.high

    @property
    def unsure(self) -> bool:
        """Whether a positive number is undetermined."""
        return self.high > math.exp(2.0 * UNSURE) * self.low


class Identified(NamedTuple):
    """Result of a fit. numbers: of the vehicle, and of the predictor from commands alone. guided: the observer that also knows
    setpoints, if the flights have them. fitted: by key. kept: keys that keep their values, with the reason. late: rotor lag
    and delay together, if both are fitted.
    """

    numbers: PredictorParameters
    guided: Observer | None
    fitted: dict[str, Fitted]
    kept: dict[str, str]
    late: Fitted | None = None


def identify(
    flights: Sequence[FlightRecord], vehicle: AirframeSection, say: Say, earlier: Identified | None = None,
    predictors: bool = True, still: bool = False,
) -> Identified:  # fmt: skip
    """Fit a vehicle to flights. earlier: the result of fitting the same vehicle to some of them, to start from. predictors:
    whether to fit them too. still: whether no wind blew, as in a hall.

    Raises UserError where the flights are too few.
    """
    start, start_guided = (earlier.numbers, earlier.guided) if earlier else (None, None)
    p, fresh = before_fit(vehicle, flights), start is None
    p = start._replace(observer=p.observer) if start else p  # that of long predictions is far from that of short ones
    p, told, why, block = from_averages(flights, vehicle, p)
    if fresh and "drag.rotor[0]" in told:
        p = with_values(p, dict.fromkeys(("airframe.drag.rotor.0", "airframe.drag.rotor.1"), told["drag.rotor[0]"].value))
    if fresh and "drag.flapping" in told:
        p = with_values(p, {"airframe.drag.flapping": max(told["drag.flapping"].value, 1e-12)})
    still_air = vector(0.0, 0.0)
    alone = p.observer._replace(authority=vector(1.0, 1.0), leak=still_air, spring=0.0, path=0.0, drift=0.0, delay=0.0)
    p = p._replace(observer=alone)  # without its model of the control loop: commands are trusted fully
    free = (*DYNAMIC, *GAINS)
    short = problem_of(flights, vehicle, p, SHORT, free)
    prior = priors(free, p, told)
    point = point_of(p, free)
    if fresh:
        point = first_guess(short, point, SHORT_WEIGHTS)
    say("vehicle")
    point = search(short, point, SHORT_WEIGHTS, 14 if fresh else 8, prior)
    if fresh:  # the lag is known now, so the averages are better
        p, told, why, block = from_averages(flights, vehicle, short.at(point))
        short = problem_of(flights, vehicle, p, SHORT, free)
        prior = priors(free, p, told)
        point = search(short, point, SHORT_WEIGHTS, 8, prior)
    p = short.at(point)
    fitted, kept, both = fitted_numbers(flights, vehicle, p, free, prior, told, block, still)
    kept.update(why)
    p, fitted = anew(flights, vehicle, p, free, told, fitted, kept)
    late = about(both, sum(fitted[key].value for key in LATE)) if fitted.keys() >= {*LATE} else None
    if not predictors:
        return Identified(p, None, fitted, kept, late)
    say("predictor")
    begun = p.observer._replace(leak=vector(3.0, 3.0), authority=vector(0.6, 0.6)) if start is None else start.observer
    p = predictor(flights, vehicle, p._replace(observer=begun), (*GAINS, *ANSWERS), 12 if fresh else 3)
    guided = None
    if all(setpoint_of(flight)[flight.flying, 3].mean() > 0.9 for flight in flights):
        say("predictor with setpoints")
        begun = start_guided or p.observer._replace(leak=vector(8.0, 5.0), spring=50.0, path=5.0, drift=3.5)
        knowing = p._replace(observer=begun)
        if fresh:
            knowing = predictor(flights, vehicle, knowing, (*GAINS, *ANSWERS, *GUIDANCE), 8, True)
        free = (*GAINS, *ANSWERS, *GUIDANCE, *LIMITS)
        guided = predictor(flights, vehicle, knowing, free, 6 if fresh else 3, True).observer
    return Identified(p, guided, fitted, kept, late)


def anew(
    flights: Sequence[FlightRecord], vehicle: AirframeSection, p: PredictorParameters, free: Sequence[Free],
    averages: dict[str, AverageEstimate], fitted: dict[str, Fitted], kept: dict[str, str],
) -> tuple[PredictorParameters, dict[str, Fitted]]:  # fmt: skip
    """The parameters with what is not determined as it was; the others, whose best values depend on that, are fitted to it."""
    before, now = leaves_of(before_fit(vehicle, flights)), leaves_of(p)
    p = with_values(p, {leaf: before[leaf] for one in free if one.key in kept for leaf in one.leaves})
    values: dict[str, float] = {}
    back = {leaf: before[leaf] for key, leaf in FROM_AVERAGES.items() if key in kept and key.endswith("exponent")}
    if back.items() - now.items() or {*LATE} & kept.keys():  # averages take commands with these
        p, averages, _, _ = from_averages(flights, vehicle, with_values(p, back), tuple(kept))
        values |= {key: one.value for key, one in averages.items() if key in FROM_AVERAGES}
    if rest := tuple(one for one in free if one.key not in kept):
        short = problem_of(flights, vehicle, p, SHORT, rest)
        p = short.at(search(short, point_of(p, rest), SHORT_WEIGHTS, REFITTED, priors(rest, p, averages)))
        values |= zip((one.key for one in rest), values_at(point_of(p, rest), rest), strict=True)
    p = with_values(p, {leaf: before[leaf] for one in AVERAGED if one.key in kept for leaf in one.leaves})
    moved = {key: about(one, values.get(key, one.value)) for key, one in fitted.items()}
    # one that ends where the search does is not determined either: its interval is cut off there
    ends = {one.key for one in free if one.key in moved and moved[one.key].value > 0.999 * one.high}
    scales = {one.key for one in free if one.logarithmic}
    if lost := [key for key, one in moved.items() if key in ends or (key in scales and one.unsure)]:
        kept.update(dict.fromkeys(lost, UNDETERMINED))
        return anew(flights, vehicle, p, free, averages, {key: one for key, one in fitted.items() if key not in lost}, kept)
    return p, moved


def predictor(
    flights: Sequence[FlightRecord], vehicle: AirframeSection, p: PredictorParameters, free: Sequence[Free], rounds: int,
    guided: bool = False,
) -> PredictorParameters:  # fmt: skip
    """The parameters with an observer fitted to predictions of up to about half a second."""
    problem = problem_of(flights, vehicle, p, LONG, free, guided)
    point = point_of(p, free)
    if LIMITS[0] in free:
        point = limits_guess(problem, point, LONG_WEIGHTS)
    return problem.at(search(problem, point, LONG_WEIGHTS, rounds))


def about(one: Fitted, value: float) -> Fitted:
    """A parameter at another value, with an interval that holds both."""
    return one._replace(value=value, low=min(one.low, value), high=max(one.high, value))


def in_step(free: Sequence[Free], point: Floats, errors: StandardErrors, averages: dict[str, AverageEstimate]) -> float:
    """The share of the pulls on predictions that are in step: as large as it takes for the axial drag that they give to be
    that of the averages, to which it hardly matters how commands change between the rows of a log.
    """
    place = [one.key for one in free].index(CHECKED[0])
    average, pull = averages.get(CHECKED[0]), float(errors.pulls[place])
    if average is None or average.value < 2.0 * average.error or pull == 0.0:
        return IN_STEP
    apart = abs(float(point[place]) - math.log(average.value))
    chance = 2.0 * math.hypot(float(errors.errors[place]), average.error / average.value)
    return min(max((apart - chance) / pull, IN_STEP), 1.0)


def below(share: float) -> float:
    """How far a logarithm falls where the number falls by a share of itself, which is more than it rises for the same."""
    return -math.log1p(-min(share, 0.999))


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
    lag, delay = (float(halves[keys.index(key)]) for key in LATE)
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


def by_upright(
    flights: Sequence[FlightRecord], vehicle: AirframeSection, p: PredictorParameters, free: Sequence[Free], prior: Prior
) -> Floats:
    """By how much numbers move, on the search's scale and beyond what is in proportion, with the inertia about z, which no
    flight reveals: where a vehicle rolls while it yaws, the pitch that this causes is taken for another inertia.
    """
    every = (*free, Free("inertia[2]", ("airframe.inertia.2",), "kg m^2"))
    around = curvature(problem_of(flights, vehicle, p, SHORT, every), point_of(p, every), SHORT_WEIGHTS, prior).hessian
    slopes = -np.linalg.pinv(around[:-1, :-1]) @ around[:-1, -1]
    return UNKNOWN_UPRIGHT * np.abs(slopes - np.array(["J_z" in one.grows for one in free]))


def fitted_numbers(
    flights: Sequence[FlightRecord], vehicle: AirframeSection, p: PredictorParameters, free: Sequence[Free], prior: Prior,
    told: dict[str, AverageEstimate], block: HalfSeconds | None, still: bool,
) -> tuple[dict[str, Fitted], dict[str, str], Fitted]:  # fmt: skip
    """Every parameter of the vehicle that the flights determine, with its interval; the others with the reason; and lag and
    delay together.
    """
    every = (*free, *AVERAGED)
    problem = problem_of(flights, vehicle, p, SHORT, every)
    point, starts, period = point_of(p, every), problem.starts, problem.period
    around = curvature(problem, point, SHORT_WEIGHTS, prior)
    sure = [(place, free[place].key) for place in prior.places if free[place].key in SURE and free[place].key in told]
    here = part_of_row(starts.flight, starts.row, period)
    there = part_of_row(block.flight, block.row, period) if block is not None else here
    found = standard_errors(around, prior, sure, told, here, block, there, p, vehicle.geometry(), flights[0].speeds, free)
    wider = noise_bias(flights, vehicle.geometry(), every)
    wider[: len(free)] += by_upright(flights, vehicle, p, free, prior)
    by_chance, slopes = found.halves(in_step(every, point, found, told)), of_lateness(p, every)
    halves, late = by_chance[:-1] + wider, by_chance[-1] + slopes @ wider
    moved = by_rotors(flights, vehicle, p, every, halves) if told else {}
    lean = 0.0 if still or block is None else wind_lean(block)
    levers = lean * float(p.airframe.drag.flapping / p.airframe.drag.rotor[0])  # of the torque of the wind that leans it
    small = set()
    for place, one in enumerate(every):
        if one.key not in moved or one.key not in told:
            continue
        average, more = told[one.key], moved[one.key]
        if one.key in FROM_AVERAGES or one.key in SURE:
            by_wind = {"imu.tilt": lean, "centre_of_gravity": levers}.get(one.key[:-3], 0.0)
            halves[place] += more + by_wind
        if one.key in (*SURE, *CHECKED):  # the interval holds that of the averages too
            chance = 2.0 * math.hypot(average.error, 0.5 * more * abs(average.value))
            if average.value <= chance:
                small.add(one.key)
                continue
            apart = abs(float(point[place]) - math.log(average.value))
            halves[place] = max(halves[place], apart + below(chance / average.value))
    fitted: dict[str, Fitted] = {}
    kept: dict[str, str] = {}
    for one, x, value, half in zip(every, point, values_at(point, every), halves, strict=True):
        averages = one.key in FROM_AVERAGES
        if one.key.startswith("prediction.") or (averages and one.key not in told):
            continue
        if half > (UNSURE if one.logarithmic else UNSURE_SCALES * one.scale):
            kept[one.key] = WINDY if one.key.startswith(("imu.tilt", "centre_of_gravity")) and lean > 0.0 else UNDETERMINED
            continue
        if one.key in small:
            kept[one.key] = "too small to be distinguished from zero"
            continue
        low, high = x - half, x + half
        ends = (math.exp(low), math.exp(min(high, 700.0))) if one.logarithmic else (max(low, one.low), min(high, one.high))
        source = EXPLAINED[one.key.partition("[")[0]] if averages else "predictions of 1 and 3 samples"
        fitted[one.key] = Fitted(value, ends[0], ends[1], one.unit, source)
    both = float(p.airframe.rotor.rise + p.curve.delay)
    return fitted, kept, Fitted(both, max(0.0, both - late), both + late, "s", "predictions of 1 and 3 samples")

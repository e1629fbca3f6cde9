"""`quadstep replay`: a vehicle's predictions compared with logged flights, and predictions written to a file.

The table of a replay has mean errors beside those of "constant" and "zero rate", with intervals over flights.
"""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadstep.identify.averages import rotor_speeds
from quadstep.identify.filtered_logs import Estimated, estimate
from quadstep.identify.flown_setpoints import FlightComparison, fly_again, span_of_thrust
from quadstep.identify.guesses import EFFECTS
from quadstep.identify.logs.flight import FlightRecord, Floats
from quadstep.identify.logs.judge import FASTER, SLOWEST
from quadstep.identify.parameters import numbers_of
from quadstep.identify.prediction import Predictor, PredictorParameters
from quadstep.identify.prediction_problem import PredictionBatch, as_states
from quadstep.identify.starts import (
    GROUPS,
    HISTORY,
    HORIZONS,
    MASKED_HISTORY,
    Starts,
    States,
    constant,
    laid_out,
    logged,
    norms,
    setpoint_of,
    starts_at,
    usable,
    voltage_of,
    zero_rate,
)
from quadstep.io.documents import read_json
from quadstep.io.errors import UserError
from quadstep.metrics.statistics import Estimate, mean
from quadstep.mission.airframe import AirframeSection
from quadstep.vehicle.airframe_plant import Observer

MOST_PREDICTIONS = 20_000


class ErrorTable(NamedTuple):
    """Mean errors of each flight, shape (horizons, groups, flights): of the predictions, of "constant", of "zero rate".
    guided: whether predictions knew the setpoints.
    """

    names: tuple[str, ...]
    horizons: tuple[int, ...]
    predicted: Floats
    constant: Floats
    zero: Floats
    starts: int
    guided: bool = False

    @property
    def knows(self) -> str:
        """What predictions were made from."""
        return "commands and setpoints" if self.guided else "commands alone"

    def ratio(self, horizon: int, group: str, to: str = "constant") -> Estimate:
        """The mean of the flights' ratios, with its interval over flights."""
        h, g = self.horizons.index(horizon), GROUPS.index(group)
        base = self.constant if to == "constant" else self.zero
        return mean(self.predicted[h, g] / base[h, g])

    def means(self, horizon: int, group: str) -> tuple[float, float, float]:
        """Mean error over flights of the prediction, of "constant" and of "zero rate"."""
        h, g = self.horizons.index(horizon), GROUPS.index(group)
        return tuple(float(one[h, g].mean()) for one in (self.predicted, self.constant, self.zero))  # type: ignore[return-value]


def predictions(
    flights: Sequence[FlightRecord], vehicle: AirframeSection, p: PredictorParameters, rows: Sequence[NDArray[np.int64]],
    horizons: tuple[int, ...] = HORIZONS, guided: bool = False, longest: int = HISTORY,
) -> tuple[Starts, list[States], Floats]:  # fmt: skip
    """Where predictions from these rows of each flight start, the states at each horizon, and what stays unexplained, as of
    `PredictionBatch.run`.
    """
    laid = laid_out(flights, guided)
    starts = starts_at(flights, laid, rows, longest)
    loop = Predictor(vehicle.geometry(), EFFECTS, horizons, flights[0].speeds)
    batch = PredictionBatch(loop, flights[0].period, starts, p._replace(rows=laid.rows))
    states, rest = batch.run([np.zeros(0)])
    return starts, [as_states(one) for one in states[0]], rest[0]


def why_unusable(flights: Sequence[FlightRecord]) -> str:
    """Why nothing can be predicted in some flights."""
    lost = float(np.mean(np.concatenate([flight.lost for flight in flights])))
    if lost > 0.5:
        above = any((flight.motors > 1.0).any() and not flight.speeds for flight in flights)
        what = "are above the full one, `full` in the mapping" if above else "are missing: the motors were off, or not logged"
        return f"{100.0 * lost:.0f} % of the motor commands {what}"
    if not any(flight.turning.any() for flight in flights):
        return "the motors never ran"
    period = min(flight.period for flight in flights)
    if period > SLOWEST:
        return f"a motor command every {1e3 * period:.0f} ms, too few for a prediction: {FASTER}"
    return "less than a second of uninterrupted, measured flight"


def compare(
    flights: Sequence[FlightRecord], vehicle: AirframeSection, p: PredictorParameters, guided: bool = False,
    horizons: tuple[int, ...] = HORIZONS,
) -> ErrorTable:  # fmt: skip
    """Predictions from all over some flights against the measurements. guided: whether they may use setpoints."""
    rows = [usable(flight, horizons) for flight in flights]
    stride = max(1, -(-sum(map(len, rows)) // MOST_PREDICTIONS))
    rows = [one[::stride] for one in rows]
    kept = [i for i, one in enumerate(rows) if len(one)]
    if not kept:
        raise UserError(f"{', '.join(flight.name for flight in flights)}: {why_unusable(flights)}")
    flights, rows = [flights[i] for i in kept], [rows[i] for i in kept]
    starts, states, _ = predictions(flights, vehicle, p, rows, horizons, guided)
    period, now = flights[0].period, logged(flights, starts, 0)
    shape = (len(horizons), len(GROUPS), len(flights))
    found = [np.empty(shape) for _ in range(3)]
    for h, (horizon, state) in enumerate(zip(horizons, states, strict=True)):
        truth = logged(flights, starts, horizon)
        for place, guess in enumerate((state, constant(now, horizon * period), zero_rate(now, horizon * period))):
            lengths = norms(guess, truth)
            for i in range(len(flights)):
                found[place][h, :, i] = lengths[:, starts.flight == i].mean(axis=1)
    still = np.argwhere(found[1] * found[2] == 0.0)
    if len(still):
        name, group = flights[still[0, 2]].name, GROUPS[still[0, 1]]
        raise UserError(f"{name}: {group}: exactly as if nothing acted on the vehicle: no measurement, and nothing to predict")
    return ErrorTable(tuple(one.name for one in flights), horizons, found[0], found[1], found[2], len(starts.row), guided)


ENOUGH = 0.9
"""Share of the flight that must have setpoints for predictions to use them."""


def ready(
    flights: Sequence[FlightRecord], vehicle: AirframeSection, commands_only: bool = False
) -> tuple[PredictorParameters, bool]:
    """The parameters of a vehicle for these flights, and whether predictions use setpoints. Raises UserError."""
    rotors = len(vehicle.geometry().mounts)
    for flight in flights:
        if flight.motors.shape[1] != rotors:
            raise UserError(f"{flight.name}: {flight.motors.shape[1]} motors in the log, the vehicle has {rotors} rotors")
        whole = {"position": "position", "velocity": "velocity", "attitude": "attitude about all axes", "rates": "rates"}
        missing = " and ".join(f"no {one}" for name, one in whole.items() if name not in flight.channels)
        if missing:
            raise UserError(f"{flight.name}: {missing} in the log, which can be checked, but neither fitted nor predicted")
        if ("voltage" in flight.channels) != ("voltage" in flights[0].channels):
            raise UserError(
                f"{flight.name}: the voltage was logged in some flights only; use either those with it or those without"
            )
        if abs(flight.period - flights[0].period) > 0.02 * flights[0].period:
            raise UserError(
                f"{flight.name}: a row every {flight.period:g} s, but {flights[0].name} has one every {flights[0].period:g} s"
            )
    p = numbers_of(vehicle, flights)
    seen = [setpoint_of(flight)[:, 3][flight.flying] for flight in flights]
    guided = bool(vehicle.guided_prediction) and not commands_only and all(len(s) and s.mean() > ENOUGH for s in seen)
    if guided and vehicle.guided_prediction:
        p = p._replace(observer=vehicle.guided_prediction.as_numbers(Observer))
    return p, guided


def read_starts(path: Path, flights: Sequence[FlightRecord]) -> dict[str, NDArray[np.int64]]:
    """Rows, counted from 0, from which to predict, by flight: {"flight": [row, ...]}. Raises UserError.

    A flight is named like its file, with or without the extension. The object may be nested under a key "starts".
    """
    content = read_json(path)
    if isinstance(content, dict) and isinstance(content.get("starts"), dict):
        content = content["starts"]
    if not isinstance(content, dict):
        raise UserError(f"{path}: should be an object of flights, each with a list of rows to start from")
    known = {flight.name: flight for flight in flights}
    found: dict[str, NDArray[np.int64]] = {}
    for name, rows in content.items():
        flight = known.get(name) or known.get(str(Path(name).with_suffix("")))
        if flight is None:
            continue
        if not isinstance(rows, list) or not all(isinstance(row, int) and not isinstance(row, bool) for row in rows):
            raise UserError(f"{path}: {name}: should be a list of whole numbers, the rows to start from")
        wrong = [row for row in rows if not 0 <= row < flight.rows]
        if wrong:
            raise UserError(f"{path}: {name}: row {wrong[0]}, but the log has rows 0 to {flight.rows - 1}")
        unmeasured = [row for row in rows if not flight.measured[row]]
        if unmeasured:
            raise UserError(
                f"{path}: {name}: row {unmeasured[0]}: the state was not measured there, so no prediction can start from it"
            )
        found[name] = np.array(rows, dtype=np.int64)
    if not found:
        raise UserError(f"{path}: does not name any of the flights {', '.join(known)}")
    return found


def predictions_of(
    flights: Sequence[FlightRecord], vehicle: AirframeSection, p: PredictorParameters, starts: dict[str, NDArray[np.int64]],
    guided: bool,
) -> dict[str, object]:  # fmt: skip
    """Predictions from given rows as lists: p, v, q (x, y, z, w) and w, each [start][horizon]."""
    known = {flight.name: flight for flight in flights}
    result: dict[str, object] = {}
    for name, rows in starts.items():
        flight = known.get(name) or known[str(Path(name).with_suffix(""))]
        if not len(rows):
            result[name] = {key: [] for key in "pvqw"}
            continue
        _, states, _ = predictions([flight], vehicle, p, [rows], guided=guided, longest=MASKED_HISTORY)
        parts = [(one.position, one.velocity, one.attitude[:, [1, 2, 3, 0]], one.rates) for one in states]
        stacked = zip("pvqw", zip(*parts, strict=True), strict=True)
        result[name] = {key: np.stack(values, axis=1).tolist() for key, values in stacked}
    return result


def as_json(content: dict[str, object]) -> str:
    return json.dumps(content, allow_nan=False) + "\n"


DRAWN_HORIZONS = (1, 2, 5, 10, 20, 50)
"""Samples ahead that a report shows; those of `HORIZONS` among them."""


class ReplayRequest(NamedTuple):
    """What is asked of some flights. vehicle: its name. controller: its keys. report: whether to find all that one shows."""

    vehicle: str
    section: AirframeSection
    controller: dict[str, object] | None
    estimator: bool
    commands_only: bool
    residual: bool
    report: bool


class Predictions(NamedTuple):
    """Errors of predictions; title: what they know."""

    title: str
    compared: ErrorTable


class Replayed(NamedTuple):
    """What is found. thrust: modelled over needed, least and most, if known. period: of the rows [s]. laws: what exported laws
    logged of themselves, in sentences.
    """

    period: float
    predictions: list[Predictions]
    thrust: tuple[float, float] | None
    flown: list[FlightComparison]
    estimates: list[Estimated]
    laws: Sequence[str] = ()


def replayed(flights: Sequence[FlightRecord], request: ReplayRequest) -> Replayed:
    """All that is asked; predictions where nothing else is, and for a report. Raises UserError."""
    estimates = [estimate(flight) for flight in flights] if request.estimator else []
    flown = fly_again(list(flights), request.section, request.controller) if request.controller else []
    if not request.report and (request.estimator or request.controller):
        return Replayed(flights[0].period, [], None, flown, estimates)
    thrust = span_of_thrust(flights, request.section)
    laws = [said for one in flights if (said := law_of(one, request.section))]
    return Replayed(flights[0].period, predicted_errors(flights, request), thrust, flown, estimates, laws)


def predicted_errors(flights: Sequence[FlightRecord], request: ReplayRequest) -> list[Predictions]:
    """Errors of the vehicle's predictions, and of those with its learned residual."""
    horizons = DRAWN_HORIZONS if request.report else HORIZONS
    numbers, guided = ready(flights, request.section, request.commands_only)
    found = compare(flights, request.section, numbers, guided, horizons)
    several = [Predictions(f"Predictions from {found.knows}", found)]
    if request.residual:
        effects = request.section.effects.model_copy(update={"residual": True})
        section = request.section.model_copy(update={"effects": effects})
        numbers, guided = ready(flights, section, request.commands_only)
        again = compare(flights, section, numbers, guided, horizons)
        several.append(Predictions(f"The same with the learned residual, from {again.knows}", again))
    return several


def law_of(flight: FlightRecord, section: AirframeSection) -> str:
    """What an exported law logged of itself, in a sentence; empty where none flew."""
    periods, rejected = flight.channel("law_samples").T
    flew = np.isfinite(periods)
    if not flew.any():
        return ""
    said = f"{flight.name}: an exported law flew {flew.sum() * flight.period:.1f} s of it, its samples up to about"
    said += f" {1e3 * periods[flew].max():.3g} ms apart, {rejected[flew].max():.0f} of them rejected"
    asked = flight.channel("law_thrust")[:, 0]
    p = numbers_of(section, [flight])
    speeds = rotor_speeds(flight.motors, voltage_of(flight), p.curve, flight.speeds)
    ratios = (p.airframe.rotor.thrust * speeds**2).sum(axis=1) / asked
    known = ratios[np.isfinite(ratios)]
    made = f"; the logged commands make {np.median(known):.3f} times the thrust that it asked for" if len(known) else ""
    return f"{said}{made}."

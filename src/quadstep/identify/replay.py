"""`quadstep replay`: a vehicle's predictions compared with logged flights, and predictions written to a file."""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from quadstep.identify.logs.flight import FlightRecord
from quadstep.identify.parameters import numbers_of
from quadstep.identify.predictor import PredictorParameters
from quadstep.identify.starts import MASKED_HISTORY, setpoint_of
from quadstep.identify.table import predicted
from quadstep.io.documents import read_json
from quadstep.io.errors import UserError
from quadstep.mission.airframe import AirframeSection

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
        missing = [name for name in ("position", "velocity", "attitude", "rates") if name not in flight.channels]
        if missing:
            raise UserError(
                f"{flight.name}: no {' and no '.join(missing)} in the log; a prediction needs the complete initial state"
            )
        if ("voltage" in flight.channels) != ("voltage" in flights[0].channels):
            raise UserError(
                f"{flight.name}: the voltage was logged in some flights only; take those with it, or those without"
            )
        if abs(flight.period - flights[0].period) > 0.02 * flights[0].period:
            raise UserError(
                f"{flight.name}: a row every {flight.period:g} s, but {flights[0].name} has one every {flights[0].period:g} s"
            )
    p = numbers_of(vehicle, flights)
    seen = [setpoint_of(flight)[:, 3][flight.flying] for flight in flights]
    guided = bool(vehicle.guided_prediction) and not commands_only and all(len(s) and s.mean() > ENOUGH for s in seen)
    if guided and vehicle.guided_prediction:
        p = p._replace(observer=vehicle.guided_prediction.build())
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
        _, states = predicted([flight], vehicle, p, [rows], guided=guided, longest=MASKED_HISTORY)
        stacked = {
            "p": [state.position for state in states],
            "v": [state.velocity for state in states],
            "q": [state.attitude[:, [1, 2, 3, 0]] for state in states],
            "w": [state.rates for state in states],
        }
        result[name] = {key: np.stack(values, axis=1).tolist() for key, values in stacked.items()}
    return result


def as_json(content: dict[str, object]) -> str:
    """The file of predictions."""
    return json.dumps(content, allow_nan=False) + "\n"

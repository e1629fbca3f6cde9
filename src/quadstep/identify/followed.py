"""A flight followed by a vehicle's laws: their predictions, the residuals, and the unexplained accelerations."""

from typing import NamedTuple

import numpy as np

from quadstep.identify.errors import HORIZONS, States, logged
from quadstep.identify.fit import EFFECTS
from quadstep.identify.logs.flight import FlightRecord, Floats
from quadstep.identify.predictor import Predictor, PredictorParameters
from quadstep.identify.problem import PredictionBatch, as_states
from quadstep.identify.starts import laid_out, starts_at, usable
from quadstep.mission.airframe import AirframeSection

LONGEST = 20.0
"""Longest stretch that is followed [s]."""


class Followed(NamedTuple):
    """Rows of a flight, one after the other. time (n,) [s]: of the flight. measured, predicted: states a horizon after each
    row, by horizon. torque, force (n, 3): angular acceleration [rad/s^2] and acceleration [m/s^2] that the laws do not
    explain, body axes; turning (n, 3): the angular acceleration that was measured.
    """

    name: str
    period: float
    time: Floats
    measured: dict[int, States]
    predicted: dict[int, States]
    torque: Floats
    force: Floats
    turning: Floats


def followed(flight: FlightRecord, vehicle: AirframeSection, p: PredictorParameters) -> Followed | None:
    """The longest stretch of a flight that can be predicted from each row, at most `LONGEST`; None where it is under 3 s."""
    rows = usable(flight, HORIZONS)
    pieces = np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1)
    chosen = max(pieces, key=len)[: round(LONGEST / flight.period)]
    if len(chosen) * flight.period < 3.0:
        return None
    laid = laid_out([flight])
    starts = starts_at([flight], laid, [chosen])
    batch = PredictionBatch(
        Predictor(vehicle.geometry(), EFFECTS, HORIZONS, flight.speeds), flight.period, starts, p._replace(rows=laid.rows)
    )
    states, rest = batch.run([np.zeros(0)])
    rates = flight.channel("rates")
    turning = (rates[chosen + 1] - rates[chosen - 1]) / (2.0 * flight.period)
    return Followed(
        flight.name,
        flight.period,
        flight.time[chosen] - flight.time[0],
        {horizon: logged([flight], starts, horizon) for horizon in HORIZONS},
        {horizon: as_states(one) for horizon, one in zip(HORIZONS, states[0], strict=True)},
        rest[0][:, :3] + rest[0][:, 3:6],
        rest[0][:, 6:],
        turning,
    )

"""The table of a replay: mean errors beside "constant" and "zero rate", with intervals over flights."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadstep.identify.fit import EFFECTS
from quadstep.identify.logs.flight import FlightRecord, Floats
from quadstep.identify.logs.judge import FASTER, SLOWEST
from quadstep.identify.predictor import Predictor, PredictorParameters
from quadstep.identify.problem import PredictionBatch, as_states
from quadstep.identify.starts import (
    GROUPS,
    HISTORY,
    HORIZONS,
    Starts,
    States,
    constant,
    laid_out,
    logged,
    norms,
    starts_at,
    usable,
    zero_rate,
)
from quadstep.io.errors import UserError
from quadstep.metrics.statistics import Estimate, mean
from quadstep.mission.airframe import AirframeSection

MOST_PREDICTIONS = 20_000


class ErrorTable(NamedTuple):
    """Mean errors of each flight, shape (horizons, groups, flights): of the predictions, of "constant", of "zero rate"."""

    names: tuple[str, ...]
    horizons: tuple[int, ...]
    predicted: Floats
    constant: Floats
    zero: Floats
    starts: int

    def ratio(self, horizon: int, group: str, to: str = "constant") -> Estimate:
        """The mean of the flights' ratios, with its interval over flights."""
        h, g = self.horizons.index(horizon), GROUPS.index(group)
        base = self.constant if to == "constant" else self.zero
        return mean(self.predicted[h, g] / base[h, g])

    def means(self, horizon: int, group: str) -> tuple[float, float, float]:
        """Mean error over flights of the prediction, of "constant" and of "zero rate"."""
        h, g = self.horizons.index(horizon), GROUPS.index(group)
        return tuple(float(one[h, g].mean()) for one in (self.predicted, self.constant, self.zero))  # type: ignore[return-value]


def predicted(
    flights: Sequence[FlightRecord], vehicle: AirframeSection, p: PredictorParameters, rows: Sequence[NDArray[np.int64]],
    horizons: tuple[int, ...] = HORIZONS, guided: bool = False, longest: int = HISTORY,
) -> tuple[Starts, list[States]]:  # fmt: skip
    laid = laid_out(flights, guided)
    starts = starts_at(flights, laid, rows, longest)
    loop = Predictor(vehicle.geometry(), EFFECTS, horizons, flights[0].speeds)
    batch = PredictionBatch(loop, flights[0].period, starts, p._replace(rows=laid.rows))
    states, _ = batch.run([np.zeros(0)])
    return starts, [as_states(one) for one in states[0]]


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
    starts, states = predicted(flights, vehicle, p, rows, horizons, guided)
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
    return ErrorTable(tuple(flight.name for flight in flights), horizons, found[0], found[1], found[2], len(starts.row))

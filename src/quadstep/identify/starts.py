"""Where predictions start, the rows that they read, and their errors beside those of two predictions that need no model."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadstep.identify.logs.flight import FlightRecord, Floats
from quadstep.identify.logs.mapping import product
from quadstep.identify.prediction import LogTables
from quadstep.numbers import Table

HISTORY = 50
"""Rows before a start that a prediction follows, if there are as many without a gap."""

MASKED_HISTORY = 250
"""The same if some of them may be unmeasured."""


class Starts(NamedTuple):
    """Predictions: flight (its index), row (in that flight), and the global rows `first` and count `history`; each (n,)."""

    flight: NDArray[np.int64]
    row: NDArray[np.int64]
    first: NDArray[np.int64]
    history: NDArray[np.int64]


class JoinedFlights(NamedTuple):
    """Flights one after the other: their tables, and the global row that each begins at."""

    rows: LogTables
    offsets: NDArray[np.int64]


def laid_out(flights: Sequence[FlightRecord], guided: bool = False) -> JoinedFlights:
    """The tables of some flights, padded to a power of two so that few programs serve all lengths.

    guided: whether predictions may use setpoints.
    """
    lengths = [flight.rows for flight in flights]
    offsets = np.concatenate([[0], np.cumsum(lengths)[:-1]]).astype(np.int64)
    total = 1 << max(10, int(sum(lengths) - 1).bit_length())

    def table(values: Floats) -> Table:
        return Table(np.concatenate([values, np.full(total - len(values), values[-1])]))

    def tables(name: str) -> tuple[Table, ...]:
        values = np.concatenate([filled(flight, flight.channel(name)) for flight in flights])
        return tuple(table(column) for column in values.T)

    motors = np.concatenate([flight.motors for flight in flights])
    rows = LogTables(
        motors=tuple(table(column) for column in motors.T),
        voltage=table(np.concatenate([voltage_of(flight) for flight in flights])),
        position=tables("position"),
        velocity=tables("velocity"),
        attitude=tables("attitude"),
        rates=tables("rates"),
        measured=table(np.concatenate([flight.measured.astype(float) for flight in flights])),
        setpoint=tuple(table(column) for column in np.concatenate([setpoint_of(flight)[:, :2] for flight in flights]).T),
        guided=table(np.concatenate([float(guided) * setpoint_of(flight)[:, 3] for flight in flights])),
    )
    return JoinedFlights(rows, offsets)


def filled(flight: FlightRecord, values: Floats) -> Floats:
    """A channel with harmless placeholders where the state was not measured."""
    return np.where(flight.measured[:, None], values, 0.0)


def setpoint_of(flight: FlightRecord) -> Floats:
    """(n, 4): the setpoint [m], and 1 where the vehicle flies and had one, else 0. Where all three are 0 none was sent."""
    goal = flight.channel("setpoint")
    given = np.isfinite(goal).all(axis=1) & (goal != 0.0).any(axis=1)
    return np.column_stack([np.where(given[:, None], goal, 0.0), given.astype(float)])


def voltage_of(flight: FlightRecord) -> Floats:
    """The voltage of every row, the last known one where it is missing; 1 if it was never logged."""
    volts = flight.channel("voltage")[:, 0]
    known = np.isfinite(volts) & (volts > 0.0)
    if not known.any():
        return np.ones(flight.rows)
    latest = np.maximum.accumulate(np.where(known, np.arange(flight.rows), np.flatnonzero(known)[0]))
    return volts[latest]


def usable(flight: FlightRecord, horizons: Sequence[int], stride: int = 1) -> NDArray[np.int64]:
    """Rows from which predictions of so many samples can be compared with the log: flying, measured, without a gap."""
    runs, measured, flying, furthest = flight.runs(), flight.measured, flight.flying, max(horizons)
    rows = np.arange(0, flight.rows - furthest)
    fine = runs[rows + furthest] >= furthest + HISTORY
    for ahead in (0, *horizons):
        fine &= measured[rows + ahead]
    low = np.concatenate([[0], np.cumsum(~flying)])
    begin = np.maximum(rows - HISTORY, 0)
    fine &= (low[rows + furthest + 1] - low[begin]) == 0
    found = rows[fine]
    return found[::stride]


def starts_at(
    flights: Sequence[FlightRecord], laid: JoinedFlights, rows: Sequence[NDArray[np.int64]], longest: int = HISTORY
) -> Starts:
    """Predictions from these rows of each flight, each with up to `longest` rows of history, which is cut at the last gap and
    begins at a measured row.
    """
    parts = []
    for number, (flight, chosen) in enumerate(zip(flights, rows, strict=True)):
        history = np.minimum(np.minimum(flight.runs()[chosen], longest), chosen)
        known = np.flatnonzero(flight.measured)
        first = known[np.minimum(np.searchsorted(known, chosen - history), len(known) - 1)]
        first = np.minimum(first, chosen)
        parts.append((np.full(len(chosen), number), chosen, first + laid.offsets[number], chosen - first))
    flight_of, row, first, history = (np.concatenate(column).astype(np.int64) for column in zip(*parts, strict=True))
    return Starts(flight_of, row, first, history)


HORIZONS = (1, 10, 50)
GROUPS = ("position", "velocity", "attitude", "rates")


class States(NamedTuple):
    """States of many predictions, one row each; attitude (w, x, y, z)."""

    position: Floats
    velocity: Floats
    attitude: Floats
    rates: Floats


def logged(flights: Sequence[FlightRecord], starts: Starts, horizon: int) -> States:
    """The measured states `horizon` samples after each start."""
    parts = []
    for name in GROUPS:
        rows = [flight.channel(name)[starts.row[starts.flight == i] + horizon] for i, flight in enumerate(flights)]
        parts.append(np.concatenate(rows))
    return States(*parts)


def constant(now: States, time: float) -> States:
    """Baseline: velocity and rates stay constant."""
    speed = np.linalg.norm(now.rates, axis=1, keepdims=True)
    half = 0.5 * speed * time
    turn = np.concatenate([np.cos(half), np.sin(half) * now.rates / np.maximum(speed, 1e-12)], axis=1)
    return States(now.position + time * now.velocity, now.velocity, product(now.attitude, turn), now.rates)


def zero_rate(now: States, time: float) -> States:
    """Baseline: velocity stays constant, rates are zero."""
    return States(now.position + time * now.velocity, now.velocity, now.attitude, np.zeros_like(now.rates))


def differences(predicted: States, truth: States) -> list[Floats]:
    """Predicted minus true for each group, shape (n, 3); for attitudes the rotation between them [rad]."""
    turn = product(truth.attitude * np.array([1.0, -1.0, -1.0, -1.0]), predicted.attitude)
    sine = turn[:, 1:] * np.where(turn[:, :1] < 0.0, -1.0, 1.0)
    length = np.linalg.norm(sine, axis=1, keepdims=True)
    angle = 2.0 * np.arctan2(length, np.abs(turn[:, :1]))
    vectors = sine * np.where(length > 1e-12, angle / np.maximum(length, 1e-12), 2.0)
    return [predicted.position - truth.position, predicted.velocity - truth.velocity, vectors, predicted.rates - truth.rates]


def norms(predicted: States, truth: States) -> Floats:
    """Lengths of the differences, shape (groups, n)."""
    return np.stack([np.linalg.norm(part, axis=1) for part in differences(predicted, truth)])

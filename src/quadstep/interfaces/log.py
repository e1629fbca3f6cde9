"""The log of a flight: its rows, its outcome, and its final cycle."""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadstep.interfaces.closed_loop import Outcome, Ticks

SAID = frozenset(("psi_d", "theta_d", "phi_d", "yaw_d", "pitch_d", "roll_d"))
"""Columns of the attitude that a law desires: left out of the log if the law never reports it."""

REASONS = {
    Outcome.NOT_FINITE: "a number was no longer finite",
    Outcome.OFF_PATH: "too far from its path",
    Outcome.SINGULAR: "at a pitch near 90°, where the Euler angles are singular",
    Outcome.SPINNING: "turning too fast",
    Outcome.CRASHED: "it hit the ground",
}
"""Reasons why a flight ended early."""


class Limit(NamedTuple):
    """A limit that a flight passed. name: of the parameter. text: the reason, `{}` being the limit times `factor`."""

    name: str
    text: str
    factor: float = 1.0


LIMITS = {
    Outcome.OFF_PATH: Limit("limits.distance", "more than {} m from its path"),
    Outcome.SINGULAR: Limit("limits.pitch", "pitched beyond {}°, where the Euler angles are singular", math.degrees(1.0)),
    Outcome.SPINNING: Limit("limits.rate", "turning faster than {} rad/s"),
}
"""The reasons with their numbers, where the limits of the flight are known."""


class FlightLog(NamedTuple):
    """The log of a finished flight.

    columns: name and unit of each. rows: (samples, len(columns)), every value finite. outcome, and ended: its time [s].
    final: the cycle of floats at that time (state, controller memory with the weights, command).
    """

    columns: Mapping[str, str]
    rows: NDArray[np.float64]
    outcome: Outcome
    ended: float
    final: Any

    def column(self, name: str) -> NDArray[np.float64]:
        """One column by name. Raises KeyError with the available columns."""
        column: NDArray[np.float64] = self.table(name)[:, 0]
        return column

    def table(self, *names: str) -> NDArray[np.float64]:
        """Several columns by name, shape (samples, len(names)). Raises KeyError with the available columns."""
        known = list(self.columns)
        for name in names:
            if name not in self.columns:
                raise KeyError(f"the log has no column {name!r}; it has {', '.join(known)}")
        table: NDArray[np.float64] = self.rows[:, [known.index(name) for name in names]]
        return table


def finished(
    columns: Mapping[str, str], rows: NDArray[np.float64], code: float, tick: int, ticks: Ticks, final: object
) -> FlightLog:
    """The log of a flight that ended at `tick` with outcome `code`; rows from that tick on, and broken ones, are cut.

    There are no columns for a desired attitude that the law never reports.
    """
    outcome = Outcome(int(code))
    if outcome is not Outcome.COMPLETED:
        rows = rows[: -(-tick // ticks.log)]
    kept = [i for i, name in enumerate(columns) if not (name in SAID and len(rows) and np.isnan(rows[:, i]).all())]
    if len(kept) < len(columns):
        columns, rows = {name: unit for i, (name, unit) in enumerate(columns.items()) if i in kept}, rows[:, kept]
    broken = np.flatnonzero(~np.isfinite(rows).all(axis=1))
    if len(broken):
        outcome = Outcome.NOT_FINITE if outcome is Outcome.COMPLETED else outcome
        rows = rows[: broken[0]]
    return FlightLog(columns, rows, outcome, tick * ticks.step, final)

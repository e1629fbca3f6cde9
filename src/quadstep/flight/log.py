"""What is left of a flight: its rows, how it ended, and the cycle it ended with."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadstep.flight.closed_loop import Outcome, Ticks


class FlightLog(NamedTuple):
    """A flight as flown.

    columns: name and unit of each. rows: (samples, len(columns)), every value finite. outcome, and ended: when it came [s].
    final: the cycle of floats at that moment (state, controller memory with the weights, command).
    """

    columns: Mapping[str, str]
    rows: NDArray[np.float64]
    outcome: Outcome
    ended: float
    final: Any

    def column(self, name: str) -> NDArray[np.float64]:
        """One column by name."""
        column: NDArray[np.float64] = self.rows[:, list(self.columns).index(name)]
        return column

    def table(self, *names: str) -> NDArray[np.float64]:
        """Several columns by name, shape (samples, len(names))."""
        table: NDArray[np.float64] = self.rows[:, [list(self.columns).index(name) for name in names]]
        return table


def finished(
    columns: Mapping[str, str], rows: NDArray[np.float64], code: float, tick: int, ticks: Ticks, final: Any
) -> FlightLog:
    """The log of a flight that ended at `tick` with outcome `code`; rows from that tick on, and broken ones, are cut."""
    outcome = Outcome(int(code))
    if outcome is not Outcome.COMPLETED:
        rows = rows[: -(-tick // ticks.log)]
    broken = np.flatnonzero(~np.isfinite(rows).all(axis=1))
    if len(broken):
        outcome = Outcome.NOT_FINITE if outcome is Outcome.COMPLETED else outcome
        rows = rows[: broken[0]]
    return FlightLog(columns, rows, outcome, tick * ticks.step, final)

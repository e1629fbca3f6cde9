"""A span of flights of a campaign: drawn, built, flown, and laid out as a table with one row a flight."""

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from quadstep.campaign.draws import Drawn, draw
from quadstep.campaign.planner import Batch, Planner
from quadstep.campaign.schema import THRESHOLDS, Campaign
from quadstep.flight.closed_loop import Outcome
from quadstep.flight.scored import METRICS
from quadstep.flight.sweep import Sweep, Swept
from quadstep.numbers import Table, flatten

TYPICAL = 256
"""Flights from which the planner learns what can be built in one go: the first of the campaign, always the same."""

MOST_SWEEPS = 256
"""Kept ready."""

FLIGHT, OUTCOME, TIME, SUCCESS = "flight", "outcome", "time_of_failure[s]", "success"
OUTCOMES = tuple(outcome.name.lower().replace("_", "-") for outcome in Outcome)

Progress = Callable[[int], None]


class Sweeper(Protocol):
    """What flies a batch: `Sweep` or one that looks like it."""

    def fly(self, values: NDArray[np.float64], *, progress: Progress | None = None) -> Swept:
        """Fly a flight for each row of values."""
        ...


def planner(campaign: Campaign) -> Planner:
    """The planner of a campaign's flights."""
    file = campaign.file
    typical = draw(file, np.arange(TYPICAL))
    return Planner(
        campaign.content, campaign.defaults, campaign.source, campaign.folder, typical, file.seed, file.score_period
    )


class Flyer:
    """Flies spans of a campaign's flights. sweeper: what flies a batch, `Sweep` by its arguments."""

    def __init__(self, campaign: Campaign, sweeper: Callable[..., Sweeper] = Sweep) -> None:
        self.campaign, self.sweeper = campaign, sweeper
        self.planner = planner(campaign)
        self.sweeps: dict[Any, Sweeper] = {}

    def fly(self, first: int, past: int, progress: Progress | None = None) -> pa.Table:
        """The flights from `first` up to `past`. Raises UserError for values that cannot be flown."""
        file, flights = self.campaign.file, np.arange(first, past)
        drawn = draw(file, flights)
        outcome, ended = np.empty(len(flights), dtype=np.int8), np.empty(len(flights))
        metrics = np.empty((len(flights), len(METRICS)))
        for batch in self.planner.batches(flights, drawn):
            swept = self.sweep(batch).fly(batch.rows, progress=progress)
            outcome[batch.members], ended[batch.members] = swept.outcome, swept.ended
            metrics[batch.members] = swept.metrics
        return table(self.campaign, flights, drawn, outcome, ended, metrics)

    def rehearse(self) -> None:
        """Build the first flights, so that what cannot be flown is refused before anything is written. Raises UserError."""
        flights = np.arange(TYPICAL)
        for _ in self.planner.batches(flights, self.planner.typical):
            pass

    def sweep(self, batch: Batch) -> Sweeper:
        """What flies the flights of a batch, kept for the next one like it."""
        leaves = flatten((batch.start, batch.parameters))
        constants = tuple(
            tuple(leaf.values) if isinstance(leaf, Table) else leaf
            for place, leaf in enumerate(leaves)
            if place not in set(batch.places)
        )
        key = (batch.loop, batch.ticks, batch.places, constants)
        if key not in self.sweeps:
            if len(self.sweeps) >= MOST_SWEEPS:
                self.sweeps.pop(next(iter(self.sweeps)))
            self.sweeps[key] = self.sweeper(
                batch.loop, batch.ticks, batch.start, batch.parameters, batch.places, self.campaign.double
            )
        return self.sweeps[key]


def table(
    campaign: Campaign,
    flights: NDArray[np.int64],
    drawn: dict[str, Drawn],
    outcome: NDArray[np.int8],
    ended: NDArray[np.float64],
    metrics: NDArray[np.float64],
) -> pa.Table:
    """One row a flight; what a flight does not have is null, never NaN."""
    number = pa.float64() if campaign.file.precision == "f64" else pa.float32()
    lost = outcome != Outcome.COMPLETED
    success = ~lost
    columns: dict[str, Any] = {FLIGHT: pa.array(flights)}
    columns |= {name: pa.array(column.column()) for name, column in drawn.items()}
    columns[OUTCOME] = pa.DictionaryArray.from_arrays(pa.array(outcome), pa.array(OUTCOMES))
    columns[TIME] = pa.array(ended, mask=~lost)
    for name, values in zip(METRICS, metrics.T, strict=True):
        known = np.isfinite(values)
        limit = next((most for key, most in campaign.file.failure.items() if THRESHOLDS[key] == name), np.inf)
        success &= known & (values <= limit)
        with np.errstate(over="ignore", invalid="ignore"):
            columns[name] = pa.array(np.ascontiguousarray(values), mask=~known).cast(number, safe=False)
    columns[SUCCESS] = pa.array(success)
    return pa.table(columns)

"""The flights of an envelope's map, gathered cell by cell."""

import warnings
from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from quadstep.engines.scored import LARGEST, RMSE
from quadstep.metrics.statistics import Estimate, share
from quadstep.studies.campaign.draws import draw
from quadstep.studies.campaign.flyer import OUTCOME, OUTCOMES, SUCCESS, value_column
from quadstep.studies.campaign.pictures import QUANTILES
from quadstep.studies.envelope_request import Request
from quadstep.studies.study import Flown

FLYABLE = 0.95
"""The share of flights that must succeed for a cell to count as flyable."""


def needed(flights: int) -> int:
    """How many of so many flights must succeed for a cell to count as flyable."""
    return next(count for count in range(flights + 1) if count / flights >= FLYABLE)


def too_few(flights: int) -> str:
    return f"fewer than {needed(flights):,} of {flights:,} succeed"


OVER_LIMIT = "over-limit"
CAUSES = (OVER_LIMIT, *OUTCOMES[1:])
"""Why a flight does not succeed: it completed, but failed by a limit of the user's; or it ended early."""

MOSTLY = 0.5
"""The share of flights that must succeed for a cell to show its error."""

MEDIAN, MEAN = (RMSE.replace("[", f"_{what}[") for what in ("median", "mean"))


class Cells(NamedTuple):
    """Results of each cell, arrays over (panel, row, column).

    causes: of those that did not succeed how many by each of `CAUSES` (a fourth index). completed: how many completed. Of
    these rmse, mean: median and mean RMSE [m]; spread: its `QUANTILES` (a first index); largest: largest error [m]; NaN where
    missing. outcome: the most frequent. shown: the first flight that succeeds where at least `MOSTLY` do, elsewhere the first
    that does not. lacking: what graded flights that reach the end lack of being as commanded, by the numbers of their cells.
    """

    flights: int
    random: bool
    causes: NDArray[np.int64]
    completed: NDArray[np.int64]
    rmse: NDArray[np.float64]
    mean: NDArray[np.float64]
    largest: NDArray[np.float64]
    outcome: NDArray[np.int64]
    spread: NDArray[np.float64]
    shown: NDArray[np.int64] = np.zeros(0, dtype=np.int64)
    lacking: Mapping[int, tuple[str, ...]] = MappingProxyType({})

    @property
    def successes(self) -> NDArray[np.int64]:
        return self.flights - self.causes.sum(axis=-1)

    @property
    def cause(self) -> NDArray[np.int64]:
        """The most frequent of `CAUSES`, -1 where all succeed."""
        return np.where(self.causes.any(axis=-1), self.causes.argmax(axis=-1), -1)

    @property
    def crossed(self) -> list[int]:
        """Cells whose only flight reaches the end, but not as commanded, by number; none where that is all that are graded."""
        bad = [cell for cell, labels in self.lacking.items() if labels]
        return bad if self.flights == 1 and len(bad) < len(self.lacking) else []

    @property
    def share(self) -> NDArray[np.float64]:
        return self.successes / self.flights

    @property
    def flyable(self) -> NDArray[np.bool_]:
        """Where at least `FLYABLE` of them do."""
        return self.share >= FLYABLE


def cells_of(request: Request, flown: Flown) -> Cells:
    """The flights of a map gathered. Raises UserError for values that cannot be flown."""
    cells = request.cells
    causes = np.zeros((cells, len(CAUSES)), dtype=np.int64)
    outcomes = np.zeros((cells, len(OUTCOMES)), dtype=np.int64)
    rmse = np.full((request.flights, cells), np.nan)
    largest = np.full(cells, np.nan)
    ends = np.full((2, cells), request.flights)
    for (_, first, past), flights in flown:
        turn, cell = np.divmod(np.arange(first, past), cells)
        outcome = flights[OUTCOME].combine_chunks().indices.to_numpy().astype(np.int64)
        failed = ~flights[SUCCESS].to_numpy()
        np.add.at(outcomes, (cell, outcome), 1)
        np.add.at(causes, (cell[failed], outcome[failed]), 1)  # 0: it completed
        np.minimum.at(ends, (failed.astype(int), cell), turn)
        through = outcome == 0
        rmse[turn[through], cell[through]] = flights[RMSE].to_numpy().astype(np.float64)[through]
        np.fmax.at(largest, cell[through], flights[LARGEST].to_numpy().astype(np.float64)[through])
    spread, mean = middle(rmse)
    return Cells(
        flights=request.flights,
        random=request.random,
        causes=causes.reshape(*request.shape, -1),
        completed=outcomes[:, 0].reshape(request.shape),
        rmse=spread[1].reshape(request.shape),
        spread=spread.reshape(-1, *request.shape),
        mean=mean.reshape(request.shape),
        largest=largest.reshape(request.shape),
        outcome=outcomes.argmax(axis=1).reshape(request.shape),
        shown=cells * np.where(causes.sum(axis=1) <= (1.0 - MOSTLY) * request.flights, *ends) + np.arange(cells),
    )


def middle(values: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """`QUANTILES` and mean of each column without its NaN; NaN for a column of NaN."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        return np.nanquantile(values, QUANTILES, axis=0), np.nanmean(values, axis=0)


def table(request: Request, cells: Cells) -> pa.Table:
    """One row per cell; missing values are null. Without chance in a cell, its share is no estimate."""
    count = request.cells
    drawn = draw(request.campaign.file, np.arange(count))
    columns: dict[str, object] = {axis.key: value_column(drawn[axis.key]) for axis in reversed(request.axes)}
    known = {successes: interval(cells, successes) for successes in np.unique(cells.successes).tolist()}
    estimates = np.array([known[successes] for successes in cells.successes.ravel().tolist()])
    columns["flights"] = pa.array(np.full(count, cells.flights))
    columns["completed"] = pa.array(cells.completed.ravel())
    columns |= {
        name: pa.array(column) for name, column in zip(("success", "success_low", "success_high"), estimates.T, strict=True)
    }
    for name, values in zip((MEDIAN, MEAN, LARGEST), (cells.rmse, cells.mean, cells.largest), strict=True):
        columns[name] = pa.array(values.ravel(), mask=~np.isfinite(values.ravel()))
    columns["outcome"] = pa.array([OUTCOMES[place] for place in cells.outcome.ravel()]).dictionary_encode()
    columns["cause"] = pa.array([CAUSES[i] if i >= 0 else None for i in cells.cause.ravel()], pa.string()).dictionary_encode()
    return pa.table(columns)


def interval(cells: Cells, successes: int) -> Estimate:
    """The success rate of a cell with this many successes."""
    value = successes / cells.flights
    return share(successes, cells.flights) if cells.random else Estimate(value, value, value)

"""The flights of a map gathered cell by cell."""

from typing import NamedTuple

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from quadstep.engines.scored import LARGEST, RMSE
from quadstep.metrics.statistics import Estimate, share
from quadstep.studies.campaign.draws import draw
from quadstep.studies.campaign.flyer import OUTCOME, OUTCOMES, SUCCESS, drawn_column
from quadstep.studies.envelope.request import Request
from quadstep.studies.study import Flown

FLYABLE = 0.95
"""The share of flights that must succeed for a cell to count as flyable."""

OVER_LIMIT = "over-limit"
CAUSES = (OVER_LIMIT, *OUTCOMES[1:])
"""Why a flight does not succeed: it completed, but failed by a limit of the user's; or it ended early."""

MEDIAN, MEAN = (RMSE.replace("[", f"_{what}[") for what in ("median", "mean"))


class Cells(NamedTuple):
    """Results of each cell, arrays over (panel, row, column).

    causes: of those that did not succeed how many by each of `CAUSES` (a fourth index). completed: how many completed.
    rmse, mean: median and mean RMSE [m], and largest: largest error [m] of these, NaN where missing. outcome: the most
    frequent one.
    """

    flights: int
    random: bool
    causes: NDArray[np.int64]
    completed: NDArray[np.int64]
    rmse: NDArray[np.float64]
    mean: NDArray[np.float64]
    largest: NDArray[np.float64]
    outcome: NDArray[np.int64]

    @property
    def successes(self) -> NDArray[np.int64]:
        count: NDArray[np.int64] = self.flights - self.causes.sum(axis=-1)
        return count

    @property
    def cause(self) -> NDArray[np.int64]:
        """The most frequent of `CAUSES`, -1 where all succeed."""
        return np.where(self.causes.any(axis=-1), self.causes.argmax(axis=-1), -1)

    @property
    def share(self) -> NDArray[np.float64]:
        return self.successes / self.flights

    @property
    def flyable(self) -> NDArray[np.bool_]:
        """Where at least `FLYABLE` of them do."""
        return self.share >= FLYABLE


def cells_of(asked: Request, flown: Flown) -> Cells:
    """The flights of a map gathered. Raises UserError for values that cannot be flown."""
    cells = asked.cells
    causes = np.zeros((cells, len(CAUSES)), dtype=np.int64)
    outcomes = np.zeros((cells, len(OUTCOMES)), dtype=np.int64)
    rmse = np.full((asked.flights, cells), np.nan)
    largest = np.full(cells, np.nan)
    for (first, past), flights in flown:
        turn, cell = np.divmod(np.arange(first, past), cells)
        outcome = flights[OUTCOME].combine_chunks().indices.to_numpy().astype(np.int64)
        failed = ~flights[SUCCESS].to_numpy()
        np.add.at(outcomes, (cell, outcome), 1)
        np.add.at(causes, (cell[failed], outcome[failed]), 1)  # 0: it completed
        through = outcome == 0
        rmse[turn[through], cell[through]] = numbers(flights[RMSE])[through]
        np.fmax.at(largest, cell[through], numbers(flights[LARGEST])[through])
    median, mean = middle(rmse)
    return Cells(
        flights=asked.flights,
        random=asked.random,
        causes=causes.reshape(*asked.shape, -1),
        completed=outcomes[:, 0].reshape(asked.shape),
        rmse=median.reshape(asked.shape),
        mean=mean.reshape(asked.shape),
        largest=largest.reshape(asked.shape),
        outcome=outcomes.argmax(axis=1).reshape(asked.shape),
    )


def numbers(column: pa.ChunkedArray) -> NDArray[np.float64]:
    """A column, NaN where it is null."""
    values: NDArray[np.float64] = column.to_numpy().astype(np.float64)
    return values


def middle(values: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Median and mean of each column without its NaN; NaN for a column of NaN."""
    known = np.isfinite(values)
    count = known.sum(axis=0)
    ordered = np.sort(values, axis=0)  # NaN last
    columns, half = np.arange(values.shape[1]), np.maximum(count - 1, 0)
    with np.errstate(invalid="ignore"):
        median = 0.5 * (ordered[half // 2, columns] + ordered[(half + 1) // 2, columns])
        mean = np.where(known, values, 0.0).sum(axis=0) / np.where(count > 0, count, np.nan)
    return median, mean


def table(asked: Request, cells: Cells) -> pa.Table:
    """One row per cell; missing values are null. Without chance in a cell, its share is no estimate."""
    count = asked.cells
    drawn = draw(asked.campaign.file, np.arange(count))
    columns: dict[str, object] = {axis.key: drawn_column(drawn[axis.key]) for axis in reversed(asked.axes)}
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

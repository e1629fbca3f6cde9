"""Users' metrics of a log: summed row by row, as they are summed in flight."""

import math
from collections.abc import Mapping, Sequence

from quadstep.engines.eager import always
from quadstep.interfaces.log import FlightLog
from quadstep.interfaces.metric import Metric, added, started


def of_log(metrics: Sequence[Metric], log: FlightLog, columns: Mapping[str, str], begin: float) -> dict[str, float | None]:
    """The metrics of a log from `begin` [s] on, None where it is not finite. columns: all that its plant has."""
    summed, silent = started(metrics), dict.fromkeys(columns, float("nan"))
    rows = log.rows[log.column("t") >= begin] if metrics else log.rows[:0]
    add = always(lambda before, row: added(metrics, before, {**silent, **dict(zip(log.columns, row, strict=True))}))
    for row in rows.tolist():
        summed = add(summed, tuple(row))
    values = [float(one.value) if len(rows) and math.isfinite(one.value) else None for one in summed]
    return {one.full_name: value for one, value in zip(metrics, values, strict=True)}

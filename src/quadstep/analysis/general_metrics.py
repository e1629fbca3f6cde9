"""Metrics of a flight of any plant, computed from its log: of each position that has a wanted one beside it, of its inputs."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from quadstep.analysis.metrics import errors_of, position_axes, position_errors, rmse
from quadstep.flight.log import FlightLog


def general_metrics(log: FlightLog, efforts: Mapping[str, str] | None = None) -> dict[str, Any]:
    """Outcome and time of the end; RMSE, largest and final error of each position; largest value and changes of each input.

    efforts: columns of the inputs and their units.
    """
    result: dict[str, Any] = {"outcome": log.outcome.name.lower(), "ended[s]": log.ended}
    if len(log.rows) < 2:
        return result
    errors = position_errors(log)
    distance = np.linalg.norm(errors, axis=1)
    result["position"] = errors_of(errors, position_axes(log), "m")
    result["position_rmse[m]"], result["largest_error[m]"] = rmse(distance), float(distance.max())
    for name, unit in (efforts or {}).items():
        values = log.column(name)
        result[name] = {
            f"largest[{unit}]": float(np.abs(values).max()),
            f"total_variation[{unit}]": float(np.abs(np.diff(values)).sum()),
        }
    return result

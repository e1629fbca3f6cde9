"""Metrics of any flight, computed from its log."""

from typing import Any

from quadstep.analysis.airframe_metrics import airframe_metrics
from quadstep.analysis.general_metrics import general_metrics
from quadstep.analysis.metrics import lagrange_metrics
from quadstep.flight.log import FlightLog


def flight_metrics(log: FlightLog) -> dict[str, Any]:
    """Everything reported of a flight, with units in the keys, of the paper's plant or of a real vehicle.

    Always: "outcome", "ended[s]"; where there are two rows or more: "position" by axis, "position_rmse[m]",
    "largest_tilt[rad]", "rotors", "largest_weight_norm", and what `lagrange_metrics` or `airframe_metrics` adds.

    >>> from quadstep import Mission, flight_metrics, fly
    >>> metrics = flight_metrics(fly(Mission(path={"type": "step", "end": [0.0, 0.0, 1.0], "duration": 2.0})))
    >>> metrics["ended[s]"], round(metrics["position"]["z"]["largest[m]"], 3), metrics["largest_tilt[rad]"] < 0.01
    (2.0, 1.0, True)
    """
    if "q_w" in log.columns:
        return airframe_metrics(log)
    return lagrange_metrics(log) if "psi" in log.columns else general_metrics(log)

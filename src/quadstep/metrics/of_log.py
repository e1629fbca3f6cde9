"""Metrics of any flight, computed from its log."""

from collections.abc import Mapping
from typing import TypeAlias, cast

from quadstep.interfaces.log import FlightLog
from quadstep.metrics.quantities import LoggedFlight
from quadstep.metrics.registry import OTHER, PAPER, REAL, REPORTED

Metrics: TypeAlias = dict[str, object]
"""Numbers and texts by name with unit, nested as in `metrics.json`."""


def flight_metrics(log: FlightLog, since: float = 0.0, efforts: Mapping[str, str] | None = None, arm: float = 0.0) -> Metrics:
    """Everything reported of a flight of any plant, with units in the keys; `quadstep.metrics.registry` says what each means.

    Always: "outcome", "ended[s]"; where there are two rows or more: "position" by axis, "position_rmse[m]", and what the
    columns of the log allow. since: errors of the position count from then on [s]. efforts: columns of the inputs of a plant
    that declares itself, and their units. arm: from the vehicle's centre to its farthest rotor [m], 0 if not known.

    >>> from quadstep import Mission, flight_metrics, fly
    >>> metrics = flight_metrics(fly(Mission(path={"type": "step", "end": [0.0, 0.0, 1.0], "duration": 2.0})))
    >>> metrics["ended[s]"], round(metrics["position"]["z"]["largest[m]"], 3), metrics["largest_tilt[rad]"] < 0.01
    (2.0, 1.0, True)
    >>> step = {"type": "step", "end": [0.0, 0.0, 0.5], "duration": 4.0}
    >>> flight = fly(Mission(vehicle={"preset": "crazyflie"}, path=step))
    >>> flight_metrics(flight)["largest_error[m]"], flight_metrics(flight, since=3.5)["largest_error[m]"] < 0.1
    (0.5, True)
    """
    result: Metrics = {"outcome": log.outcome.name.lower(), "ended[s]": log.ended}
    t = log.column("t")
    if len(t) < 2 or t[-1] <= since:
        return result
    kind = REAL if "q_w" in log.columns else PAPER if "psi" in log.columns else OTHER
    seen = LoggedFlight(log, since, efforts or {}, arm)
    for metric in REPORTED:
        found = metric.quantity(seen) if kind in metric.of else None
        if found is not None:
            for name, value in zip(metric.full_names(found.entries), metric.reduction.of(found.values, found.t), strict=True):
                place(result, name, value)
    return result


def place(result: Metrics, name: str, value: float | None) -> None:
    """Put a number where its dotted name says."""
    *levels, last = name.split(".")
    for level in levels:
        result = cast(Metrics, result.setdefault(level, {}))
    result[last] = value


def metric(metrics: Mapping[str, object], *names: str) -> float:
    """A number of the metrics, by the names on the way to it. Raises KeyError where it is not there.

    >>> from quadstep.metrics.of_log import metric
    >>> metric({"position": {"z": {"rmse[m]": 0.25}}}, "position", "z", "rmse[m]")
    0.25
    """
    found: object = metrics
    for name in names:
        found = cast(Metrics, found)[name]
    return cast(float, found)


def group(metrics: Mapping[str, object], name: str) -> dict[str, dict[str, float]]:
    """The numbers of each axis or angle; empty where there are none."""
    return cast("dict[str, dict[str, float]]", metrics.get(name, {}))

"""The whole study flown: logs of the cases, metrics of everything else."""

from typing import Any, NamedTuple

from quadstep.analysis.metrics import flight_metrics
from quadstep.flight.engines import Engine, FlightPlan, fly_all
from quadstep.flight.log import FlightLog
from quadstep.study.cases import further_flights, main_cases, neuron_flights, start_flights, stress_flights

Metrics = dict[str, Any]


class Study(NamedTuple):
    """plans: of all flights, in order. logs: of the flights with a CSV. The rest are metrics by what was varied."""

    plans: list[FlightPlan]
    logs: dict[str, FlightLog]
    cases: dict[str, Metrics]
    further: dict[str, Metrics]
    neurons: dict[tuple[str, int, int], Metrics]
    starts: dict[tuple[str, str], Metrics]
    stress: dict[tuple[float, float, bool], Metrics]


def fly_study(engine: Engine = Engine.LANES) -> Study:
    """Fly everything."""
    families: list[dict[Any, Any]] = [main_cases(), further_flights(), neuron_flights(), start_flights(), stress_flights()]
    plans = [mission.plan() for family in families for mission in family.values()]
    logs = iter(fly_all(plans, engine))
    flown = [{key: next(logs) for key in family} for family in families]
    metrics = [{key: flight_metrics(log) for key, log in family.items()} for family in flown]
    return Study(plans, flown[0], *metrics)


def completed(metrics: Metrics) -> bool:
    """Whether a flight reached its end."""
    return bool(metrics["outcome"] == "completed")

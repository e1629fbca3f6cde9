"""Flies the whole study: logs of the cases, metrics of everything else."""

from collections.abc import Callable, Mapping
from enum import StrEnum
from typing import Any, NamedTuple

from quadstep.engines.engine import Engine
from quadstep.engines.fly import FlightPlan, fly_all
from quadstep.interfaces.log import FlightLog
from quadstep.metrics.of_log import Metrics, flight_metrics
from quadstep.mission.lagrange import LagrangeMission
from quadstep.studies.paper.cases import further_flights, main_cases, neuron_flights, start_flights, stress_flights


class Verdict(StrEnum):
    """The verdict of the flights on a sentence of the paper."""

    HOLDS = "holds"
    FAILS = "fails"
    UNDECIDED = "undecidable from the paper"


class Claim(NamedTuple):
    """A claim. name: short. sentence: the paper's. measured: one line with numbers. values: the same for machines."""

    name: str
    sentence: str
    measured: str
    verdict: Verdict
    values: Mapping[str, Any]


def judge(holds: bool) -> Verdict:
    """The verdict for a condition: holds or fails."""
    return Verdict.HOLDS if holds else Verdict.FAILS


Logs = dict[str, FlightLog]


class StudyPlans(NamedTuple):
    """The flights to be flown, by family."""

    cases: dict[str, FlightPlan]
    further: dict[str, FlightPlan]
    neurons: dict[tuple[str, int, int], FlightPlan]
    starts: dict[tuple[str, str], FlightPlan]
    stress: dict[tuple[float, float, bool], FlightPlan]

    def all(self) -> list[FlightPlan]:
        return [plan for family in self for plan in family.values()]


class Study(NamedTuple):
    """The study as flown. logs: of the cases, one CSV each. The rest are metrics by what was varied."""

    logs: Logs
    cases: dict[str, Metrics]
    further: dict[str, Metrics]
    neurons: dict[tuple[str, int, int], Metrics]
    starts: dict[tuple[str, str], Metrics]
    stress: dict[tuple[float, float, bool], Metrics]


def plan_study() -> StudyPlans:
    families: list[dict[Any, LagrangeMission]] = [
        main_cases(),
        further_flights(),
        neuron_flights(),
        start_flights(),
        stress_flights(),
    ]
    return StudyPlans(*({key: mission.plan() for key, mission in family.items()} for family in families))


def fly_study(plans: StudyPlans, engine: Engine = Engine.LANES, on_cases: Callable[[Logs], None] | None = None) -> Study:
    """Fly everything, the cases first. on_cases: called with their logs at once, so that figures can be drawn meanwhile."""
    logs = dict(zip(plans.cases, fly_all(list(plans.cases.values()), engine), strict=True))
    if on_cases:
        on_cases(logs)
    rest = plans[1:]
    flown = iter(fly_all([plan for family in rest for plan in family.values()], engine))
    metrics: list[dict[Any, Metrics]] = [{key: flight_metrics(next(flown)) for key in family} for family in rest]
    return Study(logs, {name: flight_metrics(log) for name, log in logs.items()}, *metrics)


def completed(metrics: Metrics) -> bool:
    """Whether a flight reached its end."""
    return bool(metrics["outcome"] == "completed")

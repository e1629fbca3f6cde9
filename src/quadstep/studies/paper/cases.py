"""The flights of the study as missions (the paper's cases, their variants, the stress flights), and flying them: logs of
the cases, metrics of everything else.
"""

from collections.abc import Callable, Iterable, Mapping
from enum import StrEnum
from typing import Any, NamedTuple

from quadstep.engines.engine import Engine
from quadstep.engines.fly import FlightPlan, fly_all
from quadstep.interfaces.log import FlightLog
from quadstep.metrics.registry import Metrics, flight_metrics
from quadstep.mission.lagrange import LagrangeMission

CASE_TIME = 40.0
"""t_f of every case [s]; the paper gives it for Case 1 only."""

HOLD = 5.0
"""How long a stress flight holds its end point before it is scored [s]."""

STRESS_TIMES = (20.0, 10.0, 6.0, 5.0, 4.0, 3.0)
STRESS_SCALES = (0.0, 1.0, 5.0)
NEURONS, SEEDS = (8, 10, 12), tuple(range(1, 9))

FIGURE_3_ENDS, FIGURE_3_TIME = (10.0, 20.0, 30.0, 40.0), 10.0

CASE_3_START = {"position": [0.5, -0.5, 0.0], "attitude": [0.0, 0.1, -0.1]}
"""Half a metre off the path and tilted by 0.1 rad, because from rest on the path x, y, theta and phi stay zero for ever."""

CASE_3_STARTS: dict[str, dict[str, Any]] = {
    "at rest on the path": {},
    "0.5 m off in x and y": {"position": [0.5, -0.5, 0.0]},
    "tilted by 0.1 rad": {"attitude": [0.0, 0.1, -0.1]},
    "off and tilted (Case 3)": CASE_3_START,
    "5 m off in x and y": {"position": [5.0, -5.0, 0.0]},
}

NETS_OFF = "adaptive, nets off"

NESTED_GAINS: dict[str, dict[str, object]] = {
    "a_z = (3, 0.5)": {"a_z": [3.0, 0.5]},
    "a_z = (0.001, 0.002)": {"a_z": [0.001, 0.002]},
}
"""Altitude gains of [11] found in scripts that reproduce it; the second set is in hardware units and does not settle in SI."""


def line(name: str, origin: list[float], target: list[float], **sections: object) -> LagrangeMission:
    """A mission along a straight line; `sections` as in a mission file, `duration` is t_f [s]."""
    duration = sections.pop("duration", CASE_TIME)
    path = {"type": "minimum-jerk", "start": origin, "end": target, "duration": duration}
    return LagrangeMission.model_validate({"name": name, "path": path, **sections})


def adaptive(**nets: object) -> dict[str, object]:
    """The paper's controller with these net settings."""
    return {"type": "backstepping", "nets": nets}


def nested(**gains: object) -> dict[str, object]:
    """The controller of [11]."""
    return {"type": "nested-saturation", **gains}


def case_1(**sections: object) -> LagrangeMission:
    """Case 1: to (20, 5, 10) from the origin."""
    return line("Case 1: three position commands at once", [0.0, 0.0, 0.0], [20.0, 5.0, 10.0], **sections)


def case_2(axis: str = "x") -> LagrangeMission:
    """Case 2: one axis moves alone; y and z as in its last sentence."""
    start = {"x": [0.0, 5.0, 10.0], "y": [20.0, 0.0, 10.0], "z": [20.0, 5.0, 0.0]}[axis]
    return line(f"Case 2: {axis} command only", start, [20.0, 5.0, 10.0])


def case_3(controller: dict[str, object], start: dict[str, object] | None = None) -> LagrangeMission:
    """Case 3: altitude change from 0 to 10 m while x and y should stay zero."""
    begin = CASE_3_START if start is None else start
    return line("Case 3: altitude change", [0.0, 0.0, 0.0], [0.0, 0.0, 10.0], controller=controller, start=begin)


def stress(duration: float, scale: float, **nets: object) -> LagrangeMission:
    """Case 1's path in `duration` seconds under `scale` times the paper's disturbance, then held; `nets` as in a mission."""
    return case_1(
        duration=duration, disturbance={"scale": scale}, controller=adaptive(**nets), simulation={"duration": duration + HOLD}
    )


def main_cases() -> dict[str, LagrangeMission]:
    """The flights that get a CSV of their own, by file name."""
    return {
        "case1": case_1(),
        "case2": case_2("x"),
        "case2_y": case_2("y"),
        "case2_z": case_2("z"),
        "case3_adaptive": case_3(adaptive()),
        "case3_nested": case_3(nested()),
    }


def case_title(key: str, mission: LagrangeMission) -> str:
    """What one of these is called, with its controller where two fly the same."""
    return mission.name + {"case3_adaptive": ", adaptive", "case3_nested": ", nested [11]"}.get(key, "")


def further_flights() -> dict[str, LagrangeMission]:
    """Flights that a claim needs besides the cases: with the nets switched off."""
    return {"case1 without nets": case_1(controller=adaptive(enabled=False)),
            "case3 without nets": case_3(adaptive(enabled=False))}  # fmt: skip


def neuron_flights() -> dict[tuple[str, int, int], LagrangeMission]:
    """Case 1 and a stress flight by number of neurons and seed of the input weights."""
    flights = {}
    for count in NEURONS:
        for seed in SEEDS:
            flights["Case 1", count, seed] = case_1(controller=adaptive(neurons=count, seed=seed))
            flights["t_f = 6 s, scale 1", count, seed] = stress(6.0, 1.0, neurons=count, seed=seed)
    return flights


def start_flights() -> dict[tuple[str, str], LagrangeMission]:
    """Case 3 from several starts, by start and controller."""
    controllers = {"adaptive": adaptive(), NETS_OFF: adaptive(enabled=False)}
    controllers |= {f"nested, {name}": nested(**gains) for name, gains in NESTED_GAINS.items()}
    return {
        (where, name): case_3(controller, start)
        for where, start in CASE_3_STARTS.items()
        for name, controller in controllers.items()
    }


def stress_flights() -> dict[tuple[float, float, bool], LagrangeMission]:
    """The stress flights by t_f [s], disturbance scale and nets on or off."""
    return {
        (duration, scale, nets): stress(duration, scale, enabled=nets)
        for duration in STRESS_TIMES
        for scale in STRESS_SCALES
        for nets in (True, False)
    }


class ClaimVerdict(StrEnum):
    """The verdict of the flights on a sentence of the paper."""

    HOLDS = "holds"
    FAILS = "fails"
    UNDECIDED = "undecided"


class Claim(NamedTuple):
    """A claim. name: short. case: what was flown. sentence: the paper's. measured: one line with numbers. values: the same
    for machines.
    """

    name: str
    case: str
    sentence: str
    measured: str
    verdict: ClaimVerdict
    values: Mapping[str, Any]


def judge(holds: bool) -> ClaimVerdict:
    """The verdict for a condition: holds or fails."""
    return ClaimVerdict.HOLDS if holds else ClaimVerdict.FAILS


def judge_all(answers: Iterable[bool | None]) -> ClaimVerdict:
    """The verdict where the paper leaves the flight open: what all flights that differ (None: they do not) say."""
    said = {answer for answer in answers if answer is not None}
    return judge(said.pop()) if len(said) == 1 else ClaimVerdict.UNDECIDED


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


class PaperStudy(NamedTuple):
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


def fly_study(plans: StudyPlans, engine: Engine = Engine.LANES, on_cases: Callable[[Logs], None] | None = None) -> PaperStudy:
    """Fly everything, the cases first. on_cases: called with their logs at once, so that figures can be drawn meanwhile."""
    logs = dict(zip(plans.cases, fly_all(list(plans.cases.values()), engine), strict=True))
    if on_cases:
        on_cases(logs)
    rest = plans[1:]
    flown = iter(fly_all([plan for family in rest for plan in family.values()], engine))
    metrics: list[dict[Any, Metrics]] = [{key: flight_metrics(next(flown)) for key in family} for family in rest]
    return PaperStudy(logs, {name: flight_metrics(log) for name, log in logs.items()}, *metrics)


def completed(metrics: Metrics) -> bool:
    """Whether a flight reached its end."""
    return bool(metrics["outcome"] == "completed")

"""How much of a disturbance a controller bears: it is raised for every flight until that flight fails.

Each flight has draws of its own, the same for every controller. Where the disturbance can be any number, each flight is
bisected by itself, all flights of a step in one sweep: the 50 % and 5 % points are quantiles of what the flights bore. Where
it can only be a multiple of something (a latency), all flights share each value, and the two points are bisected by the share
that fails.

Also how far its loop is from unstable: its margins at rest where the path of its first situation begins.
"""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from quadstep.engines.scored import LARGEST
from quadstep.interfaces.closed_loop import Outcome
from quadstep.interfaces.controller import Controller
from quadstep.io.errors import UserError, errors_in
from quadstep.linear.analysis import analyse_rest
from quadstep.linear.grade import grade_of_refusal, graded, of_analysis
from quadstep.linear.worst import ROW_HEADER, cells
from quadstep.metrics.statistics import Estimate, ordered_quantile, share
from quadstep.mission.check import check
from quadstep.mission.multirotor import MultirotorMission
from quadstep.mission.read import check_mission
from quadstep.mission.schema import Mission
from quadstep.studies.campaign.cluster import OneThread
from quadstep.studies.campaign.draws import DrawnColumn, draw
from quadstep.studies.campaign.flyer import Flyer
from quadstep.studies.campaign.planner import planner
from quadstep.studies.campaign.schema import Campaign, CampaignFile, campaign_of, digests
from quadstep.studies.comparison.cells import FIRST, ComparisonStudy, Situation, StudyCell
from quadstep.studies.comparison.schema import Content, MarginEntry

HALVINGS = 8
"""Of the range: what a flight bears is known to 1/256 of it."""

POINTS = (0.5, 0.05)
"""Shares of flights that fail."""

UNKNOWN = "unknown"
"""In a file, an end of an interval that too few flights leave open."""

AGAIN = 2**19
"""How far the flights are that a point is tried on afterwards."""


class Raise(NamedTuple):
    """A disturbance raised for one controller and vehicle. entry: of the study. mission: with the controller's gains."""

    vehicle: str
    controller: str
    name: str
    entry: MarginEntry
    mission: Content
    draws: Content
    source: str
    folder: Path
    seed: int
    precision: str

    @property
    def decisive(self) -> list[object]:
        content = [self.entry.model_dump(), self.mission, self.draws]
        return [*content, digests(content, self.folder), self.seed, self.precision]

    @property
    def law(self) -> type[Controller]:
        return check_mission(self.mission, self.source, self.folder).controller.controller

    @property
    def label(self) -> str:
        return f"{self.controller}: {self.vehicle}, margin {self.name}"


class Margin(NamedTuple):
    """What a controller bears. half, few: where 50 % and 5 % of flights fail, with 95 % intervals; infinite where fewer fail
    at the end of the range. checked: share of other flights that fail at `half`, None where that is beyond the range.
    flights: flown.
    """

    half: Estimate
    few: Estimate
    checked: Estimate | None
    flights: int


def raised(study: ComparisonStudy, vehicle: str, name: str, controller: str, table: Content) -> Raise:
    """A margin to be found. table: of the controller, with its gains. Raises UserError."""
    entry = (study.file.margins or {})[name]
    situation = Situation(vehicle, entry.path, entry.scenario)
    found = Raise(
        vehicle, controller, name, entry, study.content(situation, table), study.draws(entry.scenario), study.source,
        study.folder, study.file.seed, study.file.precision,
    )  # fmt: skip
    with errors_in(study.source, f"margins.{name}: {controller} on {vehicle}"):
        _, campaign = campaigns(found)
        for end in (entry.low, entry.high if entry.step is None else values_of(entry)[-1]):
            planner(campaign).plan(dict.fromkeys(entry.keys, end))
    return found


def values_of(entry: MarginEntry) -> list[float]:
    assert entry.step
    return [entry.low + place * entry.step for place in range(1 + math.floor((entry.high - entry.low) / entry.step + 1e-9))]


def campaigns(rise: Raise) -> tuple[CampaignFile, Campaign]:
    """What is drawn, and what is flown: the same with the keys that are raised. Raises UserError."""
    shared: Content = {"mission": rise.mission, "seed": rise.seed, "precision": rise.precision}
    shared["correlated"] = rise.draws["correlated"]
    entry, vary = rise.entry, cast(Content, rise.draws["vary"])
    ends: Content = {"type": "uniform", "low": entry.low, "high": entry.high}
    if entry.step:
        ends = {"type": "grid", "values": values_of(entry)}
    drawing = check(CampaignFile, {**shared, "vary": vary}, rise.source)
    flying = check(CampaignFile, {**shared, "vary": {**vary, **dict.fromkeys(entry.keys, ends)}}, rise.source)
    return drawing, campaign_of(flying, "", rise.mission, rise.source, rise.folder)


class Proving:
    """Flies the flights of a margin at given values."""

    def __init__(self, rise: Raise) -> None:
        self.asked, self.entry, self.flown = rise, rise.entry, 0
        self.drawing, campaign = campaigns(rise)
        self.flyer = Flyer(campaign, OneThread)
        self.largest = campaign.metrics.index(LARGEST)

    def failed(self, values: NDArray[np.float64], first: int) -> NDArray[np.bool_]:
        """Which of the flights from this number on fail, each at its value. Raises UserError."""
        flights = np.arange(first, first + len(values))
        drawn = draw(self.drawing, flights)
        raised = DrawnColumn(values)
        if self.entry.step:
            options = values_of(self.entry)
            raised = DrawnColumn(np.searchsorted(np.array(options), values - 0.25 * self.entry.step), tuple(options))
        drawn |= dict.fromkeys(self.entry.keys, raised)
        result = np.ones(len(values), dtype=bool)
        for batch in self.flyer.planner.batches(flights, drawn):
            swept = self.flyer.swept(batch, None)
            error = swept.metrics[:, self.largest]
            result[batch.members] = (swept.outcome != Outcome.COMPLETED) | ~(error <= self.entry.error)
        self.flown += len(values)
        return result


def find(rise: Raise) -> Margin:
    """Fly. Raises UserError."""
    proving = Proving(rise)
    half, few = by_steps(proving) if rise.entry.step else flight_by_flight(proving)
    return Margin(half, few, tried(proving, half.value), proving.flown)


def flight_by_flight(proving: Proving) -> tuple[Estimate, Estimate]:
    """The points from what each flight bore: infinite where it never failed, `low` where it always did."""
    entry = proving.entry
    low, high = np.full(entry.flights, entry.low), np.full(entry.flights, entry.high)
    at_once, ever = proving.failed(low, FIRST), proving.failed(high, FIRST)
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        failed = proving.failed(middle, FIRST)
        low, high = np.where(failed, low, middle), np.where(failed, middle, high)
    bore = np.where(at_once, entry.low, np.where(ever, 0.5 * (low + high), math.inf))
    half, few = (ordered_quantile(bore, point) for point in POINTS)
    return half, few


def by_steps(proving: Proving) -> tuple[Estimate, Estimate]:
    """The points from the share of flights that fail at each multiple of the step: the first at which more do."""
    values = values_of(proving.entry)
    known: dict[int, int] = {}

    def failing(place: int) -> int:
        if place not in known:
            known[place] = int(proving.failed(np.full(proving.entry.flights, values[place]), FIRST).sum())
        return known[place]

    def first(most: float) -> float:
        low, high = 0, len(values)  # the first that fails is in [low, high]
        while low < high:
            middle = (low + high) // 2
            low, high = (low, middle) if failing(middle) > most else (middle + 1, high)
        return values[low] if low < len(values) else math.inf

    found = []
    for point in POINTS:
        fewest, most = tolerance(point, proving.entry.flights)
        value = first(point * proving.entry.flights)
        found.append(Estimate(value, first(fewest), first(most)))
    return found[0], found[1]


def tolerance(point: float, flights: int) -> tuple[int, int]:
    """The numbers of failed flights between which a share of `point` cannot be told from theirs, at 95 % confidence."""
    inside = [count for count in range(flights + 1) if share(count, flights).low <= point <= share(count, flights).high]
    return inside[0] - 1, inside[-1]


def tried(proving: Proving, value: float) -> Estimate | None:
    """The share that fails at a point, of as many other flights."""
    if not math.isfinite(value):
        return None
    failed = proving.failed(np.full(proving.entry.flights, value), FIRST + AGAIN)
    return share(int(failed.sum()), len(failed))


def as_json(margin: Margin) -> Content:
    """For a file; infinity is null, an end that too few flights leave unknown is named so."""

    def numbers(one: Estimate | None) -> list[float | str | None] | None:
        return one and [UNKNOWN if math.isnan(part) else part if math.isfinite(part) else None for part in one]

    return {**margin._asdict(), "half": numbers(margin.half), "few": numbers(margin.few), "checked": numbers(margin.checked)}


def from_json(content: Content) -> Margin:

    def estimate(name: str) -> Estimate | None:
        parts = cast(list[float | str | None] | None, content[name])
        numbers = (math.inf if part is None else math.nan if part == UNKNOWN else float(part) for part in parts or ())
        return Estimate._make(numbers) if parts else None

    return Margin._make([estimate("half"), estimate("few"), estimate("checked"), content["flights"]])


HEADER = ("vehicle", "controller", *ROW_HEADER[1:])


class Linear(NamedTuple):
    """What is said of a loop. grade, why: of `linear.grade`. cells: of `HEADER` after the names; metrics: margins by name;
    neither where it cannot be linearised. estimator: whether one was left out.
    """

    grade: str
    why: str
    cells: list[str]
    metrics: dict[str, float]
    estimator: bool = False


def linear_of(cell: StudyCell) -> Linear:
    flown = cell.mission
    mission = without_estimator(flown)
    left_out = mission is not flown
    try:
        found = analyse_rest(mission).analysis
    except UserError as error:
        grade = grade_of_refusal(error)
        return Linear(grade.word, grade.why.removeprefix(f"{cell.campaign.source}: "), [], {}, left_out)
    grade = graded(found)
    return Linear(grade.word, grade.why, cells(found), of_analysis(found), left_out)


def without_estimator(mission: Mission) -> Mission:
    """The loop without a Kalman filter and the latency of fixes that it makes up for: its covariance has hundreds of
    states, the same for every controller.
    """
    if not isinstance(mission, MultirotorMission) or not mission.sensors.estimator:
        return mission
    sensors = mission.sensors.model_copy(update={"estimator": False, "latency": 0.0})
    return mission.model_copy(update={"sensors": sensors})


def rows(loops: Mapping[tuple[str, str], Linear]) -> list[list[str]]:
    """A row of `HEADER` for each controller: the least margins of all its channels."""
    none = ["-"] * (len(HEADER) - 3)
    return [[vehicle or "-", controller, *(one.cells or [one.grade, *none])] for (vehicle, controller), one in loops.items()]


def unlinearised(loops: Mapping[tuple[str, str], Linear]) -> list[str]:
    """A line for each that cannot be linearised."""
    return [
        f"{' on '.join(filter(None, (controller, vehicle)))}: {one.why}"
        for (vehicle, controller), one in loops.items()
        if not one.metrics
    ]

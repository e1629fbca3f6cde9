"""Gains found for one controller and vehicle, on the same flights and with the same budget as every other controller's.

The objective is the mean, over the situations that are tuned on, of an aggregate of the flights' costs; its unit is the same
for all controllers. A generation that was flown is written into a journal, from which an interrupted search goes on.
"""

import contextlib
import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from itertools import starmap
from pathlib import Path
from typing import NamedTuple, TypedDict, cast

import numpy as np

from quadstep.io.errors import UserError, errors_in
from quadstep.io.files import LOG as JOURNAL
from quadstep.io.parts import changed
from quadstep.io.results_folder import opened
from quadstep.linear.grade import margin_metrics
from quadstep.metrics.registry import MARGINS
from quadstep.metrics.statistics import finite
from quadstep.mission.read import check_mission
from quadstep.mission.schema import Mission
from quadstep.mission.tune import Constraint, Range
from quadstep.report.progress import SILENT
from quadstep.report.units import counted
from quadstep.studies.campaign.cluster import OneThread
from quadstep.studies.campaign.schema import digests
from quadstep.studies.comparison.cells import ComparisonStudy, Situation
from quadstep.studies.comparison.robustness import without_estimator
from quadstep.studies.comparison.schema import Content, ControllerEntry
from quadstep.studies.tuning.gains import with_numbers
from quadstep.studies.tuning.ground import CandidateFlyer, margins_of, sound, tuning_request
from quadstep.studies.tuning.objective import CandidateFlights, Judge, Judged, squashed
from quadstep.studies.tuning.search import FEWEST_GENERATIONS, Search, population
from quadstep.studies.tuning.trial import MarginGuess, Stability, Tried, flights_of, tried_of


class TuningTask(NamedTuple):
    """A controller to be tuned for a vehicle. missions: with their tables [tune], one for each situation. rest: the mission
    whose loop is linearised, and margins that it must leave.
    """

    vehicle: str
    controller: str
    missions: tuple[Content, ...]
    rest: Content
    margins: dict[str, Constraint]
    source: str
    folder: Path
    budget: int
    seed: int

    @property
    def decisive(self) -> list[object]:
        margins = {name: one.model_dump() for name, one in self.margins.items()}
        return [self.missions, self.rest, margins, digests(list(self.missions), self.folder), self.budget, self.seed]

    @property
    def label(self) -> str:
        return f"{self.controller} on {self.vehicle}"


class Trained(NamedTuple):
    """Gains that were found. values: by key of the mission; before: what they were. objective: of the former on the flights
    that were tuned on [m, where it is a length], None where one situation lost all of its own. lost: of these flights.
    flights: used of the budget. tuned: how many gains. seed: of the search. violation: by what share constraints are missed.
    margins: those that were asked for; unconstrained: why there are none.
    """

    values: dict[str, float]
    before: dict[str, float]
    objective: float | None
    lost: int
    flights: int
    seeds: int
    tuned: int
    seed: int = 0
    violation: float = 0.0
    margins: Mapping[str, float] = {}
    unconstrained: str = ""

    @property
    def order(self) -> tuple[bool, int, float]:
        """Of searches for the same controller: the first is the best."""
        return self.violation > 0.0, self.lost, math.inf if self.objective is None else self.objective


def task(
    study: ComparisonStudy, vehicle: str, name: str, entry: ControllerEntry, controller: Content, repeat: int = 0
) -> TuningTask:
    """The tuning of a controller. controller: its table with all that it knows. repeat: number of the search.

    Raises UserError.
    """
    tuning = study.file.tuning
    assert tuning
    situations = [Situation(vehicle, *place) for place in study.places(vehicle) if place in flown_in(study)]
    if not situations:
        raise UserError(f"{study.source}: tuning.flown: {vehicle} flies none of these")
    mission = study.nominal(vehicle, controller)
    gains = {f"controller.{key.removeprefix('controller.')}": one for key, one in ranges(entry, mission).items()}
    if not gains:
        raise UserError(f'{study.source}: {name} has no tunable gain; set frozen = "as shipped", or give ranges')
    section = {
        "gains": gains,
        "seeds": tuning.seeds,
        "objective": tuning.objective,
        "aggregate": tuning.aggregate,
        "constraints": {key: one.model_dump() for key, one in (tuning.constraints or {}).items() if key not in MARGINS},
        "precision": study.file.precision,
        **({} if study.file.score_period is None else {"score_period": study.file.score_period}),
    }
    missions = tuple(
        {**study.content(one, controller), "tune": {**section, **study.draws(one.scenario)}} for one in situations
    )
    margins = margins_of(tuning.constraints, lambda: sound(without_estimator(mission)))
    rest = {**study.at_rest(vehicle), "controller": controller}
    seed = study.file.seed + repeat
    return TuningTask(vehicle, name, missions, rest, margins, study.source, study.folder, tuning.budget, seed)


def flown_in(study: ComparisonStudy) -> list[tuple[str, str]]:
    """The paths and scenarios that are tuned on."""
    assert study.file.tuning
    return [(one.path, one.scenario) for one in study.file.tuning.flown]


def ranges(entry: ControllerEntry, mission: Mission) -> dict[str, Content]:
    """What is searched: as the study says, or every gain that the controller declares, each entry by itself where they
    differ.
    """
    if entry.ranges is not None:
        asked = cast("dict[str, Range | None]", entry.ranges)
        return {key: {} if one is None else one.model_dump() for key, one in asked.items()}
    found: dict[str, Content] = {}
    for key, (_, gain) in mission.controller.controller.by_key().items():
        if gain.tunable:
            parts = () if gain.stands_for_three else gain.parts
            found |= {f"{key}.{place}": {} for place in range(len(parts))} if parts else {key: {}}
    nets = mission.controller.table
    if nets is not None and nets.enabled:
        found |= {f"nets.{key}": {} for key, value in nets if type(value) is float and value > 0.0}
    return found


class Generation(TypedDict):
    """A generation. flights: of the search so far. tried: as `Tried`, in the order of `values`."""

    flights: int
    values: list[dict[str, float]]
    tried: list[Tried]


class JournalPlace(NamedTuple):
    """Of a journal: a folder of results, and the name in it."""

    folder: Path
    name: str

    @property
    def path(self) -> Path:
        return self.folder / self.name


class Journal:
    """The generations of a search that were flown, a line of JSON each with its digest. place: None to keep none."""

    def __init__(self, place: JournalPlace | None) -> None:
        self.place = place
        self.lines = read_lines(place) if place else []
        self.next = 0
        if place:  # go on after the last whole line
            with opened(place.folder) as folder:
                if folder.has(place.name):
                    folder.write(place.name, "".join(map(as_text, self.lines)).encode())

    def next_generation(self, values: Sequence[dict[str, float]]) -> Generation | None:
        """The next generation, if it is there and of these candidates."""
        if self.next < len(self.lines) and self.lines[self.next]["values"] == list(values):
            self.next += 1
            return self.lines[self.next - 1]
        return None

    def add(self, flights: int, values: Sequence[dict[str, float]], tried: Sequence[Tried]) -> None:
        if self.place:
            line: Generation = {"flights": flights, "values": list(values), "tried": list(tried)}
            with opened(self.place.folder) as folder:
                folder.append(self.place.name, as_text(line).encode())


def as_text(line: Generation) -> str:
    """A line of a journal, begun with the digest of what follows."""
    text = json.dumps(line)
    return f"{hashlib.sha256(text.encode()).hexdigest()[:16]} {text}\n"


def read_lines(place: JournalPlace) -> list[Generation]:
    """The whole lines of a journal; one that was cut short by a kill ends it. Raises UserError for one that was changed."""
    with contextlib.suppress(OSError), opened(place.folder) as folder:
        if not folder.has(place.name):
            return []
        found: list[Generation] = []
        for content in folder.read(place.name, JOURNAL).decode(errors="replace").split("\n")[:-1]:
            line: Generation = {"flights": 0, "values": [], "tried": []}
            with contextlib.suppress(ValueError, RecursionError):
                line = json.loads(content.partition(" ")[2])
            if f"{content}\n" != as_text(line):
                raise changed(place.path)
            found.append({**line, "tried": list(starmap(tried_of, line["tried"]))})
        return found
    return []


class Training(Search):
    """A search whose candidates fly in several situations, and must leave margins of stability: of the loop at rest without
    an estimator, unless that cannot be linearised. unconstrained: why it cannot.
    """

    def __init__(self, grounds: Sequence[CandidateFlyer], task: TuningTask, journal: Journal) -> None:
        super().__init__(grounds, task.budget, task.seed, SILENT)
        self.journal, self.unconstrained = journal, ""
        self.judges = [Judge(one.asked.section, one.duration) for one in grounds]
        self.stability = stability(task)
        if task.margins:
            try:
                self.stability.margins(self.asked.present)
            except UserError as error:
                self.unconstrained = str(error).removeprefix(f"{task.source}: ")
                self.stability = self.stability._replace(limits={})
        self.guess = MarginGuess(self.stability.limits)

    def tried(self, values: list[dict[str, float]], guessed: Sequence[float]) -> list[Tried]:
        """Candidates flown and judged, or taken from the journal."""
        line = self.journal.next_generation(values)
        if line is not None:
            self.flights = line["flights"]
            return line["tried"]
        found = super().tried(values, guessed)
        self.journal.add(self.flights, values, found)
        return found

    def judged(self, flown: Sequence[CandidateFlights]) -> Judged:
        return over_all([judge.judge(one) for judge, one in zip(self.judges, flown, strict=True)], self.judges)


def stability(task: TuningTask) -> Stability:
    """The margins that the gains of a task must leave."""
    mission = check_mission(task.rest, task.source, task.folder)

    def margins(values: Mapping[str, float]) -> Mapping[str, float]:
        content = with_numbers(task.rest, mission, dict(values))
        return margin_metrics(without_estimator(check_mission(content, task.source, task.folder)), task.margins)

    return Stability(task.margins, margins)


def over_all(parts: Sequence[Judged], judges: Sequence[Judge]) -> Judged:
    """One judgement of a candidate from those of each situation; no unit in it depends on the controller."""
    objective = float(np.mean([one.objective for one in parts]))
    lost = sum(one.lost for one in parts)
    least = [squashed(one.objective / judge.unit) for one, judge in zip(parts, judges, strict=True)]
    losses = sum(one.cost - low for one, low in zip(parts, least, strict=True))  # what each adds for lost flights
    names = parts[0].parts
    means = {name: float(np.mean([one.parts[name] for one in parts])) for name in names}
    violation = sum(one.violation for one in parts)
    return Judged(objective, means, lost, violation, squashed(objective) + losses)


def grounds(task: TuningTask) -> list[CandidateFlyer]:
    """Where the candidates of a task fly. Raises UserError."""
    wanted = [tuning_request(Path(task.source), "", content, task.folder) for content in task.missions]
    return [CandidateFlyer(one, task.seed, OneThread) for one in wanted]


def train(task: TuningTask, journal: JournalPlace | None = None) -> Trained:
    """Tune a controller. journal: where it notes what was flown. Raises UserError."""
    search = Training(grounds(task), task, Journal(journal))
    found = search.run()
    best = found.best.judged
    return Trained(
        values=found.best.values,
        before=found.present.values,
        objective=finite(best.objective),
        lost=best.lost,
        flights=search.flights,
        seeds=search.each.every,
        tuned=len(search.asked.gains),
        seed=task.seed,
        violation=best.violation if math.isfinite(best.violation) else 1.0,
        margins={name: best.parts[name] for name in search.stability.limits if name in best.parts},
        unconstrained=search.unconstrained,
    )


def check_task(task: TuningTask) -> int:
    """How many gains are tuned. Refuses a budget that is too small for them, and gains that cannot be tuned. Raises
    UserError.
    """
    path = Path(task.source)
    with errors_in(task.source, f"{task.label} cannot be tuned"):
        wanted = [tuning_request(path, "", content, task.folder) for content in task.missions]
    each, gains = flights_of(one.seeds for one in wanted), len(wanted[0].gains)
    count = population(gains, each.first)
    least = each.every + FEWEST_GENERATIONS * each.most(count)
    if task.budget < least:
        raise UserError(
            f"{task.source}: tuning.budget: {task.budget} flights are too few for the {gains} gains of {task.label}; "
            f"at least {least} are needed: {FEWEST_GENERATIONS} generations of {count} candidates, {each.first} to "
            f"{counted(each.every, 'flight')} each"
        )
    return gains

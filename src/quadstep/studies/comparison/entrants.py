"""Who takes part in a study: every controller with what it knows, and the gains that it flies with on each vehicle; and the
results of all of them, in numbers.
"""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from quadstep.interfaces.controller import BodyRates, Command, Controller, RotorSpeeds, RotorThrusts
from quadstep.io.documents import parse_json, read_json
from quadstep.io.errors import MissingExtraError, UserError, errors_in
from quadstep.io.grouping import by_first
from quadstep.io.parts import Parts
from quadstep.io.user_code import in_one_line
from quadstep.metrics.registry import EFFORTS
from quadstep.metrics.statistics import Estimate
from quadstep.metrics.verdict import Graded
from quadstep.studies.comparison import ranking, training
from quadstep.studies.comparison.cells import ComparisonStudy, Situation
from quadstep.studies.comparison.cost import Cost
from quadstep.studies.comparison.jobs import Job, tuning
from quadstep.studies.comparison.ranking import CellFlights, Effort, Ranked, Spread, losses, spread
from quadstep.studies.comparison.robustness import Linear, Margin
from quadstep.studies.comparison.schema import Content, ControllerEntry, MarginEntry

QUANTILES_FROM = 20
"""Flights a cell, of which the 95 % quantile is one and the largest another."""

NEWER = training.Trained._field_defaults
"""What older files of gains do not say."""

COMMANDS = {
    Command: "thrust and torque",
    BodyRates: "thrust and body rates",
    RotorThrusts: "rotor thrusts",
    RotorSpeeds: "rotor speeds",
}


class Entrant(NamedTuple):
    """A controller on a vehicle. table: of a mission, with all that it knows and its gains. origin: of the gains, in words.

    trained: how they were found; None where they are frozen. law: what it is. others: with the gains of other searches.
    """

    vehicle: str
    name: str
    table: Content
    origin: str
    law: type[Controller]
    trained: training.Trained | None = None
    others: tuple["Entrant", ...] = ()

    @property
    def differs(self) -> tuple[str, str, str, str]:
        """In what it differs from others beside its law: commands, what more it measures, how far it looks ahead, sample
        times.
        """
        law = self.law
        loops = ", ".join(f"{name} {1e3 * period:g} ms" for name, period in law.rates.items())
        ahead = f"{max(law.preview):g} s" if law.preview else ""
        return COMMANDS.get(law.commands, law.commands.__name__), ", ".join(law.also_measures), ahead, loops


class EntrantSearch(NamedTuple):
    """An entrant whose gains are to be found. jobs: a search each; none where they are given."""

    entrant: Entrant
    jobs: tuple[Job[training.TuningTask], ...] = ()


class Problem(NamedTuple):
    """What keeps a controller from taking part. controller: vehicle and name; None where it is all of a situation's."""

    controller: tuple[str, str] | None
    lines: Sequence[str]

    @property
    def line(self) -> str:
        return "; ".join(self.lines)


def entrants(
    study: ComparisonStudy, parts: Parts, again: bool, local: bool
) -> tuple[list[EntrantSearch], list[Problem], tuple[str, ...]]:
    """Everybody, who cannot take part, and a sentence for each that is optional and whose package is absent. again: tune also
    what the study has gains for. local: whether journals can be kept.

    Raises UserError for a file of gains that cannot be read.
    """
    given = {} if again else gains_file(study)
    found: list[EntrantSearch] = []
    problems: list[Problem] = []
    absent: dict[str, str] = {}
    for vehicle in study.file.vehicles:
        for name, entry in study.controllers(vehicle).items():
            try:
                with in_one_line():
                    found.append(entrant(study, parts, vehicle, name, entry, given, local))
            except UserError as error:
                if entry.optional and isinstance(error, MissingExtraError):
                    absent[name] = f"{name} is left out: {error}"
                    continue
                said = [line.removeprefix(f"{study.source}: ") for line in error.lines]
                named = said[0].startswith(f"{name} ") or f"{name} on {vehicle}" in said[0]
                about = f"{study.source}: {name} cannot fly {vehicle}"
                lines = error.lines if named else [f"{about}: {one}" for one in said]
                problems.append(Problem((vehicle, name), lines))
    return found, problems, tuple(absent.values())


def entrant(
    study: ComparisonStudy, parts: Parts, vehicle: str, name: str, entry: ControllerEntry,
    given: Mapping[str, list[Content]], local: bool,
) -> EntrantSearch:  # fmt: skip
    """One of them. Raises UserError."""
    table = study.knowing(vehicle, entry.controller)
    mission = study.nominal(vehicle, table)
    mission.plan(study.folder, warn=True)
    law = mission.controller.controller
    if entry.frozen is not None or study.file.tuning is None:
        return EntrantSearch(Entrant(vehicle, name, table, entry.frozen or "as given", law))
    tasks = [training.task(study, vehicle, name, entry, table, repeat) for repeat in range(study.file.tuning.repeats)]
    known = given.get(f"{name} on {vehicle}")
    if known:
        origin = f"from {study.file.tuning.gains}"
        return EntrantSearch(tuned(study, Entrant(vehicle, name, table, origin, law), [trained_of(one) for one in known]))
    training.check_task(tasks[0])
    folder = parts.folder.path.absolute() if local else None
    return EntrantSearch(Entrant(vehicle, name, table, "tuned", law), tuple(tuning(task, folder) for task in tasks))


def with_gains(study: ComparisonStudy, search: EntrantSearch, kept: Parts) -> Entrant:
    """An entrant with the gains that were found for it."""
    if not search.jobs:
        return search.entrant
    parts = [(job, kept.read(job.kind, job.key)) for job in search.jobs]
    return tuned(study, search.entrant, [trained_of(parse_json(part, job.label)) for job, part in parts if part])


def tuned(study: ComparisonStudy, entrant: Entrant, trained: list[training.Trained]) -> Entrant:
    """An entrant with the best gains of some searches, and others with those of each other search."""
    first, *others = (
        entrant._replace(table=study.with_gains(entrant.vehicle, entrant.table, one.values), trained=one)
        for one in sorted(trained, key=lambda one: one.order)
    )
    return first._replace(others=tuple(others))


def trained_of(content: Content) -> training.Trained:
    """Gains from JSON. Raises UserError."""
    try:
        found = training.Trained._make(
            content.get(name, NEWER[name]) if name in NEWER else content[name] for name in training.Trained._fields
        )
        _ = {str(key): float(value) for one in (found.values, found.before) for key, value in one.items()}
    except (KeyError, TypeError, ValueError, AttributeError):
        raise UserError("gains: not in the form that `quadstep compare` writes") from None
    return found


def gains_file(study: ComparisonStudy) -> dict[str, list[Content]]:
    """The gains that a study brings along, by controller and vehicle, of each search. Raises UserError."""
    name = study.file.tuning.gains if study.file.tuning else None
    if name is None:
        return {}
    path = study.folder / name
    with errors_in(study.source, "tuning.gains"):
        content = read_json(path)
    try:
        return by_first((str(one["controller"]), one) for one in content["gains"])
    except (KeyError, TypeError):
        raise UserError(f"{path}: is not a file of gains written by `quadstep compare`") from None


def write_gains(path: Path, entrants: list[Entrant]) -> None:
    """gains.json: what was tuned, the best search first, so that another study can take it from there."""
    every = [each for one in entrants for each in (one, *one.others)]
    gains = [{"controller": f"{one.name} on {one.vehicle}", **one.trained._asdict()} for one in every if one.trained]
    path.write_text(json.dumps({"gains": gains}, indent=1) + "\n", encoding="utf-8")


class SituationResult(NamedTuple):
    """A controller in a situation. spreads: by metric. grade: of its median flight; None where an autopilot flies it."""

    situation: Situation
    controller: str
    flights: int
    lost: Estimate
    spreads: dict[str, Spread]
    effort: Effort
    grade: Graded | None = None


class Comparison(NamedTuple):
    """All of a study. metrics: names with units by names without, the first of which ranks. ranked: by situation. margins: by
    their name, vehicle and controller. costs, linear (the loop at rest): by vehicle and controller. problems: what could not
    take part, or went wrong. notes: of whoever wrote the study, on its limits. left_out: who could not take part and
    need not, a sentence each. tuned_in: situations that gains were tuned in, marked as such. unlike: in what
    missions differ, a sentence. limits: above which a position RMSE is a large error [m].
    """

    name: str
    source: str
    seeds: int
    seed: int
    metrics: dict[str, str]
    results: tuple[SituationResult, ...] = ()
    ranked: Mapping[Situation, Ranked] = {}
    entrants: tuple[Entrant, ...] = ()
    margins: Mapping[tuple[str, str, str], Margin] = {}
    raised: Mapping[str, MarginEntry] = {}
    costs: Mapping[tuple[str, str], Cost] = {}
    problems: tuple[Problem, ...] = ()
    tuned_in: frozenset[Situation] = frozenset()
    linear: Mapping[tuple[str, str], Linear] = {}
    notes: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()
    unlike: str = ""
    limits: Mapping[Situation, float] = {}

    @property
    def metric(self) -> str:
        return next(iter(self.metrics))

    @property
    def controllers(self) -> list[str]:
        return list(dict.fromkeys(one.controller for one in self.results))

    @property
    def kind(self) -> str:
        """What is compared: controllers that a study puts into situations, or missions, which have one without a name."""
        return "controller" if any(one.label for one in self.ranked) else "mission"

    def table(
        self, header: Sequence[str], rows: Sequence[Sequence[str]], text: str = "", once: bool = False
    ) -> tuple[list[str], list[list[str]], str]:
        """A table and its text, its column of controllers called as they are counted, without its column of vehicles where all
        are one. once: what else is the same for all several rows is said in the text, too, and has no column.
        """
        columns = dict(zip(header, zip(*rows, strict=True), strict=True))
        alike = [name for name, cells in columns.items() if len({*cells}) == 1 and (name == "vehicle" or (once and rows[1:]))]
        same = [f"{name} {columns[name][0]}" for name in alike if name != "vehicle" and columns[name][0] != "-"]
        kept = {self.kind if name == "controller" else name: cells for name, cells in columns.items() if name not in alike}
        said = [text] * bool(text) + [f"The same for all: {'; '.join(same)}."] * bool(same)
        return [*kept], [[*row] for row in zip(*kept.values(), strict=True)] if len(kept) > 1 else [], " ".join(said)

    @property
    def vehicles(self) -> list[str]:
        return list(dict.fromkeys(one.vehicle for one in self.ranked))

    @property
    def shared(self) -> tuple[str, ...]:
        """Vehicle, path and scenario as far as several situations have them in common, each empty where they differ."""
        parts = list(zip(*self.ranked, strict=True)) if len(self.ranked) > 1 else []
        return tuple(one[0] if len(set(one)) == 1 else "" for one in parts) or ("", "", "")

    def place(self, situation: Situation, whole: bool = False) -> str:
        """The path and the scenario of a situation, as far as they differ in others. whole: with the vehicle."""
        parts = list(zip(situation, self.shared, strict=True))
        return ", ".join(name for name, same in parts[0 if whole else 1 :] if name and not same)

    @property
    def limitations(self) -> tuple[str, ...]:
        """Of the study, and of this run of it."""
        return (*self.notes, *self.left_out)

    @property
    def copies(self) -> bool:
        """Whether no flight differs from others of its cell anywhere, so that there is nothing to test."""
        return bool(self.ranked) and all(one.copies for one in self.ranked.values())

    @property
    def spreads(self) -> bool:
        """Whether flights of one controller in one situation differ."""
        return self.seeds > 1 and not self.copies

    @property
    def pairs(self) -> int:
        """How many were compared: the size of each family of tests."""
        return sum(len(one.pairs) for one in self.ranked.values() if not one.copies)

    def of(self, situation: Situation) -> list[SituationResult]:
        return [one for one in self.results if one.situation == situation]

    @property
    def high(self) -> str:
        """What the upper value of a cell is; of few flights the 95 % quantile is no other than the largest."""
        return "95 % quantile" if self.seeds >= QUANTILES_FROM else "largest"

    @property
    def undecided(self) -> int:
        """Pairs of which it is not shown who keeps closer to its path."""
        return sum(pair.winner is None for one in self.ranked.values() if not one.copies for pair in one.pairs)

    @property
    def searches(self) -> int:
        """The fewest searches for the gains of any controller that was tuned; 0 where none was."""
        return min((1 + len(one.others) for one in self.entrants if one.trained), default=0)


def result(
    situation: Situation, controller: str, flown: CellFlights, metrics: Mapping[str, str], grade: Graded | None
) -> SituationResult:
    spreads, effort = {name: spread(flown, name) for name in metrics}, Effort(*map(flown.mean, EFFORTS))
    return SituationResult(situation, controller, len(flown.lost), losses(flown), spreads, effort, grade)


def ranks(flown: Mapping[Situation, Mapping[str, CellFlights]], metric: str) -> dict[Situation, Ranked]:
    """Every situation, p-values corrected over all of them."""
    found = [ranking.compare(one, metric) for one in flown.values()]
    return dict(zip(flown, ranking.corrected(found), strict=True))

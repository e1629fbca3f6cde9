"""Exercises that grade themselves: a mission solves a task by what it flies, not by how it is written.

The package's own are those of the lessons, `lessons.toml`; a course may have a file of its own.
"""

import json
from contextlib import suppress
from pathlib import Path
from typing import Annotated, NamedTuple, cast

from pydantic import BeforeValidator, Field

from quadstep.interfaces.closed_loop import Outcome
from quadstep.io.documents import read_toml
from quadstep.io.errors import UserError, listed, shorten
from quadstep.linear.grade import Grade, grade, margin_metrics
from quadstep.metrics.registry import MARGINS, SOUND
from quadstep.metrics.requirements import Requirement, with_full_names
from quadstep.metrics.requirements import unit as unit_of
from quadstep.metrics.verdict import Case, scalars
from quadstep.mission.check import check
from quadstep.mission.fields import Finite, Name, Section, Several, as_tuple, dotted, key_parts, plain, unit
from quadstep.mission.read import check_mission
from quadstep.mission.schema import Mission
from quadstep.report.units import DIGITS, number, suited, unit_suffix
from quadstep.studies.interface import fly
from quadstep.studies.tuning.gains import looked_up

OWN = Path(__file__).parent / "lessons.toml"
HARMLESS = ("name", "tune")
"""Keys that move no flight and no grade."""

SAID = {"position_rmse": "RMSE", "largest_tilt": "tilt", "u.largest": "largest thrust"}
ERRORS = {"rmse": "RMSE", "largest": "largest error", "final": "final error"}
"""Metrics as the lessons call them, and last names of those of one axis."""


class LessonTask(Section):
    """What a mission has to do. same: values that its keys must have; free: keys that a student may change, beside those with
    limits: all others must be as they are by default (None: any may be changed); most, least: limits of metrics of its flight,
    of margins of its loop at rest, or of its keys and all their entries, in SI units; lost: whether the flight has to be lost;
    grade: of its loop at rest; own: whether its controller must be the student's.
    """

    name: Name
    asks: str
    hint: str = ""
    same: dict[str, object] = Field(default_factory=dict)
    free: Annotated[tuple[str, ...] | None, BeforeValidator(as_tuple)] = None
    most: dict[str, Finite] = Field(default_factory=dict)
    least: dict[str, Finite] = Field(default_factory=dict)
    lost: bool = False
    grade: Annotated[str, Field(pattern="^(sound|fragile)?$")] = ""
    own: bool = False


class Tasks(Section):
    """A file of tasks."""

    tasks: Annotated[Several[LessonTask], Field(min_length=1)]


class CheckedTask(NamedTuple):
    """A task held against a mission. strange: whether it is another mission than the task's, which was not flown for it."""

    task: LessonTask
    cases: tuple[Case, ...]
    strange: bool

    @property
    def solved(self) -> bool:
        return not any(case.failure for case in self.cases)


class MeasuredMission(NamedTuple):
    """Of a flight: numbers by metric, the grade of its loop at rest if asked for, and how it ended if before its time."""

    numbers: dict[str, float | None]
    grade: Grade | None
    lost: str | None


def tasks(lesson: str, source: Path = OWN) -> list[LessonTask]:
    """The tasks of a lesson, `4`, or one of them, `4.4`. Raises UserError."""
    found = check(Tasks, read_toml(source), str(source), source.parent).tasks
    chosen = [one for one in found if lesson in (one.name, one.name.partition(".")[0])]
    if not chosen:
        of, _, exercise = lesson.partition(".")
        graded = ", ".join(one.name for one in found if exercise.isdecimal() and one.name.startswith(f"{of}."))
        if graded:
            raise UserError(f"lesson {of} has no graded exercise {lesson:.20}, only {' and '.join(graded.rsplit(', ', 1))}")
        known = listed(dict.fromkeys((*(one.name.partition(".")[0] for one in found), *(one.name for one in found))))
        raise UserError(f"unknown lesson or exercise {shorten(lesson)}; allowed: {known}")
    return chosen


def check_tasks(tasks: list[LessonTask], mission: Mission) -> list[CheckedTask]:
    """Tasks held against a mission, which flies once, if it is the mission of one of them. Raises UserError."""
    content = plain(mission.model_dump())
    strange = [differing_keys(one, mission, content) for one in tasks]
    if all(strange):
        return [CheckedTask(one, cases, True) for one, cases in zip(tasks, strange, strict=True)]
    flight, rest = fly(mission), any(one.grade for one in tasks)
    lost = None if flight.outcome is Outcome.COMPLETED else f"was lost at {flight.ended:g} s"
    named = {name for one in tasks for name in (*one.most, *one.least) if name in MARGINS}
    margins = {name + MARGINS[name]: size for name, size in margin_metrics(mission, named).items()} if named else {}
    measured = MeasuredMission({**scalars(flight.metrics()), **margins}, grade(mission) if rest else None, lost)
    return [
        CheckedTask(one, cases or judge_flight(one, mission, content, measured), bool(cases))
        for one, cases in zip(tasks, strange, strict=True)
    ]


def grade_cell(name: str, mission: Mission) -> None:
    """For a notebook that is graded. Raises AssertionError, with what is not met, where a mission does not solve a task."""
    (found,) = check_tasks(tasks(name), mission)
    if not found.solved:
        raise AssertionError("; ".join(case.failure for case in found.cases if case.failure))


def differing_keys(task: LessonTask, mission: Mission, content: object) -> tuple[Case, ...]:
    """Keys in which a mission is another than the task's."""
    found = []
    absent: dict[str, list[str]] = {}
    for key, wanted in task.same.items():
        value = at(mission, content, key)
        table, place, *rest = (*key_parts(key), "")
        if place.isdecimal() and rest[1:] and nested_values(content, [table, place]) is None:
            absent.setdefault(table, []).append(f"{'.'.join(rest[:-1])} = {shown(wanted)}")
        elif value != wanted:
            found.append(Case(key, wrong(key, shown(wanted), shown(value))))
    found += [Case(table, f"the mission has no [[{table}]] with {', '.join(keys)}") for table, keys in absent.items()]
    if task.own and not mission.controller.own:
        law = shown(mission.controller.type)
        found.append(Case("controller.type", wrong("controller.type", "a law of your own, FILE.py:NAME", law)))
    return tuple(found or changed_keys(task, mission))


def changed_keys(task: LessonTask, mission: Mission) -> list[Case]:
    """Keys that a task neither names nor leaves to the student, and that are not as they are by default."""
    if task.free is None:
        return []
    named = [key_parts(key) for key in (*task.same, *task.free, *task.most, *task.least, *HARMLESS)]
    given, *full = (cast("dict[str, object]", plain(mission.model_dump(exclude_unset=unset))) for unset in (True, False))
    try:
        full.append(cast("dict[str, object]", plain(check_mission(only(given, named), "", mission.folder).model_dump())))
    except UserError as error:
        return [Case("mission", f"only {', '.join((*task.same, *task.free))} may be given; with these alone{error}")]
    found, wanted = (dotted(one) for one in full)
    return [
        Case(key, wrong(key, shown(wanted.get(key)), shown(found.get(key))))
        for key in dict.fromkeys((*found, *wanted))
        if found.get(key) != wanted.get(key)
    ]


def only(content: object, named: list[list[str]]) -> object:
    """What tables and lists have at these places, and on the way there."""
    if [] in named:
        return content
    entries = content if isinstance(content, dict) else dict(enumerate(content)) if isinstance(content, list) else {}
    below = {key: [rest for first, *rest in named if first == str(key)] for key in entries}
    kept = {key: only(value, below[key]) for key, value in entries.items() if below[key]}
    return list(kept.values()) if isinstance(content, list) else kept


def judge_flight(task: LessonTask, mission: Mission, content: object, measured: MeasuredMission) -> tuple[Case, ...]:
    """A flight held against a task. Raises UserError for a limit of what neither the mission nor its flight has."""
    if task.lost:
        cases = [Case("the flight was lost", None if measured.lost else "the flight should be lost, but was completed")]
        measured = measured._replace(lost=None)  # its limits hold until then
    else:
        cases = [Case("the flight completed", measured.lost and f"the flight should be completed, but {measured.lost}")]
    for word, limits in (("at most", task.most), ("at least", task.least)):
        cases += filter(None, (judge_limit(name, word, limit, mission, content, measured) for name, limit in limits.items()))
    if task.grade and measured.grade:
        found = measured.grade
        poor = found.word not in (SOUND, task.grade)
        failure = wrong("the loop", task.grade, f"{found.word}: {found.why}") if poor else None
        cases.append(Case(f"the loop is {task.grade}", failure))
    return tuple(cases)


def judge_limit(name: str, word: str, limit: float, mission: Mission, keys: object, measured: MeasuredMission) -> Case | None:
    """A key, all its entries, or a metric held against a limit. word: at most, at least. None: a metric of a lost flight."""
    value = at(mission, keys, name)
    entries, of, what = value if isinstance(value, list) else [value], unit(mission, name), name
    if not all(isinstance(one, int | float) for one in entries):
        if measured.lost and name not in MARGINS:
            return None
        (required,) = with_full_names([Requirement(name, limit)], measured.numbers)
        entries, of, what = [measured.numbers[required.metric]], unit_of(required.metric), in_words(name)
    found = None if None in entries else max(entries) if word == "at most" else min(entries)
    missed = found is None or (found > limit if word == "at most" else found < limit)
    wanted = f"{word} {sized(limit, of)}"
    is_now = "never reached" if found is None else sized(found, of, limit)
    return Case(f"{what} {wanted}", wrong(what, wanted, is_now) if missed else None)


def in_words(metric: str) -> str:
    """`RMSE along x` of `position.x.rmse`."""
    first, _, rest = metric.partition(".")
    axis, _, last = rest.partition(".")
    if first == "position" and last in ERRORS:
        return f"{ERRORS[last]} along {axis}"
    return SAID.get(metric, metric.replace("_", " ").replace(".", " "))


def sized(value: float, of: str, limit: float | None = None) -> str:
    """A number as people read it. limit: what it does not keep: so many digits that the two differ; without it, no zeros
    at its end.
    """
    of, factor = suited(of or "-", abs(value))
    if limit is None:
        return f"{factor * value:.4g}{unit_suffix(of)}".replace("\N{NO-BREAK SPACE}", " ")
    digits = next((one for one in range(DIGITS, 9) if f"{value:.{one}g}" != f"{limit:.{one}g}"), 9)
    return f"{number(factor * value, digits)}{unit_suffix(of)}".replace("\N{NO-BREAK SPACE}", " ")


def wrong(what: str, wanted: str, found: str) -> str:
    return f"{what} should be {wanted}, but is {found}"


def at(mission: Mission, content: object, key: str) -> object:
    """The value of a dotted key, also of a gain that the mission leaves out; None where there is none."""
    first, *names = key_parts(key)
    value = nested_values(content, [first, *names])
    if value is None and first == "controller" and names:
        with suppress(UserError):
            return plain(looked_up(mission, names, key))
    return value


def nested_values(content: object, names: list[str]) -> object:
    """What tables and lists have under these names; None where they do not."""
    for part in names:
        if isinstance(content, dict):
            content = content.get(part)
        elif isinstance(content, list) and part.isdigit() and int(part) < len(content):
            content = content[int(part)]
        else:
            return None
    return content


def shown(value: object) -> str:
    return "left out" if value is None else json.dumps(value, ensure_ascii=False)

"""The question of `quadstep what-if`, and its answer in words, tables and a figure."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadstep.interfaces.closed_loop import Outcome
from quadstep.interfaces.controller import Controller
from quadstep.interfaces.gain import Gain
from quadstep.interfaces.log import FlightLog
from quadstep.io import __version__
from quadstep.linear.grade import Grade
from quadstep.metrics.registry import EFFORTS
from quadstep.metrics.statistics import Estimate, finite, share, share_difference
from quadstep.mission.data_files import briefly
from quadstep.mission.schema import Mission
from quadstep.report import markup, units
from quadstep.report.drawing import FigureJob
from quadstep.report.evidence import Evidence, Figure, TableSection
from quadstep.report.panel import Panel
from quadstep.studies.tuning.objective import CandidateFlights, Row, rows

PICTURE = "step"
HEADER = ("", "before", "after", "after - before")
SIDES = HEADER[1:3]
AT_REST = "For the loop hovering in calm air. In wind or in motion the loop is different, and is not graded here."
Floats = NDArray[np.float64]


STEP = 0.5
"""Size of the step in calm air, ahead and to the left [m]."""


class Question(NamedTuple):
    """A question. file: of parameters, or the law's name for its defaults. changes: by name. vehicle: a preset, or its file.

    wind: largest mean wind along each horizontal axis, and that which sets the turbulence [m/s]. within: further than this
    from its place, a flight has failed [m]. unmodelled: what else changes, and no law uses.
    """

    file: str
    changes: Mapping[str, float]
    vehicle: str
    wind: float = 3.0
    flights: int = 1000
    seed: int = 1
    within: float = 1.0
    unmodelled: tuple[str, ...] = ()


class Side(NamedTuple):
    """Before or after. step: of the calm flight. flown: in gusts."""

    step: FlightLog
    grade: Grade
    flown: CandidateFlights


def picture(before: FlightLog, after: FlightLog) -> FigureJob:
    """Both steps: how far of the way, and how it leans on it."""
    count = min(len(one.column("t")) for one in (before, after))
    both = tuple(zip(SIDES, (before, after), strict=True))
    panels = [Panel("x", "m", {name: one.column("x")[:count] for name, one in both})]
    panels += [Panel("y", "m", {name: one.column("y")[:count] for name, one in both})]
    panels += [Panel("tilt", "°", {name: tilt(one)[:count] for name, one in both})]
    return FigureJob(PICTURE, "A step in calm air", before.column("t")[:count], panels)


def tilt(log: FlightLog) -> Floats:
    """From the vertical [deg]."""
    level = np.cos(log.column("pitch")) * np.cos(log.column("roll"))
    return np.degrees(np.arccos(np.clip(level, -1.0, 1.0)))


def response(log: FlightLog) -> dict[str, float]:
    """Rise time from 10 to 90 % of the way [s], and overshoot; NaN where it is not reached."""
    t, way = log.column("t"), 0.5 * (log.column("x") + log.column("y")) / STEP
    first, last = (np.flatnonzero(way >= level) for level in (0.1, 0.9))
    rise = float(t[last[0]] - t[first[0]]) if len(last) else np.nan
    return {"rise time [s]": rise, "overshoot [%]": 100.0 * max(0.0, float(way.max()) - 1.0) if len(last) else np.nan}


def failing(sides: tuple[Side, Side], flights: int) -> tuple[Estimate, Estimate, Estimate]:
    """Shares of failed flights before and after, and by how much they differ."""
    lost = [np.not_equal(one.flown.outcome, Outcome.COMPLETED) for one in sides]
    more, fewer = int((lost[1] & ~lost[0]).sum()), int((lost[0] & ~lost[1]).sum())
    return share(int(lost[0].sum()), flights), share(int(lost[1].sum()), flights), share_difference(more, fewer, flights)


def evidence(
    asked: Question, law: type[Controller], mission: Mission, before: Mapping[str, float], sides: tuple[Side, Side]
) -> Evidence:
    failed = failing(sides, asked.flights)
    measured = rows(("position_rmse", "largest_error", *EFFORTS), sides[0].flown, sides[1].flown)
    steps = [response(one.step) for one in sides]
    changed = [(name, law.by_key()[name][1], before[f"controller.{name}"], value) for name, value in asked.changes.items()]
    words = units.listed([f"{name} = {value:g} ({old:g} before)" for name, _, old, value in changed])
    air = f"in wind of up to {asked.wind:g} m/s from every side, with turbulence" if asked.wind else "in still air"
    gusts = f"{units.counted(asked.flights, 'flight')} {air}"
    lost, hover = (
        f"are lost or drift by more than {asked.within:g} m",
        "Hovering in calm air, where alone it is graded, the loop",
    )
    answer = (
        f"With {words} {units.percent(*failed[1])} of {gusts}, {lost}; "
        f"before, {units.percent(*failed[0])}. {compared(failed[2])} {''.join(map(tracking, measured))}{hover} "
        f"is {sides[1].grade.word}; before, {sides[0].grade.word}."
    )
    if idle(sides):
        answer = (
            f"With {words} nothing that was flown differs by a bit from before, neither {gusts}, nor a step of {STEP:g} m: "
            f"they do not show what it does. {units.percent(*failed[1])} {lost}. {hover} is {sides[1].grade.word}."
        )
    tables = [
        TableSection("What changes", "changes", ("parameter", "before", "after", ""), [cells(*one) for one in changed]),
        TableSection(
            "In gusts", "gusts", HEADER,
            [failed_row(failed), *(metric_row(one) for one in measured)],
            f"{gusts}, the same for both; 95 % intervals. Differences are paired, over flights completed with both.",
            shown="In gusts, 95 % intervals",
        ),
        TableSection("At rest", "margins", HEADER[:3], margin_rows(sides), AT_REST, shown="Least margins at rest"),
        TableSection("A step in calm air", "steps", HEADER, step_rows(*steps), shown=f"A step of {STEP:g} m in calm air"),
    ]  # fmt: skip
    record: dict[str, object] = {
        "name": mission.name, "version": __version__, "asked": {**asked._asdict(), "changes": dict(asked.changes)},
        "law": law.name, "unmodelled": mission.controller.left, "before": {name: old for name, _, old, _ in changed},
        "failed": {name: one.as_json() for name, one in zip(("before", "after", "difference"), failed, strict=True)},
        "metrics": {one.name: recorded(one) for one in measured},
        "grades": {
            name: {"grade": one.grade.word, "why": one.grade.why} for name, one in zip(SIDES, sides, strict=True)
        },
        "step": {name: {key: finite(one) for key, one in step.items()} for name, step in zip(SIDES, steps, strict=True)},
    }  # fmt: skip
    return Evidence(
        name=mission.name,
        kind="What if",
        answer=answer,
        sentences=[answer],
        record=record,
        facts=[
            markup.Fact(f"fail in gusts, {name}", units.percent(one.value), f"95 %: {units.percent(*one)}")
            for name, one in zip(SIDES, failed, strict=False)
        ],
        figures=[Figure(PICTURE, caption(steps), label="Step")],
        sections=tables,
        warnings=[*hidden_effects(asked), *mission.controller.warnings(mission.modelled)],
        grade={"grade": sides[1].grade.word, "why": sides[1].grade.why},
        whose="the hovering loop with the change",
    )


def idle(sides: tuple[Side, Side]) -> bool:
    """Whether the change has no effect on anything that was flown."""
    both = [(one.step.rows, one.flown.metrics, one.flown.outcome) for one in sides]
    return all(np.array_equal(old, new, equal_nan=True) for old, new in zip(*both, strict=True))


def caption(steps: Sequence[dict[str, float]]) -> str:
    """What to see of the step: what it measures, before and after."""
    said = []
    for (words, unit), one, other in zip(map(units.metric, steps[0]), steps[0].values(), steps[1].values(), strict=True):
        said.append(f"{words.strip()} {units.number(one)} {unit} before, {units.number(other)} {unit} after")
    return f"A step of {STEP:g} m along x and y in calm air: {'; '.join(said)}."


def hidden_effects(asked: Question) -> list[str]:
    """What the flights do not show of a change, as a warning."""
    more = asked.unmodelled
    if not more:
        return []
    changed = "changes, too, and is" if len(more) == 1 else "change, too, and are"
    return [f"{briefly(more)} {changed} not modelled: the flights do not show what comes of it"]


def compared(difference: Estimate) -> str:
    """Whether more or fewer flights fail, if that is shown."""
    low, high = 100.0 * difference.low, 100.0 * difference.high
    if low > 0.0 or high < 0.0:
        return f"{'More' if low > 0.0 else 'Fewer'} fail: {100.0 * difference.value:+.3g} points [{low:+.3g}, {high:+.3g}]."
    return f"A difference is not shown: {100.0 * difference.value:+.3g} points [{low:+.3g}, {high:+.3g}]."


LARGE = 0.1
"""Share of itself by which an effort changes so that the first sentences say it."""


def tracking(one: Row) -> str:
    """Whether flights that end well with both stray further or less, or take much more or less effort, if that is shown; a
    sentence and a blank.

    Means before and after are of different flights where some are lost with one of them, and may say the contrary.
    """
    (words, unit), change, before = units.metric(one.name), one.difference, one.present.value if one.present else 0.0
    error, much = words == "position RMSE", change is not None and abs(change.value) >= LARGE * abs(before)
    if change is None or not (change.low > 0.0 or change.high < 0.0) or not (error or (much and words != "largest error")):
        return ""
    share = "" if error or not before else f" ({units.percent(abs(change.value) / before)})"
    way, by = "rises" if change.low > 0.0 else "falls", units.quantity(abs(change.value), unit)
    return f"The {words} of flights completed with both {way} by {by}{share}. "


def cells(name: str, gain: Gain, old: float, new: float) -> tuple[str, ...]:
    return name, units.number(old), units.number(new), f"{gain.unit}; {gain.meaning}"


def failed_row(failed: tuple[Estimate, Estimate, Estimate]) -> list[str]:
    return ["fail", units.percent(*failed[0]), units.percent(*failed[1]), points(failed[2])]


def points(one: Estimate) -> str:
    return f"{100.0 * one.value:+.3g} [{100.0 * one.low:+.3g}, {100.0 * one.high:+.3g}] points"


def metric_row(one: Row) -> list[str]:
    words, unit = units.metric(one.name)
    return [words, *units.in_one_unit(one[1:], unit)]


def recorded(one: Row) -> dict[str, object]:
    """A row for metrics.json."""
    parts = zip(("before", "after", "difference"), one[1:], strict=True)
    return {name: part.as_json() if isinstance(part, Estimate) else None for name, part in parts}


def margin_rows(sides: tuple[Side, Side]) -> list[list[str]]:
    """The grades, and the least margins where both have some."""
    words = ["grade", *(one.grade.word for one in sides)]
    pairs = zip(*(one.grade.measures for one in sides), strict=False)
    return [
        words,
        *([f"{old.what} margin", *(f"{one.text(one.value)} ({one.channel})" for one in (old, new))] for old, new in pairs),
    ]


def step_rows(before: dict[str, float], after: dict[str, float]) -> list[list[str]]:
    return [
        [name, units.number(one), units.number(after[name]), units.number(after[name] - one)] for name, one in before.items()
    ]

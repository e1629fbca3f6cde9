"""The question of `quadstep what-if`, and its answer in words, tables and a figure."""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadstep.interfaces.closed_loop import Outcome
from quadstep.interfaces.controller import Controller
from quadstep.interfaces.gain import Gain
from quadstep.interfaces.log import FlightLog
from quadstep.io import __version__
from quadstep.linear.grade import UNSTABLE, Grade, Measure
from quadstep.metrics.registry import EFFORTS, SOUND
from quadstep.metrics.statistics import Estimate, finite
from quadstep.mission.data_files import briefly
from quadstep.mission.schema import Mission
from quadstep.report import markup, units
from quadstep.report.drawing import FigureJob
from quadstep.report.evidence import Evidence, Figure, TableSection
from quadstep.report.panel import Panel
from quadstep.studies.tuning.objective import CandidateFlights, Row, rows, shares_of

PICTURE = "step"
SIDES = ("before", "after")
Floats = NDArray[np.float64]
STEP = 0.5
"""Size of the step in calm air, ahead and to the left [m]."""


class Question(NamedTuple):
    """A question. file: of parameters, or the law's name for its defaults. changes: by name. vehicle: a preset, or its file.

    wind: largest mean wind along each horizontal axis, and that which sets the turbulence [m/s]. within: further than this
    from its target, a flight has failed [m]. unmodelled: what else changes, and no law uses. notes: warnings.
    """

    file: str
    changes: Mapping[str, float]
    vehicle: str
    wind: float = 3.0
    flights: int = 1000
    seed: int = 1
    within: float = 1.0
    unmodelled: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


class Side(NamedTuple):
    """Before or after. step: of the calm flight. flown: in gusts."""

    step: FlightLog
    grade: Grade
    flown: CandidateFlights


SIGNALS = {"m": "xyz", "°": ("roll", "pitch", "yaw"), "°/s": "pqr"}
"""Columns of a step by the unit in which they are drawn."""


def picture(before: FlightLog, after: FlightLog) -> FigureJob:
    """Both steps, where and while their lines are seen to be two: position, attitude and rate, each along the axis that
    changes most.
    """
    count, panels = min(len(one.column("t")) for one in (before, after)), []
    for unit, names in SIGNALS.items():
        turn = 1.0 if unit == "m" else math.degrees(1.0)
        along = [[turn * one.column(name)[:count] for one in (before, after)] for name in names]
        drawn = [Panel(name, unit, dict(zip(SIDES, pair, strict=True))) for name, pair in zip(names, along, strict=True)]
        panels.append(max(drawn, key=lambda one: float(apart(one).max())))
    several = [apart(one) > 0.04 * np.ptp([*one.lines.values()]) for one in panels]
    panels = [one for one, two in zip(panels, several, strict=True) if two.any()] or panels
    seen = np.flatnonzero(np.any(several, axis=0))
    around = max(20, np.ptp(seen) // 8) if len(seen) else 0
    shown = slice(max(0, seen[0] - around), seen[-1] + around) if len(seen) else slice(None)
    kept = [one._replace(lines={side: line[shown] for side, line in one.lines.items()}) for one in panels]
    columns = 2 if len(kept) == 2 else 1
    return FigureJob(PICTURE, "A step in calm air", before.column("t")[:count][shown], kept, columns)


def apart(panel: Panel) -> Floats:
    """How far before and after are from each other."""
    return np.asarray(np.abs(np.subtract(*panel.lines.values())))


def response(side: Side) -> dict[str, float]:
    """Rise time from 10 to 90 % of the way [s], and overshoot; NaN where it is not reached, or the loop does not settle."""
    log = side.step
    if unsettled(side):
        return {"rise time [s]": np.nan, "overshoot [%]": np.nan}
    t, way = log.column("t"), 0.5 * (log.column("x") + log.column("y")) / STEP
    first, last = (np.flatnonzero(way >= level) for level in (0.1, 0.9))
    rise = float(t[last[0]] - t[first[0]]) if len(last) else np.nan
    return {"rise time [s]": rise, "overshoot [%]": 100.0 * max(0.0, float(way.max()) - 1.0) if len(last) else np.nan}


def unsettled(side: Side) -> str:
    """Why numbers of a step would mean nothing; empty where they mean something."""
    lost = "lost" if side.step.outcome is not Outcome.COMPLETED else ""
    return UNSTABLE if side.grade.word == UNSTABLE else lost


def evidence(
    question: Question, law: type[Controller], mission: Mission, before: Mapping[str, float], sides: tuple[Side, Side],
    drawn: FigureJob,
) -> Evidence:  # fmt: skip
    failed = shares_of(*(~one.flown.completed for one in sides))
    measured = rows(("position_rmse", "largest_error", *EFFORTS), sides[0].flown, sides[1].flown)
    steps = [response(one) for one in sides]
    grades = [one.grade.word for one in sides]
    changed = [(name, law.by_key()[name][1], before[f"controller.{name}"], value) for name, value in question.changes.items()]
    seen = contrasts(sides, failed, measured, steps)
    air = (
        f"in turbulent wind with a mean of up to {question.wind:g} m/s along x and along y"
        if question.wind
        else "in still air"
    )
    gusts = f"{units.counted(question.flights, 'flight')} {air}"
    lost = f"{units.percent(*failed[1])} are lost or ever more than {question.within:g} m from their place"
    fail = (
        f"{units.percent(*failed[1])} of {gusts} fail with the change, {units.percent(*failed[0])} before"
        f"{compared(failed[2])}. A flight fails if it is lost or ever more than {question.within:g} m from its target."
    )
    none = f"None of {gusts} is lost or ever more than {question.within:g} m from its target, before or after."
    fail = fail if failed[0].value or failed[1].value else none
    news = f"With {changed_words(changed)} {grade_words(sides)}{better_or_worse(seen, [one.what for one in missed(sides)])}."
    answer = " ".join([fail, news] if certain(failed[2]) else [news, fail])
    if idle(sides):
        answer = (
            f"With {changed_words(changed)} no flight differs from before by a single bit, neither {gusts} nor a step "
            f"of {STEP:g} m: they do not show what the change does. There {grade_words(sides)}, and {lost}."
        )
    number = units.number
    rows_of_changes = [(name, number(old), number(new), f"{gain.unit}; {gain.meaning}") for name, gain, old, new in changed]
    tables = [
        TableSection(
            "Before and after", "both", ("", *SIDES, "after − before"), [("grade", *grades, ""), *(one[:4] for one in seen)],
            "Differences are paired, over flights completed with both, with 95 % intervals. Grade and margins are those "
            "of the loop hovering in calm air, rise time and overshoot those of a step there.",
            shown="In gusts, at rest, and in a step in calm air",
        ),
        TableSection("What changes", "changes", ("parameter", "before", "after", ""), rows_of_changes),
    ]  # fmt: skip
    record: dict[str, object] = {
        "name": mission.name, "version": __version__, "asked": {**question._asdict(), "changes": dict(question.changes)},
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
        sentences=[],
        opening=answer,
        record=record,
        facts=facts(failed, sides),
        figures=[Figure(PICTURE, caption(drawn), label="Step")],
        sections=tables,
        warnings=[*hidden_effects(question), *mission.controller.warnings(mission.modelled)],
        grade={"grade": sides[1].grade.word, "why": sides[1].grade.why},
        told=True,
    )


def facts(failed: Sequence[Estimate], sides: tuple[Side, Side]) -> list[markup.Fact]:
    """What share fails, and the margins that change."""
    shares = {"before and after": failed[0]} if failed[0] == failed[1] else dict(zip(SIDES, failed, strict=False))
    found = [
        markup.Fact(f"fail in gusts, {name}", units.percent(one.value), units.interval_of_share(*one))
        for name, one in shares.items()
    ]
    for old, new in zip(*(side.grade.measures for side in sides), strict=False):
        if (was := old.text(old.value)) != (now := new.text(new.value)) or not new.met:
            found.append(markup.Fact(f"{new.what} margin, before and after", f"{was} → {now}", new.channel))
    return found


def missed(sides: tuple[Side, Side]) -> list[Measure]:
    """The margins that are too small with the change, which cards show."""
    return [one for one in sides[1].grade.measures if not one.met]


def idle(sides: tuple[Side, Side]) -> bool:
    """Whether the change has no effect on anything that was flown."""
    both = [(one.step.rows, one.flown.metrics, one.flown.outcome) for one in sides]
    return all(np.array_equal(old, new, equal_nan=True) for old, new in zip(*both, strict=True))


def caption(steps: FigureJob) -> str:
    """What to see of the step: where the change shows most."""
    said = []
    for panel in steps.panels:
        if (most := float((gap := apart(panel)).max())) > 0.0:
            said.append(f"{units.quantity(most, panel.unit)} in {panel.label} (at {steps.t[gap.argmax()]:.3g} s)")
    differ = f"Before and after differ by at most {units.listed(said)}." if said else "Before and after are the same."
    return f"A step of {STEP:g} m along x and y in calm air, on the axes that change most. {differ}"


def hidden_effects(question: Question) -> list[str]:
    """What the flights do not show of a change, as a warning."""
    more = question.unmodelled
    if not more:
        return list(question.notes)
    changed = "changes, too, and is" if len(more) == 1 else "change, too, and are"
    return [f"{briefly(more)} {changed} not modelled: the flights do not show the effect", *question.notes]


def compared(difference: Estimate) -> str:
    """Whether more or fewer flights fail, in a clause."""
    low, high = difference.low, difference.high
    if low > 0.0 or high < 0.0:
        value, *ends = (f"{100.0 * abs(part):.3g}" for part in (difference.value, *sorted((low, high), key=abs)))
        return f": {'more' if low > 0.0 else 'fewer'}, by {value} points ({' to '.join(ends)})"
    return f"; no difference is shown, {points(difference)}"


class Contrast(NamedTuple):
    """Something measured before and after, and by how much it differs, in words. share: by which part of itself it grew, 0
    where that is not shown. good: whether more of it is better.
    """

    name: str
    before: str
    after: str
    difference: str
    share: float
    good: bool

    @property
    def gain(self) -> float:
        """The share by which it is better; below 0 worse."""
        return self.share if self.good else -self.share


NOTED, MOST_NAMED = 0.01, 3
"""The least share by which something is better or worse that the first sentence names, and how many it names of either."""


def contrasts(
    sides: tuple[Side, Side], failed: Sequence[Estimate], measured: Sequence[Row], steps: Sequence[dict[str, float]]
) -> list[Contrast]:
    """All that is measured, but what is 0 throughout: flights in gusts, margins at rest, and the step in calm air."""
    first, then = (units.percent(one.value) for one in failed[:2])
    grown = part(failed[2].value, failed[0].value) if certain(failed[2]) else 0.0
    found = [Contrast("fail in gusts", first, then, points(failed[2]), grown, False)]
    found += map(in_flight, measured)
    for old, new in zip(*(one.grade.measures for one in sides), strict=False):
        found.append(at_once(f"{old.what} margin", old.scale * old.value, old.scale * new.value, old.unit, True, 1))
    settles = not any(map(unsettled, sides))  # else how it rises is where the flight was cut
    for (name, value), later in zip(steps[0].items(), steps[1].values(), strict=True) if settles else ():
        words, unit = units.metric(name)
        one = at_once(words.strip(), value, later, f" {unit}", False)
        found.append(one._replace(difference=one.difference.replace("%", "points")))
    return [one for one in found if (one.before, one.after, one.share) != ("0", "0", 0.0)]


def at_once(name: str, before: float, after: float, unit: str, good: bool, places: int | None = None) -> Contrast:
    """Something that has no interval. Its difference is that of the numbers shown. unit: as it follows a number. places: its
    decimals, where they are not those of three digits.
    """
    old, new = (float(f"{one:.{units.DIGITS}g}") if places is None else round(one, places) for one in (before, after))
    first, then = (
        "none" if math.isinf(one) else "–" if math.isnan(one) else units.number(one, places=places) + unit
        for one in (old, new)
    )
    if not math.isfinite(change := round(new - old, 9)):
        return Contrast(name, first, then, "–", 0.0, good)
    by = f"{change + 0.0:,g}".replace("-", "−") if places is None else units.number(change, places=places)
    return Contrast(name, first, then, by + unit, part(after - before, before), good)


def in_flight(one: Row) -> Contrast:
    """A metric of flights, of which less is better. How much more or less is of flights completed with both: means before and
    after are of different flights where some are lost with one of them, and may say the contrary.
    """
    words, _, _, difference = one.texts
    before, after = units.in_one_unit(one[1:3], units.metric(one.name)[1], units.estimate)
    change, base = one.difference, one.present.value if one.present else 0.0
    share = part(change.value, base) if change and certain(change) else 0.0
    return Contrast(words, before, after, difference, share, False)


def part(change: float, whole: float) -> float:
    """A change as a part of the whole; infinite where there was nothing."""
    return change / abs(whole) if whole else math.copysign(math.inf, change) if change else 0.0


def certain(difference: Estimate) -> bool:
    """Whether its interval excludes zero."""
    return difference.low > 0.0 or difference.high < 0.0


def better_or_worse(contrasts: Sequence[Contrast], told: Sequence[str] = ()) -> str:
    """What is better and what is worse, the largest changes first, in clauses. told: margins that have been named already."""
    ordered = sorted(contrasts, key=lambda one: -abs(one.gain))
    ordered = [one for one in ordered if one.name.removesuffix(" margin") not in told]
    clauses = []
    for word, sign in (("better", 1.0), ("worse", -1.0)):
        names = [one.name for one in ordered if sign * one.gain >= NOTED]
        if names:
            clauses.append(f"; {word}: {units.listed(shortened(names))}")
    return f"{''.join(clauses)}; nothing {'else ' * bool(clauses or told)}that is shown is better or worse by 1 %"


def shortened(names: Sequence[str]) -> list[str]:
    """The first of these, and how many others there are."""
    rest = len(names) - MOST_NAMED
    return [*names] if rest < 2 else [*names[:MOST_NAMED], f"{rest} more"]


def changed_words(changed: Sequence[tuple[str, Gain, float, float]]) -> str:
    """The change, as a sentence begins with it."""
    return units.listed(shortened([f"{name} = {value:g} ({old:g} before)" for name, _, old, value in changed]))


def grade_words(sides: tuple[Side, Side]) -> str:
    """The grade of the loop with the change, with what it lacks."""
    old, new = (one.grade for one in sides)
    small = [f"{one.what} margin in {one.channel} below {one.text(one.limit)}" for one in missed(sides)]
    why = "" if new.word == SOUND else f" ({units.listed(small) or new.why})"
    way = f"stays {new.word}" if new.word == old.word else f"goes from {old.word} to {new.word}"
    return f"the loop at rest {way}{why}"


def points(one: Estimate) -> str:
    value, low, high = (f"{100.0 * part:+.3g}" if part else "0" for part in one)
    return f"{value} [{low}, {high}] points".replace("-", "−")


def recorded(one: Row) -> dict[str, object]:
    """A row for metrics.json."""
    parts = zip(("before", "after", "difference"), one[1:], strict=True)
    return {name: part.as_json() if isinstance(part, Estimate) else None for name, part in parts}

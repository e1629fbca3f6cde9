"""report.html of a flight."""

import json
import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, cast

import numpy as np

from quadstep.interfaces.closed_loop import Outcome
from quadstep.interfaces.log import REASONS, FlightLog
from quadstep.metrics.off_command import off_command
from quadstep.metrics.quantities import FAR, LoggedFlight, QuantityRows, heading_error, position_errors
from quadstep.metrics.reductions import rmse
from quadstep.metrics.registry import UNGRADED, Metrics, group, metric, of_saturation, rest_of
from quadstep.metrics.verdict import Case, FlightGrade, graded
from quadstep.mission.fields import unit
from quadstep.mission.listings import rounded, written
from quadstep.report import markup, units
from quadstep.report.evidence import Evidence, Figure, Section, TableSection
from quadstep.report.panel import EventMark
from quadstep.report.panels import SPOKEN, at, left_path
from quadstep.studies.tuning.gains import filled_in

if TYPE_CHECKING:
    from quadstep.mission.schema import Mission

BAD_LOOPS = {"fragile": "fair", "unstable": "fails"}
"""How their cards warn."""

IN_SUMMARY = 2
"""Figures."""

LEAST = 1e-4
"""Share of a path's size below which an RMSE is only said to be less."""

LIST = re.compile(r"\[[^\[\]{}]*\]")
"""In JSON: a list of numbers or names, which is shown on one line."""


def write_report(
    path: Path, mission: "Mission", log: FlightLog, metrics: Metrics, warnings: Sequence[str],
    figures: dict[str, str], why: str = "",
) -> None:  # fmt: skip
    """Write it beside the flight's other files. figures: their captions by path from there, without ending. why: it ended
    early, if known.
    """
    grade, _, labels, _ = graded(metrics)
    near = grade is not FlightGrade.LOST and set(labels) <= {"large error"}  # what else goes wrong may explain it
    off = off_command(log, mission.controller.controller.off_command) if near and "position" in metrics else ""
    seen = [name for name in figures if Path(name).name == "attitude"]
    drawn = [Figure(name, f"{text} {off}".strip() if name in seen else text) for name, text in figures.items()]
    flight = LoggedFlight(log, mission.scored_from)
    counted, size = errors_since(mission), of_size(flight, metrics) if "position" in metrics else ""
    places = [("page.html", "Fly it in your browser"), ("flight.csv", "the log"), ("metrics.json", "all metrics")]
    sections: list[Section] = [markup.links(places)]
    if "position" in metrics:
        header, rows = error_table(metrics, log)
        if isinstance(rms := metrics.get("heading_error[rad]"), float) and "attitude" not in metrics:  # whose rows have it
            rows.append(heading_row(flight, rms))
        sections.append(TableSection("Errors", "errors", header, rows, size + ("" if seen else off)))
    if drawn[IN_SUMMARY:]:
        sections += [TableSection("More signals", "signals"), *drawn[IN_SUMMARY:]]
    keys = json.dumps(in_degrees(mission, mission.model_dump(mode="json", exclude_none=True)), indent=2, ensure_ascii=False)
    content = LIST.sub(lambda one: re.sub(r"\s+", " ", one[0]), keys)
    sections += [
        TableSection("Mission", "flown"),
        markup.verbatim(content, "every key of the mission that has a value", False),
    ]
    if rows := gain_rows(mission):
        sections.append(
            markup.disclosure("the gains flown", markup.table(GAINS, rows, units.rich) + markup.paragraph(DEFAULT))
        )
    if left := mission.controller.left:
        whose = f"{len(left)} parameters of its file that {mission.controller.type} does not use"
        sections.append(markup.verbatim("\n".join(left), whose))
    when = worst(log, mission.scored_from, mission.moments) if "position" in metrics else ""
    lost = [distance_when_lost(log)] if log.outcome is not Outcome.COMPLETED and "position" in metrics else []
    found_facts = facts(metrics, counted, when, "voltage" in log.columns and bool(log.column("voltage").any()))
    measured = [*lost, *found_facts[len(lost) :], *own_facts(mission, metrics)]  # a lost flight's largest error says no more
    ungraded = "" if rest_of(metrics) or mission.controller.controller.one_at_a_time else UNGRADED
    lines = [left_path(log, metrics), answer(log, metrics, why, counted + cut(mission), size), ungraded]
    first, *more = filter(None, lines)
    found = Evidence(
        mission.name, "Flight", first, (), {}, measured, drawn[:IN_SUMMARY], sections, more=more, warnings=warnings, fold=(),
        cases=(Case("flown", None if log.outcome is Outcome.COMPLETED else first),),
    )  # fmt: skip
    path.write_text(found.html(path.parent), encoding="utf-8")


def in_degrees(mission: "Mission", content: object, at: str = "") -> object:
    """What a mission has at a key, with angles in degrees."""
    if isinstance(content, dict):
        return {key: in_degrees(mission, one, f"{at}.{key}".lstrip(".")) for key, one in content.items()}
    if isinstance(content, list):
        return [in_degrees(mission, one, at) for one in content]
    return f"{math.degrees(content):.6g}°" if isinstance(content, float) and unit(mission, at) == "rad" else content


def errors_since(mission: "Mission") -> str:
    """From when errors count, to follow one, where that is not the start."""
    return f" from {mission.scored_from:g} s on" if mission.scored_from else ""


def cut(mission: "Mission") -> str:
    """How much of its path is flown, to follow an error, where that is not all of it."""
    return f"; {mission.cut}" if mission.cut else ""


def answer(log: FlightLog, metrics: Metrics, why: str = "", counted: str = "", size: str = "") -> str:
    """How it went. counted: from when errors are, see `errors_since`; and how much is flown, see `cut`. size: of its path, if
    it has one.
    """
    rest = rest_of(metrics)
    loop = f"; its loop is {rest['grade']} at rest" if rest.get("grade") in BAD_LOOPS else ""
    if log.outcome is not Outcome.COMPLETED:
        return f"The flight was lost at {log.ended:.4g} s: {why or REASONS[log.outcome]}{loop}."
    off, found = metrics.get("position_rmse[m]"), graded(metrics)
    part = cast(float, metrics.get("relative_error") or 0.0)
    share = f", {units.percent(part)} of the path's size" if size and not found.reasons and part >= LEAST else ""
    error = f" with a position RMSE of {units.quantity(cast(float, off), 'm')}{share}{counted}" if off is not None else ""
    return f"The flight completed {log.ended:g} s{error}{loop}. {found.sentence}".strip()


def of_size(flight: LoggedFlight, metrics: Metrics) -> str:
    """The size of a completed flight's path, of which its RMSE is said to be a share, with a blank; "" where it is not."""
    share, off, found = metrics.get("relative_error"), metrics.get("position_rmse[m]"), graded(metrics)
    told = flight.log.outcome is Outcome.COMPLETED and (not found.reasons or "large error" in found.labels)
    if not (told and isinstance(share, float) and isinstance(off, float) and share >= LEAST):
        return ""
    path = flight.path[flight.log.column("t") >= flight.since]
    gone = np.linalg.norm(path - path[0], axis=1)
    if flight.holds or off / share > 1.001 * rmse(gone):  # an arm is more
        return ""
    size = f"The path's size, {units.quantity(off / share, 'm')}, is the RMSE of a vehicle that never leaves its start"
    return f"{size}{f' (distances above {FAR:g} m count as {FAR:g} m)' * bool(gone.max() > FAR)}. "


def distance_when_lost(log: FlightLog) -> markup.Fact:
    """How far from its path a lost flight was in the last row of its log, which all its numbers end with."""
    last = float(log.column("t")[-1])
    off = units.quantity(float(np.linalg.norm(position_errors(log)[-1])), "m")
    when = f"in the log's last row, {log.ended - last:.2g}\u00a0s before the loss"
    return markup.Fact(f"distance from the path at {last:.4g}\u00a0s", off, when)


def worst(log: FlightLog, since: float, moments: Sequence[EventMark] = ()) -> str:
    """When a flight is farthest from its path, and what had happened last, to follow that distance."""
    t, off = log.column("t"), np.linalg.norm(position_errors(log), axis=1)
    if not (t >= since).any():
        return ""
    place = int(np.where(t >= since, off, -1.0).argmax())
    before, what = max(((when, what) for when, what, *_ in moments if what and 0.0 < when <= t[place]), default=(0.0, ""))
    return f", at {at(t, place)}{f', {t[place] - before:.2f} s after {what}' if what else ''}"


def facts(metrics: Metrics, counted: str = "", when: str = "", battery: bool = False) -> list[markup.Fact]:
    """The numbers that say most, as far as the flight has them. counted: from when errors are, as `errors_since` has it.
    when: as `worst` has it. battery: whether one drains.
    """
    found = []
    if "position" in metrics:
        largest = cast("float | None", metrics.get("largest_error[m]")) or max(
            one["largest[m]"] for one in group(metrics, "position").values()
        )
        along = f"from the path{when}" if "largest_error[m]" in metrics else "along one axis"
        said, kind = f"{along}{counted and f'; counted{counted}'}", "fair" * ("large error" in graded(metrics).labels)
        found.append(markup.Fact("largest error", units.quantity(largest, "m"), said, kind=kind))
    rest = rest_of(metrics)
    kind = BAD_LOOPS.get(rest.get("grade", ""), "")
    loop = [markup.Fact("loop at rest where the path begins", rest["grade"], rest["why"], kind=kind)] if rest else []
    return [*found, *of_limits(metrics, battery, counted), *loop]


def of_limits(metrics: Metrics, battery: bool = False, counted: str = "") -> list[markup.Fact]:
    """How close the vehicle came to its limits in the whole flight, as far as it has that."""
    found = []
    if "largest_tilt[rad]" in metrics:
        tilt = f"{math.degrees(metric(metrics, 'largest_tilt[rad]')):.3g}°"
        found.append(
            markup.Fact("largest tilt", tilt, f"between thrust and vertical{', in the whole flight' * bool(counted)}")
        )
    if "largest_thrust_share" in metrics:
        share = metric(metrics, "largest_thrust_share")
        more = f"of all rotors together{' on a full battery' * battery}, at the worst moment"
        found.append(markup.Fact("total thrust left", units.percent(1.0 - share), more))
    if "saturated_share" in metrics:
        said = of_saturation(metrics, units.percent)
        found.append(markup.Fact("rotors saturated", units.percent(metric(metrics, "saturated_share")), said))
    elif "rotors" in metrics and metric(metrics, "rotors", "least[N]") < 0.0:
        ends = (units.number(metric(metrics, "rotors", f"{end}[N]")) for end in ("least", "largest"))
        more = "rotors cannot thrust downwards, but this vehicle does not limit them"
        found.append(markup.Fact("thrust per rotor (not physically possible)", f"{' to '.join(ends)}\u00a0N", more))
    return found


def own_facts(mission: "Mission", metrics: Metrics) -> list[markup.Fact]:
    """The metrics that the mission names, as far as the flight has them."""
    named = ((units.metric(one.full_name), metrics.get(one.full_name)) for one in mission.own_metrics)
    return [markup.Fact(words, units.quantity(value, unit)) for (words, unit), value in named if isinstance(value, float)]


GAINS = ("gain", "value", "meaning")
DEFAULT = "How defaults follow from a vehicle and its delays: docs/controllers.md, Default gains."


def gain_rows(mission: "Mission") -> list[list[str]]:
    """What the controller flew with, and what of it the mission leaves to the default."""
    values, given = filled_in(mission), mission.controller.model_fields_set
    return [
        [
            key + f" [{one.unit}]" * (one.unit != "-"),
            written(rounded(values[key]), one.stands_for_three) + ", default" * (key not in given),
            one.meaning,
        ]
        for key, (_, one) in mission.controller.controller.by_key().items()
    ]


HEADER = ("error", "RMSE", "largest", "final", "unit")
"""Of the table of errors; a lost flight's says when its log ends, and has no RMSE."""

SMALL = 0.01
"""In the unit of the others; what is no larger has its own."""


def heading_row(flight: LoggedFlight, rms: float) -> list[str]:
    """The heading's row of the table of errors."""
    off = np.abs(cast(QuantityRows, heading_error(flight)).values[:, 0])
    values = [rms, float(off.max()), float(off[-1])][flight.log.outcome is not Outcome.COMPLETED :]
    return ["heading", *(units.number(math.degrees(one)) if math.isfinite(one) else "–" for one in values), "°"]


def error_table(metrics: Metrics, log: FlightLog) -> tuple[Sequence[str], list[list[str]]]:
    """Header and rows: each axis and angle, those of a kind in one unit unless one is too small to be read in it."""
    rows, lost = [], log.outcome is not Outcome.COMPLETED
    for kind, base in (("position", "m"), ("attitude", "rad")):
        largest = max((one[f"largest[{base}]"] for one in group(metrics, kind).values()), default=0.0)
        for axis, one in group(metrics, kind).items():
            values = [one[f"{key}[{base}]"] for key in ("rmse", "largest", "final")][lost:]
            unit, factor = units.suited(base, largest)
            if factor * largest < 1.0 and unit != "°":  # the finer unit has room for what is smaller
                unit, factor = units.suited(base, 0.05 * largest)
            if 0.0 < factor * max(values) < SMALL:
                unit, factor = units.suited(base, max(values))
            written = (units.number(factor * value) if math.isfinite(value) else "–" for value in values)
            rows.append([SPOKEN.get(axis, axis), *written, unit])
    return (*HEADER[:1], HEADER[2], f"at {log.column('t')[-1]:.4g}\u00a0s", HEADER[-1]) if lost and rows else HEADER, rows

"""Two results beside each other: one picture of both flights, and what their metrics.json say, number by number."""

import math
import re
import tempfile
import threading
import tomllib
from collections.abc import Iterable, Sequence
from contextlib import suppress
from functools import partial
from html import escape
from pathlib import Path
from urllib.parse import urlencode

import numpy as np
from numpy.typing import NDArray

from quadstep.io.errors import UserError
from quadstep.metrics.quantities import position_errors
from quadstep.metrics.registry import AT_REST, Metrics
from quadstep.metrics.verdict import FlightGrade, scalars
from quadstep.mission.air import in_words
from quadstep.mission.fields import dotted
from quadstep.page.cards import MARKS, best, part, picture
from quadstep.page.folder import (
    REPORT,
    ResultFolder,
    controller,
    grade,
    loop_grade,
    name_in,
    outcome,
    read_log,
    scored_from,
    section,
)
from quadstep.page.model import identity
from quadstep.page.report_tables import differences
from quadstep.page.thumbnails import COLOURS
from quadstep.report import markup, units
from quadstep.report.drawing import FigureJob
from quadstep.report.panel import LOG, Panel
from quadstep.report.sheet import Sheet

MOST_ROWS = 400
ONE_AT_A_TIME = threading.Lock()
"""Held while Matplotlib draws, whose settings belong to all requests."""

RMSE, MARGINS = "position_rmse[m]", "its margins"


def compared_page(results: tuple[ResultFolder, ResultFolder], contents: tuple[Metrics, Metrics], root: Path) -> str:
    """The page. contents: of their metrics.json. root: the folder that their places are in."""
    first, second = (numbers(content) for content in contents)
    names = [one.name if results[0].name != results[1].name else one.place.as_posix() for one in results]
    quoted = [f"“{name}”" for name in names]
    unlike = why_incomparable(quoted, *contents)
    flights = all("flight.csv" in one.files for one in results)
    told = reported(*results) if (reports := not flights and all(REPORT in one.files for one in results)) else []
    keys = [] if reports else [key for key in {**first, **second} if not first.get(key) == second.get(key) == 0.0]
    header = ("", *names, "second / first")[: 3 if unlike or not keys else 4]
    rows = [*grades(*contents)] if header[-1] == names[-1] else [[*one, "–"] for one in grades(*contents)]
    whole = FlightGrade.LOST not in map(grade, contents)
    margins = [one for one in rows if one[0] == MARGINS and flights and whole]
    sizes = group_sizes(first, second)
    measured = {
        key: [words(key), *row(key, first.get(key), second.get(key), sizes[group(key)])][: len(header)] for key in keys
    }
    few = [key for key in keys if key.partition("[")[0] in (FEW if whole else OF_LOST)] if flights else keys
    others = [key for key in keys if whole and key not in few]
    rows = [*(one for one in rows if one not in margins), *(measured[key] for key in few[:MOST_ROWS]), *told]
    largest = max(one.rmse or 0.0 for one in results)
    errors = [
        markup.Fact(f"{name}: flight", "lost", flown_by(content), kind="fails") if one.rmse is None
        else markup.Fact(f"{name}: position RMSE{since(content)}", value(one.rmse, "m", largest), flown_by(content))
        for name, one, content in zip(names, results, contents, strict=True)
        if one.rmse is not None or grade(content) == FlightGrade.LOST
    ]  # fmt: skip
    body = [markup.summary(unlike or answer(quoted, *contents, [one.says for one in results]), errors)]
    places = urlencode({"a": results[0].place.as_posix(), "b": results[1].place.as_posix()})
    pages = [f'<a href="{escape(best(one))}">{escape(name)}</a>' for one, name in zip(results, names, strict=True)]
    if flights and not different(*contents):
        front, behind = (name_in(content, one.place.name) for one, content in zip(results, contents, strict=True))
        behind = identity(behind, (identity(front, ()),))
        marks = (*(f'"{one}" style="color: var(--{one})"' for one in COLOURS), '"band"')
        key = "".join(
            f"<span><i class={mark}></i>{of}</span>" for mark, of in zip(marks, (*pages, "desired path"), strict=True)
        )
        shown = f'<figure><img alt="" src="/thumbs?{escape(places)}"><figcaption>{key}</figcaption></figure>'
        with suppress(UserError):  # a log that cannot be read, or drawn
            shown += errors_figure(quoted, contents, [root / one.place for one in results])
        live = [(f"/both?{places}#keep={behind}", "Both flights, overlaid, live")]
    elif not flights:  # whose pictures have each its own axes
        shown, live = "", [(best(one), name) for one, name in zip(results, names, strict=True)]
    else:
        drawn = zip(map(picture, results), pages, strict=True)
        shown = "".join(f"<figure>{one}<figcaption>{page}</figcaption></figure>" for one, page in drawn)
        live = [(f"/both?{places}", "Both flights on one page")]
    body += [f'<div class="two">{shown}</div>' * bool(shown), markup.links(live)]
    said = [["answer", *(one.says or "–" for one in results)], ["graded flights", *(one.lack or "–" for one in results)]]
    rows = [*(said if any(one.lack for one in results) else said[:1]), *rows] if reports else rows
    body += [markup.heading("In numbers" if keys else "What their reports say first", "numbers")] if rows else []
    body += [markup.table(header, rows, units.rich if reports else escape)] if rows else []
    if margins or others:
        rest = markup.table(header, [*margins, *(measured[key] for key in others[:MOST_ROWS])], escape)
        body.append(markup.disclosure("all else that is not 0 in both", rest))
    body += [] if keys or not rows else differing_tables(names, *(root / one.place for one in results))
    body.append(markup.links([("/", "All results")]))
    return markup.page_text(" and ".join(quoted), body, "Comparison of two", part("comparison.css"))


def differing_tables(names: list[str], *folders: Path) -> list[str]:
    """Sections: what the tables of two reports say differently."""
    body = list[str]()
    with suppress(UserError, OSError):
        for title, rows in differences(*folders).items():
            body += [markup.heading(title, f"differs-{len(body)}"), markup.table(("", *names), rows[:MOST_ROWS])]
    return [markup.paragraph("What their tables say differently; –: that report gives no value."), *body] if body else []


def gains(*contents: Metrics) -> list[list[str]]:
    """A row for each key of one controller that differs in two missions, in few digits where these differ, else in all."""
    with suppress(ValueError):  # of a file that names a key twice
        first, second = laws = [dotted(section(section(one, "mission"), "controller")) for one in contents]
        told = ((key, [in_short(one.get(key), whole) for one in laws]) for whole in (True, False) for key in first | second)
        if flown(contents[0]) == flown(contents[1]):
            rows = {key: [f"controller.{key}", *both] for key, both in told if both[0] != both[1]}
            return [*rows.values()][:MOST_ROWS]
    return []


def in_short(value: object, whole: bool = False) -> str:
    """A value of a mission, none being the default; one that all axes share once. whole: in all its digits."""
    parts, said = value if isinstance(value, list) else [value], {"None": "default", "True": "on", "False": "off"}
    each = [f"{one:g}" if isinstance(one, float) and not whole else said.get(str(one), str(one)) for one in parts]
    return units.numerals(each[0] if len({*each}) == 1 else ", ".join(each))


def flown(content: Metrics) -> str:
    """The controllers of a result: those that its flights draw, or that of its mission; empty where it is not known."""
    drawn = section(vary := section(asked(content), "vary"), "controller")
    drawn = section(vary, "controller.type") or section(drawn, "type") or drawn
    values = found if isinstance(found := drawn.get("values"), list) else []
    kinds = [one.get("type", one) if isinstance(one, dict) else one for one in values]
    return units.listed([*map(str, kinds)], "or") or controller(content)


def grades(*contents: Metrics) -> list[list[str]]:
    """Rows of the controllers and grades of both flights, and of both loops at rest, where both are known."""
    rows = [
        ["controller", *map(flown, contents)],
        *gains(*contents),
        ["grade", *(MARKS[found][2] if (found := grade(one)) in MARKS else found for one in contents)],
        ["loop at rest", *map(loop_grade, contents)],
        [MARGINS, *(str(section(one, AT_REST).get("why", "")) for one in contents)],
    ]
    if since(*contents) and all(one.get("outcome") == "completed" for one in contents):
        rows.append(["errors count", *(counted(one).strip() for one in contents)])
    return [[what, *(one or "–" for one in told)] for what, *told in rows if any(told)]


def errors_figure(names: list[str], contents: Sequence[Metrics], folders: Sequence[Path]) -> str:
    """How far two flights are from their path over time, drawn upon each other. Raises UserError."""
    times, lines = list[NDArray[np.float64]](), dict[str, NDArray[np.float64]]()
    short = [name if len(name) < 37 else f"{name[:34]}…”" for name in names]
    for name, content, folder in zip(short if len({*short}) == 2 else names, contents, folders, strict=True):
        log = read_log(folder / "flight.csv", outcome(content), 0.0)
        if not {"x_d", "y_d", "z_d"} <= log.columns.keys() or len(log.rows) < 2:
            raise UserError(f"{folder}: its log has no path")
        times.append(log.column("t"))
        lines[name] = np.linalg.norm(position_errors(log), axis=1)
    t = max(times, key=lambda one: float(one[-1]))
    lines = {name: np.interp(t[t <= own[-1]], own, line) for (name, line), own in zip(lines.items(), times, strict=True)}
    lost = FlightGrade.LOST in map(grade, contents)  # whose error would leave the other flat on the axis
    said = f"Distance from the path over time{', on a logarithmic scale' if lost else ''}."
    begun, shared = max(map(scored_from, contents)), min(map(len, lines.values()))
    spans = np.diff(t[:shared]) * (t[1:shared] > begun)
    first, second = (line[1:shared] for line in lines.values())
    if not lost and spans.any() and not np.allclose(first, second, 0.0, 1e-3 * first.max()):  # or no eye tells them apart
        shares = [float(spans[closer].sum() / spans.sum()) for closer in (first < second, second < first)]
        near, share = max(zip(names, shares, strict=True), key=lambda one: one[1])
        said += f" {near} is the closer one {units.percent(share)} of the time{since(*contents)}." * (share > 0.5)
    job = FigureJob("errors", said, t, [Panel("distance", "m", lines, LOG if lost else "")])
    with tempfile.TemporaryDirectory() as place, ONE_AT_A_TIME:
        job.draw(Path(place), Sheet(("svg",)))
        return markup.figure(Path(place) / job.name, units.unbroken(job.caption), escape)


def why_incomparable(names: list[str], first: Metrics, second: Metrics) -> str:
    """Why the errors of two flights say nothing of which is better; empty where they may be compared."""
    if not all("outcome" in one for one in (first, second)):
        return ""
    things = different(first, second)
    lost = [name for name, one in zip(names, (first, second), strict=True) if one.get("outcome", "completed") != "completed"]
    apart = scored_from(first) != scored_from(second) and not lost
    starts = f"those of {names[0]} count{counted(first)} and those of {names[1]}{counted(second)}" if apart else ""
    if lost and not things:
        return f"{' and '.join(lost)} {'was' if len(lost) == 1 else 'were'} lost, so the errors are not compared."
    if first.get("ended[s]") != second.get("ended[s]") and "paths" not in things and not lost:
        things = f"{things} and durations" if things else "durations"
    so, why = (f"{names[0]} and {names[1]} fly different {things}, so their", "; ") if things else ("Their", ": ")
    return f"{so} errors do not say which is better{f'{why}{starts}' if starts else ''}." if things or starts else ""


def since(*contents: Metrics, always: str = "") -> str:
    """From when on the errors of all count, after a blank. always: what is said where it is from the start."""
    return f" from {start:g} s on" if (start := max(map(scored_from, contents))) else always


counted = partial(since, always=" over the whole flight")
"""Over which time the errors count."""


def different(first: Metrics, second: Metrics) -> str:
    """What two flights do not share that makes them unlike: "paths", "vehicles", both, or nothing."""
    return " and ".join(f"{part}s" for part in differing_keys(("path", "vehicle"), first, second))


CONDITIONS = {"start": "starts", "disturbance": "disturbances", "sensors": "sensors", "events": "events", "wind": "winds"}
"""Keys of a mission that make it harder or easier to stay on a path."""

SET_UP = {"vehicle": "vehicles", "path": "paths", "axes": "axes", "vary": "variations", "correlated": "variations",
          "score_from": "scored times", "simulation": "simulations", "limits": "limits", "failure": "limits"}  # fmt: skip
"""What else the results of a study depend on."""


def conditions(*contents: Metrics) -> str:
    """In which of these two missions or studies differ, with their winds; empty if in none."""
    told = {} if all("outcome" in one for one in contents) else SET_UP
    if differing_keys(told, *contents)[:2] == ["vehicle", "path"]:  # so nothing else is alike
        return "vehicles and paths"
    winds = [in_words(section(section(one, "mission"), "wind")) for one in contents]
    told = {**told, **CONDITIONS, "wind": f"winds ({'; '.join(winds)})" if winds[0] != winds[1] else "winds"}
    return units.listed([*dict.fromkeys(told[one] for one in differing_keys(told, *contents))])


def differing_keys(keys: Iterable[str], *contents: Metrics) -> list[str]:
    """Those of some keys of a study or its mission in which two results differ; nothing is as good as an empty list."""
    first, second = map(asked, contents)
    return [key for key in keys if (first.get(key) or None) != (second.get(key) or None)]


def asked(content: Metrics) -> Metrics:
    """The keys of a study, of its file and of its mission, in one table."""
    file = tomllib.loads(str(content["campaign"])) if "chunks" in content else {}
    return {**file, **content, **section(content, "mission")}


def numbers(content: Metrics) -> dict[str, float]:
    """The numbers of a metrics.json by dotted name, without those of the mission, and of where a flight was lost."""
    kept = {key: value for key, value in content.items() if key not in ("mission", "ending")}
    return {key: float(one) for key, one in scalars(kept).items() if one is not None and abs(one) < 1e300}


def reported(*results: ResultFolder) -> list[list[str]]:
    """A row for each number that a report begins with, and what it says of it, such as its interval."""
    told = [{what: f"{value} ({more})" if more else value for what, value, more in one.facts} for one in results]
    return [[what, *(one.get(what, "–") for one in told)] for what in dict.fromkeys(name for one in told for name in one)]


def flown_by(content: Metrics) -> str:
    """The controller of a flight, and what speaks against its loop."""
    _, sign, bad = MARKS.get(bad_loop(content), ("", "", ""))
    return ", ".join(filter(None, ((flew := controller(content)) and f"controller: {flew}", bad and f"{sign} loop {bad}")))


def bad_loop(content: Metrics) -> str:
    """The grade of a flight's loop at rest if it is a bad one."""
    return "" if MARKS.get(loop := loop_grade(content), ("good",))[0] == "good" else loop


def answer(names: list[str], first: Metrics, second: Metrics, says: Sequence[str]) -> str:
    """Which is closer to its path, as far as known, and whether its loop is bad. says: of the reports of both."""
    errors, others = [e for one in (first, second) if (e := numbers(one).get(RMSE)) is not None], conditions(first, second)
    if len(errors) < 2:
        known = all(says) and all(section(one, "mission") for one in (first, second))  # not only a file's name
        if known and not others and differing_keys(["controller"], first, second):
            same = "Same vehicle, path, air and limits; the controllers or their gains differ."
            return f"{same} {names[0]}: {says[0]} {names[1]}: {says[1]}"
        return f"{names[0]} and {names[1]} are not ranked{f', because their {others} differ' if others else ''}."
    within = f"With different {others}: " * bool(others)
    if len({value(one, "m", max(errors)) for one in errors}) == 1:
        return f"{within}Both are equally close to their paths."
    near, far = (0, 1) if errors[0] < errors[1] else (1, 0)
    ratio = errors[far] / errors[near] if errors[near] else math.inf
    times = f"{units.number(ratio, 2)} times closer" if 1.05 <= ratio < math.inf else "closer"
    but = f", but its loop is {loop} at rest" if (loop := bad_loop((first, second)[near])) else ""
    return f"{within}{names[near]} is {times} to its path than {names[far]}, by position RMSE{counted(first)}{but}."


def value(one: float, unit: str, largest: float) -> str:
    """A number as people write it, in the unit that suits the largest of its rows, angles in degrees; a count as it is."""
    if unit == "-" and one.is_integer() and abs(one) < 1e9:
        return f"{one:.0f}"
    unit, factor = units.suited(unit, 0.0 if unit in units.ANGLES else largest)
    text = units.number(factor * one)
    space = "\N{NO-BREAK SPACE}" * (unit == "°" and "×" in text)  # or it looks like a digit of the power
    return text + space + units.unit_suffix(unit)


OF_LOST = {"ended", "largest_tilt", "saturated_share", "lowest_thrust_share", "full_thrust_share"}
FEW = {*OF_LOST, "position_rmse", "largest_error", "heading_error", "rotors.activity", "mean_thrust"}
"""Of two flights, what is shown at once, if one is lost and if not."""

WORDS = {
    "error_growth": "factor by which the error grows", "rate_growth": "factor by which the turn rates grow",
    "rotors.least": "least thrust of a rotor", "rotors.largest": "largest thrust of a rotor", "ended": "time flown",
    "rotors.activity": "rotor activity", "saturated_share": "share of the time at a rotor's limit",
    "lowest_thrust_share": "share of the time at a rotor's least thrust",
    "full_thrust_share": "share of the time at a rotor's full thrust",
    "shaking": "swing of the thrust's axis, RMS", "overturned": "largest tilt once upright",
    "relative_error": "position error over the path's size", "measured_rmse": "error of the measured position, RMSE",
}  # fmt: skip
"""What metrics are called whose names do not say it."""

ENTRIES = {
    "psi": "yaw", "theta": "pitch", "phi": "roll", "u": "thrust", "tau_psi": "yaw torque", "tau_theta": "pitch torque",
    "tau_phi": "roll torque",
}  # fmt: skip
LEVELS = {
    "rmse": "error, RMSE", "largest": "error, largest", "final": "error, at the end", "error_settling": "error, settling time",
    "angle_settling": "angle, settling time",
}  # fmt: skip
"""What the numbers of an entry are called, and those of each coordinate."""


def words(key: str) -> str:
    """`x error, RMSE` of `position.x.rmse[m]`; no word twice, as in `largest_weight_norm.norm_W1`."""
    name = key.partition("[")[0]
    kind, *levels = [ENTRIES.get(one, one) for one in name.split(".")]
    if kind in ("position", "attitude") and levels:
        return " ".join([*levels[:-1], LEVELS.get(levels[-1], levels[-1])])
    said = WORDS.get(name) or units.metric(", ".join([kind, *levels]))[0]
    return re.sub(r"\b(\w+),? \1\b", r"\1", said)


def row(key: str, first: float | None, second: float | None, largest: float) -> list[str]:
    """Both values and their ratio. largest: of the group, whose unit they have."""
    _, unit = units.metric(key)
    text = units.percent if key.endswith("_share") else partial(value, unit=unit, largest=largest)
    ratio = units.number(second / first) if first and second is not None else "–"
    return [*("–" if one is None else text(one) for one in (first, second)), ratio]


def group(key: str) -> tuple[str, str]:
    """What the rows of x, y and z share, or those of yaw, pitch and roll, whose numbers have one unit."""
    first, *_, last = key.split(".", 2) if key.count(".") > 1 else (key, "")
    return first, last


def group_sizes(*sides: dict[str, float]) -> dict[tuple[str, str], float]:
    """The largest number of each group."""
    found: dict[tuple[str, str], float] = {}
    for key, one in (pair for side in sides for pair in side.items()):
        found[group(key)] = max(abs(one), found.get(group(key), 0.0))
    return found

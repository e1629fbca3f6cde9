"""Results under a folder: what `quadstep serve` lists, and a recorded flight read back.

And a result as a page: flown live where its metrics.json says how, else as its CSV recorded it.
"""

import contextlib
import csv
import os
import re
import warnings
from collections.abc import Iterable
from html import unescape
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from quadstep.engines.fly import FlightPlan
from quadstep.interfaces.closed_loop import Outcome
from quadstep.interfaces.log import REASONS, FlightLog
from quadstep.io import files
from quadstep.io.documents import read_json
from quadstep.io.errors import UserError
from quadstep.metrics.registry import AT_REST, Metrics, at_rest
from quadstep.metrics.verdict import FlightGrade, together
from quadstep.mission.clock import MOST_ROWS
from quadstep.mission.data_files import KEY as PARAMETERS
from quadstep.mission.read import check_mission
from quadstep.mission.schema import Mission
from quadstep.page.build import GROUP, build_page
from quadstep.page.flights import ShownFlight, facts, filed
from quadstep.page.model import Link, identity
from quadstep.report.publish import MANIFEST

DEEPEST, MOST_RESULTS = 6, 2000
MOST_PAGES = 20
LARGEST_NUMBER = 1e30
"""In a row of a log that is drawn; differences and squares of larger ones leave the range of numbers."""

REPORTS = (
    "page.html", "report.html", "index.html", "report.md", "certificate.json", "claims.json", "flight.csv", "metrics.json",
)  # fmt: skip
"""What of a result is linked, best first."""


class ResultFolder(NamedTuple):
    """A result: a folder, or a page of its own in one.

    place: the folder, below the one that is served. says: how the flight ended, or what the report answers. changed: when its
    newest file was written, seconds since 1970. files: names of what can be opened, the best first. kind: what it is of.
    picture: a figure of it, from there. rmse: of the position [m], of a flight that was not lost. grade: of a flight, as in
    `quadstep.metrics.verdict`; empty if not known. facts: the first numbers of its report, what each is of, its value and
    what is said of it, such as its interval. loop: the grade of a flight's loop at rest. lack: how many of its
    flights are not as commanded.
    """

    place: Path
    name: str
    says: str
    changed: float
    files: tuple[str, ...]
    kind: str = "Report"
    picture: str | None = None
    rmse: float | None = None
    grade: str = ""
    facts: tuple[tuple[str, str, str], ...] = ()
    loop: str = ""
    lack: str = ""


ARTICLE = "article.html"
KINDS = {
    "campaign.json": "Campaign", "claims.json": "Reproduction", "certificate.json": "Certificate",
    "envelope.parquet": "Envelope", "tuned.toml": "Tuning", "pairs.csv": "Comparison", "flight.csv": "Flight",
    "prediction_errors.csv": "Replay", ARTICLE: "Article",
}  # fmt: skip
"""What a result without a report is of, by a file that it has."""

REPORT, HEAD = "report.html", 100_000
"""Where a result has its title, kind and answer, if not in another page, and in how many characters."""

TITLE, KIND = re.compile(r"<title>(.*?)</title>", re.DOTALL), re.compile(r"<span>quadstep · (.*?)</span>")
GRADE = re.compile(r'<meta name="grade" content="(.*?)">')
ANSWER, TAG = re.compile(r'<p class="answer">(.*?)</p>', re.DOTALL), re.compile(r"<[^>]*>")
FACT = re.compile(r"<div><dt>(.{1,400}?)</dt><dd[^>]*>(.{1,400}?)(?:<small>(.{1,400}?)</small>)?</dd>")
MOST_FACTS = 8


class ReportOpening(NamedTuple):
    """What a report begins with, as plain text; empty where it does not say so."""

    title: str = ""
    kind: str = ""
    answer: str = ""
    facts: tuple[tuple[str, str, str], ...] = ()
    grade: str = ""


PICTURES = (
    "figures/position.svg", "fig04.svg", "envelope.svg", "convergence.svg", "certificate.svg", "figures/distributions.svg",
    "completion.svg",
)  # fmt: skip
"""What a result is seen by, the first that there is."""


def results(root: Path) -> list[ResultFolder]:
    """All results in folders below `root` that are not hidden, by place. Links are not followed."""
    found: list[ResultFolder] = []
    for name, inner, _ in islice(os.walk(root, followlinks=False), MOST_RESULTS):
        folder = Path(name)
        deepest = len(folder.relative_to(root).parts) >= DEEPEST
        inner[:] = [] if deepest else sorted(one for one in inner if not one.startswith("."))
        found += results_in(root, folder)
    return sorted(found, key=lambda result: result.place)


def results_in(root: Path, folder: Path) -> list[ResultFolder]:
    """The results that a folder holds: first what it is as a whole, if so; then pages of another kind, such as proofs."""
    try:
        found = {entry.name: entry.stat().st_mtime for entry in os.scandir(folder) if entry.is_file(follow_symlinks=False)}
    except OSError:  # not ours to read, or gone meanwhile
        return []
    known = [name for name in REPORTS if name in found]
    pages = sorted(name for name in found if name.endswith(".html") and name not in known and not name.startswith("."))
    page = REPORT if REPORT in found else next(iter([*known, *pages]), "")
    begins = report_opening(folder / page) if page.endswith(".html") else ReportOpening()
    others = {name: report_opening(folder / name) for name in pages[:MOST_PAGES]}
    loose = len(pages) + len(known) > 1 and not ({MANIFEST, REPORT, *KINDS} - {ARTICLE}) & found.keys()
    own = {name: one for name, one in others.items() if loose or (one.kind and not (known and one.kind == begins.kind))}
    place = folder.relative_to(root)
    alone = [
        ResultFolder(place, one.title or name, one.answer, found[name], (name,), one.kind or KINDS.get(name, "Page"),
                     facts=one.facts, loop=one.grade)
        for name, one in own.items()
    ]  # fmt: skip
    shown = [*known, *(name for name in others if name not in own)]
    if not shown:
        return alone
    content = manifest(folder)
    name = begins.title if "claims.json" in found else content.get("name")
    title = name if isinstance(name, str) else begins.title or folder.name
    other = "Page" if loose else "Report"
    kind = begins.kind or next((KINDS[name] for name in KINDS if name in found.keys() - own), other)
    title = folder.name if title == kind else title  # which tells it from no other
    title = f"{folder.parent.name}, {title}" if title.isdigit() else title  # an attempt of a class
    rmse = content.get("position_rmse[m]") if grade(content) != FlightGrade.LOST else None  # its own would be the smallest
    known_rmse = float(rmse) if isinstance(rmse, int | float) and 0.0 <= rmse < LARGEST_NUMBER else None
    whole = ResultFolder(
        place, title, ending_text(content) or begins.answer, max(found[name] for name in shown),
        tuple(shown), kind, picture(folder, found), known_rmse, grade(content), begins.facts,
        loop_grade(study := content or campaign_content(folder)), lack(study),
    )  # fmt: skip
    return [whole, *alone]


def picture(folder: Path, found: Iterable[str]) -> str | None:
    """A picture of a result: one of `PICTURES`, or the first that it has, there or among its figures, an SVG before a PNG."""
    try:
        figures = sorted(one.name for one in os.scandir(folder / "figures") if one.is_file(follow_symlinks=False))
    except OSError:
        figures = []
    names = (*sorted(found), *(f"figures/{name}" for name in figures))
    there = [name for ending in (".svg", ".png") for name in names if name.endswith(ending)]
    return next((name for name in (*PICTURES, *there) if name in there), None)


def ending_text(content: dict[str, object]) -> str:
    """How a flight ended, from its metrics.json, as far as that says so."""
    time, outcome = (content.get(key) for key in ("ended[s]", "outcome"))
    if not isinstance(outcome, str) or not isinstance(time, int | float):
        return ""
    law = f" under {name}" if (name := controller(content)) else ""
    if grade(content) == FlightGrade.LOST:
        known = outcome.upper() in Outcome.__members__
        return f"lost at {time:g} s{law}: {REASONS[Outcome[outcome.upper()]] if known else outcome}"
    reasons = content.get("grade_reasons")
    but = together([one for one in reasons if isinstance(one, str)]) if isinstance(reasons, list) and reasons else ""
    loop = f"; {at_rest({'grade': word})}" if (word := loop_grade(content)) else ""
    counted = f"; errors count from {since:g} s on" if (since := scored_from(content)) else ""
    return f"flew {time:g} s{law}{f', but {but}' if but else ''}{loop}{counted}"


def section(content: Metrics, key: str) -> Metrics:
    """A table of a metrics.json, or one without keys."""
    return found if isinstance(found := content.get(key), dict) else {}


def controller(content: Metrics) -> str:
    """The type of the controller that flew; empty where it is not known."""
    return str(section(section(content, "mission"), "controller").get("type", ""))


def scored_from(content: dict[str, object]) -> float:
    """From when on a flight's errors count [s], as far as its metrics.json says."""
    since = section(content, "mission").get("score_from")
    return float(since) if isinstance(since, int | float) and 0.0 < since < LARGEST_NUMBER else 0.0


def loop_grade(content: dict[str, object]) -> str:
    """Of a flight's loop at rest, or of the loop that a result is of."""
    word = section(content, AT_REST).get("grade", content.get("grade"))
    return word if isinstance(word, str) and word not in {*FlightGrade} else ""


def lack(content: dict[str, object]) -> str:
    """How many of a study's graded flights are not as commanded; empty where none is such."""
    match section(content, "graded"):
        case {"flights": int(flights), "not as commanded": int(bad)} if bad > 0:
            some = f"{bad:,} of {flights:,} not" if bad < flights else f"none of {flights:,}" if flights > 1 else "not"
            return f"{some} as commanded"
    return ""


def grade(content: dict[str, object]) -> str:
    """Of a flight, as far as its metrics.json says; one that ended early is lost, whoever wrote it."""
    stated, outcome = content.get("grade"), content.get("outcome")
    if isinstance(outcome, str) and outcome != Outcome.COMPLETED.name.lower():
        return FlightGrade.LOST
    return stated if isinstance(stated, str) and stated in {*FlightGrade} else ""


def report_opening(report: Path) -> ReportOpening:
    try:
        with report.open(encoding="utf-8", errors="replace") as file:
            head = file.read(HEAD)
    except OSError:  # gone meanwhile, or not ours to read
        return ReportOpening()
    found = (of.search(head) for of in (TITLE, KIND, ANSWER, GRADE))
    title, kind, answer, grade = (plain_text(one[1]) if one else "" for one in found)
    facts = (map(plain_text, one.groups("")) for one in islice(FACT.finditer(head), MOST_FACTS))
    return ReportOpening(title, kind, answer, tuple((what, value, more) for what, value, more in facts), grade)


def plain_text(markup: str) -> str:
    return unescape(TAG.sub("", markup.replace("<sub>", "_")))


def manifest(folder: Path, name: str = MANIFEST) -> dict[str, Any]:
    """The content of metrics.json; empty where it is not there or something else. Links are not followed."""
    with contextlib.suppress(UserError):
        content = read_json(folder / name, links=False)
        return content if isinstance(content, dict) else {}
    return {}


def campaign_content(folder: Path) -> Metrics:
    """The content of campaign.json, that of its summary beside the rest; empty as that of `manifest`."""
    content = manifest(folder, "campaign.json")
    return content | section(content, "summary")


def read_log(path: Path, outcome: Outcome, ended: float) -> FlightLog:
    """A log from the CSV that `quadstep fly` writes. Links are not followed. Raises UserError for anything else."""
    other = UserError(f"{path}: is not a flight.csv written by `quadstep fly`")
    with files.table(path, files.LOG, links=False) as lines, warnings.catch_warnings(action="ignore"):  # a log without rows
        try:
            header = next(csv.reader(lines), [])
            rows = np.loadtxt(lines, delimiter=",", ndmin=2, dtype=np.float64, max_rows=MOST_ROWS + 2)
        except (OSError, ValueError, csv.Error):
            raise other from None
    rows = rows if rows.size else np.zeros((0, len(header)))
    columns = {name.partition("[")[0]: name.partition("[")[2].removesuffix("]") for name in header}
    if rows.shape[1] != len(header) or len(columns) != len(header) or not {"t", "x", "y", "z"} <= columns.keys():
        raise other
    if len(rows) > MOST_ROWS + 1:
        raise UserError(f"{path}: more than {MOST_ROWS} rows, the most that a log may have")
    return FlightLog(columns, rows[(abs(rows) <= LARGEST_NUMBER).all(axis=1)], outcome, ended, None)


def open_result(folder: Path, links: tuple[Link, ...] = ()) -> str:
    """The page of the flight in `folder`. Raises UserError where there is none."""
    one = flown_in(folder)
    return build_page(one.name, (), [one], links=links)


def open_two(folders: tuple[Path, Path], links: tuple[Link, ...] = ()) -> str:
    """The page of two flights. Raises UserError where there is none."""
    first = flown_in(folders[0])
    second = flown_in(folders[1], (first.id,))
    if first.name == second.name:
        above = os.path.commonpath(folders)
        places = [f"{first.name} ({folder.relative_to(above).as_posix()})" for folder in folders]
        first, second = (one._replace(name=place) for one, place in zip((first, second), places, strict=True))
    return build_page(f"{first.name} and {second.name}", (), [first, second], links=links)


def flown_in(folder: Path, names: tuple[str, ...] = ()) -> ShownFlight:
    """The flight in `folder`. names: names that others on the page have. Raises UserError where there is none."""
    content = manifest(folder)
    ended = content.get("ended[s]")
    log = read_log(folder / "flight.csv", outcome(content), float(ended) if isinstance(ended, int | float) else 0.0)
    mission, plan, why_not = plan_again(content.get("mission"))
    name = name_in(content, folder.name)
    found = content.get("warnings")
    warnings = tuple(line for line in found if isinstance(line, str)) if isinstance(found, list) else ()
    try:
        facts(content), filed(content)
    except (TypeError, KeyError, ValueError, AttributeError):  # metrics of another kind than the page shows
        content = {}
    return ShownFlight(identity(name, names), name, GROUP, mission, plan, log, content,
                  warnings=warnings, why_not=why_not)  # fmt: skip


def name_in(content: dict[str, object], otherwise: str) -> str:
    """The flight's name in a metrics.json."""
    named = content.get("name")
    return named if isinstance(named, str) else otherwise


def plan_again(content: object) -> tuple[Mission | None, FlightPlan | None, str]:
    """The flight that a metrics.json describes, or why it cannot be flown again; one that needs further files is not planned,
    so that none is read.
    """
    if not isinstance(content, dict):
        return None, None, "its metrics.json does not say how it was flown"
    try:
        if names_files(content):
            return None, None, "its mission needs further files"
        mission = check_mission(content, "metrics.json")
        return mission, mission.plan(), ""
    except UserError as error:
        return None, None, str(error).rstrip(".")
    except (ArithmeticError, ValueError, RecursionError):
        return None, None, "its metrics.json does not describe a flight"


FILE_KEYS = "file", "weights", PARAMETERS
"""Keys of a mission, in whatever table, whose text is the name of a file that is read."""


def names_files(content: object) -> bool:
    """Whether a mission names files to be read."""
    if isinstance(content, dict):
        own = any(isinstance(content.get(key), str) for key in FILE_KEYS)
        return own or any(names_files(part) for part in content.values())
    return isinstance(content, list) and any(names_files(part) for part in content)


def outcome(content: dict[str, object]) -> Outcome:
    """How the flight ended, as far as known."""
    name = content.get("outcome")
    return Outcome[name.upper()] if isinstance(name, str) and name.upper() in Outcome.__members__ else Outcome.COMPLETED

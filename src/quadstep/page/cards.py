"""The list of results as cards, each with a picture of its flight, which can be sorted, filtered and compared; works without
scripts, too.

Two results beside each other: what their metrics.json say, number by number.
"""

import io
import math
import os
import re
import time
from collections.abc import Iterable
from html import escape
from importlib.resources import files
from itertools import pairwise
from pathlib import Path
from urllib.parse import quote, urlencode

import numpy as np
from numpy.typing import NDArray

from quadstep.io.files import LONGEST_LINE
from quadstep.metrics.registry import Metrics
from quadstep.metrics.verdict import scalars
from quadstep.page.folder import ResultFolder, name_in, scored_from
from quadstep.page.model import identity
from quadstep.report import colours, markup, units
from quadstep.report.markup import page_text, paragraph

DROP = (
    '<section class="drop" data-scripted><h2>Advice from a log</h2><p>Drop a log of PX4, ArduPilot or Betaflight on this page '
    'or choose one.</p><label>Choose a log<input type="file" id="log" accept=".ulg,.ulog,.bin,.bbl,.bfl"></label> '
    '<span id="said" role="status"></span></section>'
)
"""Where this machine's list takes a log."""


LEGEND = (
    "Pictures of flights: the line is the path flown, the pale band the path asked for; a cross marks where a flight was lost."
)


def part(name: str, package: str = "quadstep.page") -> str:
    """A file of a package, as markup."""
    kind = "style" if name.endswith(".css") else "script"
    return f"<{kind}>{files(package).joinpath(name).read_text(encoding='utf-8')}</{kind}>"


def list_page(root: Path, folders: list[ResultFolder], share: str = "") -> str:
    """The list of results as HTML, every text escaped. share: markup that says how others open it."""
    if not folders:
        body = [paragraph("No results yet. `quadstep fly` and `quadstep reproduce` produce them.")]
    else:
        cards = "".join(card(result) for result in sorted(folders, key=lambda one: -one.changed))
        together = '<a class="together" id="together" hidden></a>'
        legend = "" if all(one.kind != "Flight" for one in folders) else paragraph(LEGEND)
        body = [bar(folders), legend, f'<ul class="cards" id="cards">{cards}</ul>', together, part("results.js")]
    drop = [] if share else [DROP, part("dropped.js")]
    return page_text(f"Results in {root.name or root}", [share, *body, *drop], "Results", part("results.css"))


def bar(folders: Iterable[ResultFolder]) -> str:
    kinds = "".join(f"<option>{escape(kind)}</option>" for kind in sorted({one.kind for one in folders}))
    orders = {"newest": "newest first", "name": "by name", "error": "smallest error first", "folder": "by folder"}
    options = "".join(f'<option value="{key}">{text}</option>' for key, text in orders.items())
    return (
        '<div class="bar" role="search">'
        '<input data-scripted type="search" id="search" placeholder="Search" aria-label="Search results">'
        f'<select data-scripted id="kind" aria-label="Kind"><option value="">all kinds</option>{kinds}</select>'
        f'<select data-scripted id="order" aria-label="Order">{options}</select>'
        '<span data-scripted id="count" role="status"></span></div>'
    )


def address(result: ResultFolder, name: str) -> str:
    place = result.place.as_posix()
    return f"/files/{'' if place == '.' else quote(place) + '/'}{quote(name)}"


def best(result: ResultFolder) -> str:
    """What a card opens: the page or report, or the flight drawn from its log."""
    if "flight.csv" in result.files and not {"page.html", "report.html"} & set(result.files):
        return address(result, "").replace("/files/", "/fly/", 1)
    return address(result, result.files[0])


def facts_tile(result: ResultFolder) -> str:
    """What a study's report begins with, in type that can be read: its figures are drawn for a page, not for a card."""
    if "flight.csv" in result.files or not result.facts:
        return ""
    told = "".join(f"<span><b>{units.rich(value)}</b> {units.rich(what)}</span>" for what, value in result.facts)
    return f'<p class="facts">{told}</p>'


NO_PICTURE = "<span>no picture</span>"


def picture(result: ResultFolder) -> str:
    """Its thumbnail: of a flight its path."""
    if "flight.csv" not in result.files and result.picture is None:
        return NO_PICTURE
    file = address(result, result.picture or "")
    source = address(result, "").replace("/files/", "/thumb/", 1) if "flight.csv" in result.files else file
    return f'<img loading="lazy" alt="" src="{escape(source)}">'


MARKS = {
    "as asked": ("good", "✓", "as asked"), "flew, but": ("fair", "!", "completed, not as asked"), "lost": ("bad", "✕", "lost"),
}  # fmt: skip
"""Of a grade: its colour, its sign, and what it is called where no reason follows it."""


def grade_mark(grade: str) -> str:
    """A grade with its sign, as markup; nothing where there is none."""
    if grade not in MARKS:
        return ""
    kind, sign, said = MARKS[grade]
    return f'<b class="{kind}"><span aria-hidden="true">{sign}</span> {said}</b>'


LABELS = {
    "page.html": "Live page", "report.html": "Report", "index.html": "Page", "report.md": "Report (text)",
    "certificate.json": "Certificate (JSON)", "claims.json": "Claims (JSON)", "flight.csv": "Log (CSV)",
    "metrics.json": "Numbers (JSON)",
}  # fmt: skip
"""What files are called in links; others by their name."""


def file_label(name: str) -> str:
    return LABELS.get(name) or re.sub("[-_]+", " ", name.removesuffix(".html")).capitalize()


def card(result: ResultFolder) -> str:
    """One result: its picture and name lead to its page or report; then every file."""
    place = result.place.as_posix()
    places = ((escape(address(result, name)), escape(file_label(name))) for name in result.files)
    links = " ".join(f'<a href="{file}">{label}</a>' for file, label in places)
    try:
        written = time.strftime("%Y-%m-%d %H:%M", time.localtime(result.changed))
    except (ValueError, OverflowError):  # a time that no calendar has
        written = ""
    number = "" if result.rmse is None else f'<b class="value">RMSE {units.quantity(result.rmse, "m")}</b>'
    data = {
        "name": result.name, "place": place, "kind": result.kind, "changed": f"{result.changed:.0f}",
        "grade": result.grade, "rmse": "" if result.rmse is None else f"{result.rmse!r}",
    }  # fmt: skip
    attributes = " ".join(f'data-{key}="{escape(value)}"' for key, value in data.items())
    href, told = escape(best(result)), facts_tile(result)
    shown = (
        ""
        if told or (drawn := picture(result)) == NO_PICTURE
        else f'<a class="thumb" href="{href}" tabindex="-1" aria-hidden="true">{drawn}</a>'
    )
    return (
        f'<li {attributes}>{shown}<div class="card">'
        f'<p class="head"><span class="kind">{escape(result.kind)} {grade_mark(result.grade)}</span> {number}</p>'
        f'<h2><a href="{href}">{escape(result.name)}</a></h2><p class="says">{escape(result.says)}</p>{told}'
        f'<p class="place">{escape("" if place == "." else place)}</p><p>{written}</p><div class="files">{links}</div>'
        f'<label><input type="checkbox" value="{escape(place)}"> compare</label></div></li>\n'
    )


ROWS = 240
"""Of a log that are drawn."""

WIDE, HIGH, MARGIN, CAPTION = 300.0, 150.0, 14.0, 12.0
FLAT = 0.3
"""Height over width of a path below which it is seen from above."""

STYLES = 'stroke="var(--blue)" stroke-width="1.6"', 'stroke="var(--blue)" stroke-width="5" opacity="0.26"'
"""Of the path as flown, and as desired."""

LARGEST = 1e15
"""Of a number that is drawn."""


def thumbnail(log: io.BufferedReader, lost: bool) -> str:
    """An SVG of a flight.csv. lost: whether it ended so, which is marked. Raises ValueError for a log without a path."""
    columns = [name.partition(b"[")[0] for name in log.readline(LONGEST_LINE).strip().split(b",")]
    rows = sampled_rows(log, [columns.index(name) for name in (b"x", b"y", b"z", b"x_d", b"y_d", b"z_d")], len(columns))
    across, up = view_axes(rows[:, :3])
    flown, desired = rows[:, [across, up]], rows[:, [3 + across, 3 + up]]
    low = np.minimum(flown.min(axis=0), desired.min(axis=0))
    span = np.maximum(flown.max(axis=0), desired.max(axis=0)) - low
    size = float(min((np.array([WIDE, HIGH - CAPTION]) - 2.0 * MARGIN) / np.maximum(span, 1e-9)))
    drawn = [(one - low - 0.5 * span) * [size, -size] + [0.5 * WIDE, 0.5 * (HIGH - CAPTION)] for one in (flown, desired)]
    lines = [line(one, style) for one, style in zip(reversed(drawn), reversed(STYLES), strict=True)]
    x, y = drawn[0][-1]
    end = f"M{x - 6:.1f} {y - 6:.1f}l12 12m0-12l-12 12" if lost else f"M{x:.1f} {y:.1f}h0"
    stroke = 'stroke="var(--bad)" stroke-width="3"' if lost else 'stroke="var(--blue)" stroke-width="6"'
    said = f"{'xyz'[across]} {span[0]:.2g} m, {'xyz'[up]} {span[1]:.2g} m"
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDE:g} {HIGH:g}" fill="none" stroke-linecap="round" '
        f'stroke-linejoin="round"><style>{colours.STYLE}</style>{"".join(lines)}<path d="{end}" {stroke}/>'
        f'<text x="{WIDE - 4:g}" y="{HIGH - 5:g}" text-anchor="end" font-family="sans-serif" font-size="13" '
        f'fill="var(--muted)">{said}</text></svg>'
    )


def line(points: NDArray[np.float64], style: str) -> str:
    """A path through points, those left out that lie where the one before does."""
    texts = [f"{x:.1f} {y:.1f}" for x, y in points]
    moved = [texts[0], *(one for before, one in pairwise(texts) if one != before)]
    return f'<path d="M{"L".join(moved)}" {style}/>'


def view_axes(flown: NDArray[np.float64]) -> tuple[int, int]:
    """The axes to the right and upwards: x and y, or the wider of the two and z where the path is not flat."""
    span = np.ptp(flown, axis=0)
    wider = int(span[1] > span[0])
    return (0, 1) if span[2] < FLAT * span[wider] else (wider, 2)


def sampled_rows(log: io.BufferedReader, wanted: list[int], width: int) -> NDArray[np.float64]:
    """(n, wanted): these of `width` columns in the first row, the last, and some between. Raises ValueError for no rows."""
    first, last = log.tell(), os.fstat(log.fileno()).st_size
    texts = [log.readline(LONGEST_LINE)]
    for place in range(1, ROWS):
        log.seek(first + (last - first) * place // ROWS)
        log.readline(LONGEST_LINE)  # the rest of a row
        texts.append(log.readline(LONGEST_LINE))
    log.seek(max(first, last - LONGEST_LINE))
    texts += log.read(LONGEST_LINE).splitlines()[-1:]
    cells = [text.split(b",") for text in texts]
    rows = np.array([[float(one[place]) for place in wanted] for one in cells if len(one) == width]).reshape(-1, len(wanted))
    rows = rows[np.all(np.abs(rows) < LARGEST, axis=1)]
    if not len(rows):
        raise ValueError("no row can be drawn")
    return rows


MOST_ROWS = 400
RMSE = "position_rmse[m]"

STYLE = """<style>
.two { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 20rem), 1fr)); gap: 12px; }
.two figure { margin: 0; }
.two .drawn { flex: 1 1 100%; } .two img { width: 100%; max-width: 100%; max-height: 20rem; object-fit: contain; }
.two img[src^="/thumb"] { background: none; } .two figcaption::before { content: none; }
</style>"""


def compared_page(results: tuple[ResultFolder, ResultFolder], contents: tuple[Metrics, Metrics]) -> str:
    """The page. contents: of their metrics.json."""
    first, second = (numbers(content) for content in contents)
    names = [one.name if results[0].name != results[1].name else one.place.as_posix() for one in results]
    shown = "".join(
        f'<figure><div class="drawn">{picture(one)}</div><figcaption><a href="{escape(best(one))}">{escape(name)}</a>'
        f"</figcaption></figure>"
        for one, name in zip(results, names, strict=True)
    )
    unlike = why_incomparable(names, *contents)
    keys = [
        key for key in dict.fromkeys([*first, *second]) if key not in TWINS or any(twin(one, key) for one in (first, second))
    ]
    header = ("", *names, "second / first")[: 3 if unlike else 4]
    rows = [[words(key), *row(key, first.get(key), second.get(key))][: len(header)] for key in keys[:MOST_ROWS]]
    others = differing_keys(CONDITIONS, *contents)
    closer = (f"With different {units.listed(others)}: " if others else "") + answer(names, first, second)
    body = [
        markup.summary(unlike or closer, facts(names, first, second)),
        f'<div class="two">{shown}</div>',
    ]
    if all("flight.csv" in one.files for one in results):
        places = urlencode({"a": results[0].place.as_posix(), "b": results[1].place.as_posix()})
        if different(*contents):
            body.append(markup.links([(f"/both?{places}", "Both flights on one page")]))
            body.append(markup.paragraph(f"They fly different {different(*contents)}, so they are not overlaid."))
        else:
            front, behind = (name_in(content, one.place.name) for one, content in zip(results, contents, strict=True))
            behind = identity(behind, (identity(front, ()),))
            body.append(markup.links([(f"/both?{places}#keep={behind}", "Both flights, overlaid")]))
    body += [markup.heading("All numbers", "numbers")]
    body += [markup.table(header, rows, escape) if rows else markup.paragraph("Neither result has numbers to compare.")]
    return markup.page_text(
        f"{names[0]} and {names[1]}", [*body, markup.links([("/", "All results")])], "Comparison of two", STYLE
    )


TWINS = {"overturned[rad]": "largest_tilt[rad]"}
"""Metrics that say the same as another one wherever they are equal."""


def twin(found: dict[str, float], key: str) -> bool:
    """Whether one says something else than the one that it often equals."""
    return found.get(key) != found.get(TWINS[key])


def why_incomparable(names: list[str], first: Metrics, second: Metrics) -> str:
    """Why the errors of two flights say nothing of which is better; empty where they may be compared."""
    if not all("outcome" in one for one in (first, second)):
        return ""
    lost = [name for name, one in zip(names, (first, second), strict=True) if one.get("outcome", "completed") != "completed"]
    if lost:
        return f"{' and '.join(lost)} {'was' if len(lost) == 1 else 'were'} lost, so the errors are not compared."
    starts = scored_from(first), scored_from(second)
    if starts[0] != starts[1]:
        counted = " and ".join(f"those of {name} count from {since:g} s on" for name, since in zip(names, starts, strict=True))
        return f"Their errors do not say which is better: {counted}."
    things = different(first, second)
    if first.get("ended[s]") != second.get("ended[s]") and "paths" not in things:
        things = f"{things} and durations" if things else "durations"
    return f"{names[0]} and {names[1]} fly different {things}, so their errors do not say which is better." if things else ""


def different(first: Metrics, second: Metrics) -> str:
    """What two flights do not share that makes them unlike: "paths", "vehicles", both, or nothing."""
    return " and ".join(f"{part}s" for part in differing_keys(("path", "vehicle"), first, second))


CONDITIONS = "start", "wind", "disturbance", "sensors", "events"
"""Keys of a mission that make it harder or easier to stay on a path."""


def differing_keys(keys: Iterable[str], first: Metrics, second: Metrics) -> list[str]:
    """Those of some keys of their missions in which two flights differ."""
    sides = [mission if isinstance(mission := one.get("mission"), dict) else {} for one in (first, second)]
    return [key for key in keys if sides[0].get(key) != sides[1].get(key)]


def numbers(content: Metrics) -> dict[str, float]:
    """The numbers of a metrics.json by dotted name, without those of the mission, and of where a flight was lost."""
    kept = {key: value for key, value in content.items() if key not in ("mission", "ending")}
    found = {}
    for key, value in scalars(kept).items():
        if isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e300:
            found[key] = float(value)
    return found


def answer(names: list[str], first: dict[str, float], second: dict[str, float]) -> str:
    """Which is closer to its path, as far as that is known."""
    errors = [one.get(RMSE) for one in (first, second)]
    if errors[0] is None or errors[1] is None:
        return f"{names[0]} and {names[1]}: only their numbers can be compared."
    if errors[0] == errors[1]:
        return "Both are equally close to their paths."
    near, far = (0, 1) if errors[0] < errors[1] else (1, 0)
    ratio = errors[far] / errors[near] if errors[near] else math.inf  # type: ignore[operator]
    times = f"{units.number(ratio, 2)} times closer" if math.isfinite(ratio) else "closer"
    return f"{names[near]} is {times} to its path than {names[far]}."


def facts(names: list[str], first: dict[str, float], second: dict[str, float]) -> list[markup.Fact]:
    errors = [(name, one[RMSE]) for name, one in zip(names, (first, second), strict=True) if RMSE in one]
    return [markup.Fact(f"{name}: position RMSE", units.quantity(value, "m")) for name, value in errors]


def value(one: float, unit: str, largest: float) -> str:
    """A number as people write it, in the unit that suits the largest of its row; a count as it is."""
    if unit == "-" and one.is_integer() and abs(one) < 1e9:
        return f"{one:.0f}"
    unit, factor = (units.of_angle if unit in units.ANGLES else units.handy)(unit, largest)
    return units.number(factor * one, 4) + units.unit_suffix(unit)


WORDS = {
    "error_growth": "factor by which the error grows", "rate_growth": "factor by which the turn rates grow",
    "rotors.least": "least thrust of a rotor", "rotors.largest": "largest thrust of a rotor",
}  # fmt: skip
"""What metrics are called whose names do not say it."""


def words(key: str) -> str:
    """`position x RMSE` of `position.x.rmse[m]`; no word twice, as in `largest_weight_norm.norm_W1`."""
    said = WORDS.get(key.partition("[")[0]) or units.metric(key)[0].replace(".", " ")
    return re.sub(r"\b(\w+) \1\b", r"\1", said)


def row(key: str, first: float | None, second: float | None) -> list[str]:
    _, unit = units.metric(key)
    largest = max(abs(one or 0.0) for one in (first, second))
    shown = ["–" if one is None else value(one, unit, largest) for one in (first, second)]
    ratio = units.number(second / first) if first and second is not None else "–"
    return [*shown, ratio]

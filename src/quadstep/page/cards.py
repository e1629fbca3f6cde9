"""The list of results as cards, each with a picture of its flight, which can be sorted, filtered and compared; works without
scripts, too.
"""

import re
import time
from collections.abc import Iterable
from html import escape
from importlib.resources import files
from pathlib import Path
from urllib.parse import quote

from quadstep.page.folder import REPORTS, ResultFolder
from quadstep.report import units
from quadstep.report.markup import page_text, paragraph

DROP = (
    '<section class="drop" data-scripted><h2>Advice from a log</h2><p>Drop a log of PX4, ArduPilot or Betaflight on this page '
    'or choose one.</p><label>Choose a log<input type="file" id="log" accept=".ulg,.ulog,.bin,.bbl,.bfl"></label> '
    '<span id="said" role="status"></span></section>'
)
"""Where this machine's list takes a log."""


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
        body = [bar(folders), f'<ul class="cards" id="cards">{cards}</ul>', together, part("results.js")]
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
        '<span data-scripted id="count" role="status"></span> <button data-scripted id="all" hidden>Show all</button></div>'
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
    """What a study's report begins with, in type that can be read."""
    if "flight.csv" in result.files or not result.facts:
        return ""
    told = "".join(f"<span><b>{units.rich(value)}</b> {units.rich(what)}</span>" for what, value, _ in result.facts[:2])
    return f'<p class="facts">{told}</p>'


def picture(result: ResultFolder) -> str:
    """Its thumbnail: of a flight its path, of a study a panel of its figure, unless it needs the names of its rows."""
    if result.kind == "Comparison" or ("flight.csv" not in result.files and result.picture is None):
        return ""
    file = address(result, result.picture or "")
    source = address(result, "").replace("/files/", "/thumb/", 1) if "flight.csv" in result.files else file
    source = source.replace("/files/", "/panel/", 1) if source.endswith(".svg") else source
    return f'<img loading="lazy" alt="" src="{escape(source)}">'


MARKS = {
    "as commanded": ("good", "✓", "as commanded"), "flew, but": ("fair", "!", "flew, but not as commanded"),
    "lost": ("bad", "✕", "lost"), "sound": ("good", "✓", "sound"), "fragile": ("fair", "!", "fragile"),
    "unstable": ("bad", "!", "unstable at rest"),
}  # fmt: skip
"""Of a grade, of a flight or of its loop: its colour, its sign, and what it is called where no reason follows it."""


def grade_mark(grade: str, of: str = "") -> str:
    """A grade with its sign, as markup; nothing where there is none. of: what it is of, and a blank."""
    if grade not in MARKS:
        return ""
    kind, sign, said = MARKS[grade]
    return f'<b class="{kind}"><span aria-hidden="true">{sign}</span> {of}{said}</b>'


LABELS = {
    "page.html": "Live page", "report.html": "Report", "index.html": "Page", "report.md": "Report (text)",
    "certificate.json": "Certificate (JSON)", "claims.json": "Claims (JSON)", "flight.csv": "Log (CSV)",
    "metrics.json": "Numbers (JSON)",
}  # fmt: skip
"""What files are called in links; others by their name."""


def card(result: ResultFolder) -> str:
    """One result: its picture and name lead to its page or report; then every file."""
    place = result.place.as_posix()
    called = {one: LABELS.get(one) or re.sub("[-_]+", " ", one.removesuffix(".html")).capitalize() for one in result.files}
    called |= {one: "Report" for one in result.files[: result.kind not in ("Page", "Article")] if one not in LABELS}
    links = " ".join(f'<a href="{escape(address(result, one))}">{escape(words)}</a>' for one, words in called.items())
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
    lack = result.lack and f'<b class="fair"><span aria-hidden="true">!</span> {escape(result.lack)}</b>'
    marks = " ".join((grade_mark(result.grade), grade_mark(result.loop, "loop "), lack))
    href, told, drawn = escape(best(result)), facts_tile(result), picture(result)
    box = "" if result.files[0] not in REPORTS else f'<label><input type="checkbox" value="{escape(place)}"> compare</label>'
    shown = drawn and f'<a class="thumb" href="{href}" tabindex="-1" aria-hidden="true">{drawn}</a>'
    return (
        f'<li {attributes}>{shown}<div class="card">'
        f'<p class="head"><span class="kind">{escape(result.kind)} {marks}</span> {number}</p>'
        f'<h2><a href="{href}">{escape(result.name)}</a></h2><p class="says">{units.rich(result.says)}</p>{told}'
        f'<p class="place">{escape("" if place == "." else place)}</p><p>{written}</p><div class="files">{links}</div>'
        f"{box}</div></li>\n"
    )

"""The list of results as cards with pictures, which can be sorted, filtered and compared; works without scripts, too."""

import time
from collections.abc import Iterable
from html import escape
from importlib.resources import files
from pathlib import Path
from urllib.parse import quote

from quadstep.page.folder import ResultFolder
from quadstep.report import units
from quadstep.report.page import page_text, paragraph

DROP = (
    "<p data-scripted><label>Advice from a log of PX4, ArduPilot or Betaflight: drop it here, or choose it "
    '<input type="file" id="log" accept=".ulg,.ulog,.bin,.bbl,.bfl"></label> <span id="said" role="status"></span></p>'
)
"""Where this machine's list takes a log."""


def part(name: str) -> str:
    """A file beside this one, as markup."""
    kind = "style" if name.endswith(".css") else "script"
    return f"<{kind}>{files('quadstep.page').joinpath(name).read_text(encoding='utf-8')}</{kind}>"


def list_page(root: Path, found: list[ResultFolder], share: str = "") -> str:
    """The list of results as HTML, every text escaped. share: markup that says how others open it."""
    if not found:
        body = [paragraph("No results yet. `quadstep fly` and `quadstep reproduce` produce them.")]
    else:
        cards = "".join(card(result) for result in sorted(found, key=lambda one: -one.changed))
        together = '<a class="together" id="together" hidden>Compare the two</a>'
        body = [bar(found), f'<ul class="cards" id="cards">{cards}</ul>', together, part("results.js")]
    drop = [] if share else [DROP, part("dropped.js")]
    return page_text(f"Results in {root.name or root}", [share, *body, *drop], "Results", part("results.css"))


def bar(found: Iterable[ResultFolder]) -> str:
    kinds = "".join(f"<option>{escape(kind)}</option>" for kind in sorted({one.kind for one in found}))
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
    """Where a file of a result is."""
    place = result.place.as_posix()
    return f"/files/{'' if place == '.' else quote(place) + '/'}{quote(name)}"


def best(result: ResultFolder) -> str:
    """What a card opens: the page or report, or the flight drawn from its log."""
    if "flight.csv" in result.files and not {"page.html", "report.html"} & set(result.files):
        return address(result, "").replace("/files/", "/fly/", 1)
    return address(result, result.files[0])


def picture(result: ResultFolder) -> str:
    """Its thumbnail: of a flight its path."""
    if "flight.csv" not in result.files and result.picture is None:
        return "<span>no picture</span>"
    file = address(result, result.picture or "")
    source = address(result, "").replace("/files/", "/thumb/", 1) if "flight.csv" in result.files else file
    return f'<img loading="lazy" alt="" src="{escape(source)}">'


MARKS = {"as asked": ("good", "✓"), "flew, but": ("fair", "!"), "lost": ("bad", "✕")}


def mark(result: ResultFolder) -> str:
    if result.grade not in MARKS:
        return ""
    kind, sign = MARKS[result.grade]
    return f' <b class="{kind}"><span aria-hidden="true">{sign}</span> {escape(result.grade)}</b>'


def card(result: ResultFolder) -> str:
    """One result: its picture and name lead to its page or report; then every file."""
    place = result.place.as_posix()
    links = " ".join(f'<a href="{escape(address(result, name))}">{escape(name)}</a>' for name in result.files)
    try:
        written = time.strftime("%Y-%m-%d %H:%M", time.localtime(result.changed))
    except (ValueError, OverflowError):  # a time that no calendar has
        written = ""
    said = [escape(result.says)] if result.says else []
    if result.rmse is not None:
        said.append(f"RMSE {units.quantity(result.rmse, 'm')}")
    data = {
        "name": result.name, "place": place, "kind": result.kind, "changed": f"{result.changed:.0f}",
        "grade": result.grade, "rmse": "" if result.rmse is None else f"{result.rmse!r}",
    }  # fmt: skip
    attributes = " ".join(f'data-{key}="{escape(value)}"' for key, value in data.items())
    href = escape(best(result))
    return (
        f'<li {attributes}><a class="thumb" href="{href}" tabindex="-1" aria-hidden="true">{picture(result)}</a>'
        '<div class="card">'
        f'<span class="kind">{escape(result.kind)}{mark(result)}</span><h2><a href="{href}">{escape(result.name)}</a></h2>'
        f'<p>{", ".join(said)}</p><p>{escape(place)} · {written}</p><div class="files">{links}</div>'
        f'<label><input type="checkbox" value="{escape(place)}"> compare</label></div></li>\n'
    )

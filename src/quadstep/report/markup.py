"""A report as one HTML file that opens offline, on a screen of any width, in the dark, and on paper; every text is escaped.

    page.page_text(title, [
        page.summary("In 98.1 % of flights it stays within 5 cm of its path.", facts, figures),   # the answer, at a glance
        page.heading("Outcomes", "outcomes"), page.paragraph(...), page.table(...), page.figure(...),   # the evidence
    ], kind="Campaign")

Headings make the contents. Numbers are written by `units.py`, names as symbols by `symbols.rich`, the look is `report.css`.
"""

import base64
import json
import re
from collections.abc import Callable, Collection, Iterable, Sequence
from functools import cache
from html import escape, unescape
from importlib.resources import files
from pathlib import Path
from typing import NamedTuple

from quadstep.io import __version__
from quadstep.report.colours import STYLE, themed
from quadstep.report.sheet import PHONE
from quadstep.report.units import rich, unbroken

FONTS = Path(str(files("quadstep.report").joinpath("fonts")))
TEXT, FORMULAS = "Inter", "STIX Two Math"
FOR_FIGURES = FONTS / "inter.ttf"
"""What Matplotlib measures and draws: regular, of all signs of the others."""

WEIGHTS = {TEXT: "400 700", FORMULAS: "400"}
FILES = {TEXT: "inter.woff2", FORMULAS: "math.woff2"}


@cache
def face(name: str) -> str:
    """A typeface as CSS that holds it."""
    data = base64.b64encode((FONTS / FILES[name]).read_bytes()).decode()
    return (
        f'@font-face {{ font-family: "{name}"; font-weight: {WEIGHTS[name]}; '
        f'src: url("data:font/woff2;base64,{data}") format("woff2"); }}\n'
    )


LOGO = (
    '<svg class="logo" viewBox="0 0 24 24" aria-hidden="true"><path d="M8.8 8.8l6.4 6.4M15.2 8.8l-6.4 6.4"/><circle cx="6" '
    'cy="6" r="4"/><circle cx="18" cy="6" r="4"/><circle cx="6" cy="18" r="4"/><circle cx="18" cy="18" r="4"/></svg>'
)
HEIGHT = re.compile(r'<svg [^>]*height="([\d.]+)pt"')
NARROW = re.compile(r'<svg [^>]*style="--wide: [\d.]+"(?! class)')
"""A strip that a phone shows whole."""

STRIPS = re.compile(r' data-strips="([^"]*)"')
SIZE = re.compile(r'width="[\d.]+pt" height="[\d.]+pt" viewBox="[^"]*"')
TALL = 325.0
"""Points of a figure's height above which it may fill a page of paper; others fill a third of one at most."""

HEADINGS = re.compile(r'<h2 id="([^"]*)">(.*?)</h2>')
SECTIONS = re.compile(r'(?=<h2 id="([^"]*)">)')
FEWEST_HEADINGS = 3
"""For which a page has a list of contents."""

SENTENCE = re.compile(
    r"(?<=\.)(?<!\bEq\.)(?<!\bEqs\.)(?<!\bFig\.)(?<!\be\.g\.)(?<!\bi\.e\.)(?<!\bvs\.)(?<!\bal\.)(?<!\bNo\.) "
)
"""Between sentences: not behind an abbreviation."""

QUOTES = re.compile(
    r"(?s)<(pre|code|script|style|textarea)\b.*?</\1>|<[^>]*>|(?<=>)(?:'|&#x27;)(?=(?:</span>)?s\b)"
    r"|(?<!\w)(?:'|&#x27;)(?P<said>[^'<]*?)(?:'|&#x27;)(?!\w)|(?<=[\w)])(?:'|&#x27;)"
)
"""Of a page: what stays as it is, an apostrophe behind a tag, a text in quotes, and any other apostrophe."""

LONG = 30
"""Letters of a word that may be broken on paper, so that its table fits."""


class Fact(NamedTuple):
    """One of the numbers that a summary shows. what: it is of. value: as people write it. more: in small print, its interval
    in words, say. verbatim: whether `what` is a file's name and not a symbol. kind: "fair" or "fails", of what warns.
    """

    what: str
    value: str
    more: str = ""
    verbatim: bool = False
    kind: str = ""


Cell = str | tuple[str, str]
"""A table cell: its text, or its text and a class."""


def style() -> str:
    """The look of reports."""
    return STYLE + files("quadstep.report").joinpath("report.css").read_text(encoding="utf-8")


def script(body: str) -> str:
    """What answers to the pointer, if a figure can."""
    if "<svg data-axes" not in body:
        return ""
    return f'<script id="reader">{files("quadstep.report").joinpath("report.js").read_text(encoding="utf-8")}</script>'


def own(text: str) -> str:
    """The markup of a user's own name, or a file's, whose apostrophes stay as they are (`QUOTES`)."""
    return escape(text).replace("&#x27;", "&apos;")


def heading(text: str, anchor: str, set_as: Callable[[str], str] = rich) -> str:
    """A section heading. set_as: `escape` for text in which nothing is a symbol."""
    return f'<h2 id="{escape(anchor)}">{set_as(text)}</h2>'


def paragraph(text: str, set_as: Callable[[str], str] = rich) -> str:
    """A paragraph. set_as: `escape` for text in which nothing is a symbol."""
    return f"<p>{unbroken(set_as(text))}</p>"


def note(text: str) -> str:
    """A paragraph in small print."""
    return f'<p class="note">{rich(text)}</p>'


def listing(lines: Iterable[str]) -> str:
    return f"<ul>{''.join(f'<li>{rich(line)}</li>' for line in lines)}</ul>"


COLUMN = 45
"""Characters of a line in one of three columns on paper."""


def verbatim(text: str, under: str = "", on_paper: bool = True) -> str:
    """Text as it is, line by line. under: what opens it, where it is long. on_paper: whether it is printed then."""
    lines = text.splitlines()
    wide = ' class="wide"' if 2 * sum(len(line) > COLUMN for line in lines) > len(lines) else ""
    shown = f'<pre{wide} tabindex="0">{escape(text)}</pre>'
    return disclosure(under, shown, on_paper) if under else shown


def disclosure(words: str, body: str, on_paper: bool = True) -> str:
    """Markup that opens at a click on these words. on_paper: whether it is printed."""
    kind = "" if on_paper else ' class="screen"'
    return f"<details{kind}><summary>{own(words)}</summary>{body}</details>"


def links(places: Iterable[tuple[str, ...]], before: str = "") -> str:
    """A list of links: address and text of each, and what follows it; a sentence before them. Paper has none."""
    said = f'<p class="screen">{rich(before)}</p>' if before else ""
    items = (f'<li><a href="{escape(to)}">{escape(text)}</a>{"".join(map(rich, more))}</li>' for to, text, *more in places)
    return f'{said}<ul class="screen">{"".join(items)}</ul>'


BLANK = frozenset(("", "-", "–"))


def without_blank(header: Sequence[str], rows: Sequence[Sequence[Cell]]) -> tuple[Sequence[str], Sequence[Sequence[Cell]]]:
    """A table without the columns in which no row has anything."""
    if any(len(row) != len(header) for row in rows):
        return header, rows
    kept = [i for i in range(len(header)) if not rows or not all(row[i] in BLANK for row in rows)] or [0]
    return [header[i] for i in kept], [[row[i] for i in kept] for row in rows]


def table(
    header: Sequence[str], rows: Iterable[Sequence[Cell]], set_as: Callable[[str], str] = rich, anchors: Sequence[str] = ()
) -> str:
    """A table of text, its names set as `paragraph` does; a header of empty names and blank columns are left out. anchors: of
    its rows.
    """
    header, rows = without_blank(header, list(rows))

    def cell(content: Cell) -> str:
        text, kind = content if isinstance(content, tuple) else (content, "")
        kind = kind or "long" * any(len(word) > LONG for word in text.split())
        return f'<td class="{escape(kind)}">{set_as(text)}</td>' if kind else f"<td>{set_as(text)}</td>"

    head = "".join(f"<th>{set_as(name)}</th>" if name else "<td></td>" for name in header)
    head = f"<thead><tr>{head}</tr></thead>" if any(header) else ""
    marks = [f' id="{one}"' for one in anchors] or [""] * len(rows)
    body = "".join(f"<tr{mark}>{''.join(map(cell, row))}</tr>\n" for mark, row in zip(marks, rows, strict=True))
    return f'<div class="scroll" tabindex="0"><table>{head}<tbody>\n{body}</tbody></table></div>'


def summary(
    answer: str, facts: Iterable[Fact] = (), figures: Sequence[str] = (), failed: bool = False, points: Sequence[str] = ()
) -> str:
    """What a report begins with: the answer in one sentence, the numbers that say it, and up to three figures that show it.

    answer: further sentences of it are set as text, points as a list. figures: of `figure`. failed: whether it is bad news.
    """
    first, *rest = SENTENCE.split(answer, maxsplit=1)
    tiles = "".join(
        f"<div><dt>{escape(one.what) if one.verbatim else rich(one.what)}</dt>"
        f"<dd{one.kind and f' class={one.kind}'}>{rich(one.value)}"
        f"{f'<small>{rich(one.more)}</small>' if one.more else ''}</dd></div>"
        for one in facts
    )
    tiles = f'<dl class="facts">{tiles}</dl>' if tiles else ""
    begins = f'<span class="fails">{rich(first)}</span>' if failed else rich(first)
    said = f'<p class="answer">{begins}</p>{"".join(paragraph(more) for more in rest if more)}'
    return f'{said}{unbroken(listing(points)) if points else ""}{tiles}<div class="summary">{"".join(figures)}</div>'


def figure(path: Path, caption: str, set_as: Callable[[str], str] = rich) -> str:
    """A figure drawn inline: from its SVG file, or from the PNG beside it where there is none.

    path: of either, its ending may be left out. Where there is only a PDF, it is named. The ids of an SVG get the file's name
    in front, so that several can stand on one page. set_as: of the caption, as for `paragraph`.
    """
    name = path.name.removesuffix(".svg").removesuffix(".png")
    svg, png = (path.with_name(f"{name}.{ending}") for ending in ("svg", "png"))
    if svg.is_file():
        text = svg.read_text(encoding="utf-8")
        drawing = in_strips(text[text.index("<svg") :])
        for mark in ('id="', 'href="#', "url(#"):
            drawing = drawing.replace(mark, f"{mark}{name}-")
        return inline_figure(themed(drawing), caption, set_as)
    if png.is_file():
        data = base64.b64encode(png.read_bytes()).decode()
        return inline_figure(f'<img alt="" src="data:image/png;base64,{data}">', caption, set_as)
    return note(f"{caption}: drawn in {name}.pdf.")


def in_strips(drawing: str) -> str:
    """A drawing as one for each of its strips (`report/told.py`), which a phone shows below one another."""
    told = STRIPS.search(drawing)
    if told is None:
        return drawing
    (left, wide, high, _), *others = json.loads(unescape(told[1]))
    first, more = SIZE.sub(strip(left, wide, high), STRIPS.sub("", drawing), count=1), ""
    for left, wide, high, names in others:
        parts = [re.search(rf'(?ms)^  <g id="{name}">$.*?^  </g>$', first) for name in names]
        drawn = [part[0] for part in parts if part]
        for one in drawn:
            first = first.replace(one, "", 1)
        more += f"<svg {strip(left, wide, high)}>{''.join(drawn)}</svg>"
    return first + more


def strip(left: float, wide: float, high: float) -> str:
    """The attributes of an SVG that shows this part of a drawing [pt]."""
    kind = ' class="wide"' if wide > 1.06 * 72.0 * PHONE else ""  # on 360 pixels its text would have less than 9
    return f'width="{wide}pt" height="{high}pt" viewBox="{left} 0 {wide} {high}" style="--wide: {wide}"{kind}'


def inline_figure(drawing: str, caption: str, set_as: Callable[[str], str] = rich) -> str:
    """A figure from its markup. set_as: as for `figure`."""
    role = "group" if "<a " in drawing else "img"  # of which links would be no part
    shown = f'<div class="drawn" tabindex="0" role="{role}" aria-label="{escape(caption)}">{drawing}</div>'
    height = HEIGHT.search(drawing)
    kinds = ["tall"] if height is not None and float(height[1]) > TALL else []
    kinds += ["one"] if drawing.count("<svg ") == 1 and NARROW.search(drawing) else []
    opened = f'<figure class="{" ".join(kinds)}">' if kinds else "<figure>"
    return f"{opened}{shown}<figcaption>{set_as(caption)}</figcaption></figure>"


def fold_sections(body: str, anchors: Collection[str]) -> str:
    """A body in which the sections with these anchors open at a click, also on their link; paper shows them."""
    first, *parts = SECTIONS.split(body)
    for anchor, part in zip(parts[::2], parts[1::2], strict=True):
        title, _, rest = part.partition("</h2>")
        shown = f"<summary><h2>{title.partition('>')[2]}</h2></summary>"
        hidden = f'<details class="part">{shown}<div id="{anchor}">{rest}</div></details>'
        first += hidden if anchor in anchors else part
    return first


def page_text(
    title: str, sections: Iterable[str], kind: str = "", more: str = "", fold: Collection[str] = (), grade: str = ""
) -> str:
    """The page itself. kind: of report, above the title. more: markup for its head. fold: anchors of the sections that only a
    specialist reads, which open at a click. grade: of the loop at rest, for programs.
    """
    body = "\n".join(sections)
    places, body = HEADINGS.findall(body), fold_sections(body, fold)
    contents = "".join(f'<a href="#{anchor}">{text}</a>' for anchor, text in places)
    contents = f'<nav class="contents" aria-label="Contents">{contents}</nav>' if len(places) >= FEWEST_HEADINGS else ""
    viewport = '<meta name="viewport" content="width=device-width, initial-scale=1">'
    made_by = f"quadstep {__version__}"
    on_paper = f'@page {{ font: 8pt Inter, sans-serif; color: #444; @bottom-left {{ content: "{made_by}"; }} }}'
    head = f'<meta charset="utf-8">{viewport}<title>{own(title)}</title>{more}'
    head += f'<meta name="grade" content="{escape(grade)}">' * bool(grade)
    formulas = face(FORMULAS) if "<math" in body else ""
    above = f'<div class="top">{LOGO}<span>{escape(f"quadstep · {kind}" if kind else "quadstep")}</span></div>'
    page = (
        f'<!doctype html>\n<html lang="en"><head>{head}<style>{face(TEXT)}{formulas}{style()}{on_paper}</style></head>\n'
        f"<body><header>{above}<h1>{own(title)}</h1></header>\n{contents}<main>\n{body}\n</main>\n"
        f'<footer class="colophon">{made_by}</footer>{script(body)}</body></html>\n'
    )
    return QUOTES.sub(lambda one: one[0] if one[0][0] == "<" else "’" if one["said"] is None else f"‘{one['said']}’", page)

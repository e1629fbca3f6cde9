"""A report as one HTML file that opens offline: headings, tables and inline SVG, every text escaped."""

from collections.abc import Callable, Iterable, Sequence
from html import escape
from pathlib import Path

STYLE = """
:root { color-scheme: light dark; --line: #8884; --soft: #8881; }
body { font: 16px/1.5 system-ui, sans-serif; max-width: 62rem; margin: 2rem auto; padding: 0 1rem; }
h1 { line-height: 1.2; } h2 { margin-top: 2.5rem; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; font-size: .88rem; margin: 1rem 0; }
th, td { text-align: left; vertical-align: top; padding: .3rem .7rem; border-bottom: 1px solid var(--line); }
thead th { position: sticky; top: 0; background: Canvas; } tbody tr:hover { background: var(--soft); }
figure { margin: 1.5rem 0; } figure svg { width: 100%; height: auto; background: #fff; border-radius: 4px; }
.holds { font-weight: 700; } .holds::before { content: "\\2713\\00a0"; }
.fails { font-weight: 700; } .fails::before { content: "\\2717\\00a0"; } .open::before { content: "?\\00a0"; }
nav a { margin-right: 1rem; }
"""

Cell = str | tuple[str, str]
"""A table cell: its text, or its text and a class."""


def heading(text: str, anchor: str) -> str:
    """A section heading."""
    return f'<h2 id="{escape(anchor)}">{escape(text)}</h2>'


def paragraph(text: str, set_as: Callable[[str], str] = escape) -> str:
    """A paragraph of plain text. set_as: `quadstep.report.symbols.rich` where its names are symbols."""
    return f"<p>{set_as(text)}</p>"


def listing(lines: Iterable[str]) -> str:
    """A list of sentences."""
    return f"<ul>{''.join(f'<li>{escape(line)}</li>' for line in lines)}</ul>"


def links(places: Iterable[tuple[str, str]]) -> str:
    """A list of links: address and text of each."""
    items = (f'<li><a href="{escape(place)}">{escape(text)}</a></li>' for place, text in places)
    return f"<ul>{''.join(items)}</ul>"


def table(header: Sequence[str], rows: Iterable[Sequence[Cell]], set_as: Callable[[str], str] = escape) -> str:
    """A table of plain text, its names set as `paragraph` does."""

    def cell(content: Cell) -> str:
        text, kind = content if isinstance(content, tuple) else (content, "")
        return f'<td class="{escape(kind)}">{set_as(text)}</td>' if kind else f"<td>{set_as(text)}</td>"

    head = "".join(f"<th>{set_as(name)}</th>" for name in header)
    body = "".join(f"<tr>{''.join(cell(content) for content in row)}</tr>\n" for row in rows)
    return f'<div class="scroll"><table><thead><tr>{head}</tr></thead><tbody>\n{body}</tbody></table></div>'


def figure(path: Path, caption: str) -> str:
    """An SVG file drawn inline. Its ids get the file's name in front, so that several can stand on one page."""
    text = path.read_text(encoding="utf-8")
    drawing = text[text.index("<svg") :]
    prefix = path.stem
    for mark in ('id="', 'href="#', "url(#"):
        drawing = drawing.replace(mark, f"{mark}{prefix}-")
    return f'<figure role="img" aria-label="{escape(caption)}">{drawing}</figure>'


def page_text(title: str, sections: Iterable[str]) -> str:
    """The page itself."""
    viewport = '<meta name="viewport" content="width=device-width, initial-scale=1">'
    head = f'<meta charset="utf-8">{viewport}<title>{escape(title)}</title>'
    body = "\n".join(sections)
    return (
        f'<!doctype html>\n<html lang="en"><head>{head}<style>{STYLE}</style></head>\n'
        f"<body><h1>{escape(title)}</h1>\n{body}\n</body></html>\n"
    )


def write_page(path: Path, title: str, sections: Iterable[str]) -> None:
    """Write the page."""
    path.write_text(page_text(title, sections), encoding="utf-8")

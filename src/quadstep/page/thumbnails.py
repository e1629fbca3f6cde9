"""Pictures for cards: of a flight the path flown over the path asked for, of one or two; of a study a panel of a figure."""

import io
import json
import os
import re
from html import escape, unescape
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from quadstep.io.files import LONGEST_LINE
from quadstep.report import colours
from quadstep.report.markup import TEXT, face
from quadstep.report.units import number

ROWS = 240
"""Of a log that are drawn."""

WIDE, HIGH, MARGIN, CAPTION = 300.0, 150.0, 14.0, 12.0
FLAT = 0.3
"""Height over width of a path below which it is seen from above."""

COLOURS = "blue", "orange"
"""Of the paths flown; the second is dashed."""

LARGEST = 1e15
"""Of a number that is drawn."""


def thumbnail(*flights: tuple[io.BufferedReader, bool]) -> str:
    """An SVG of a flight's log, or of two over the path that both were asked for.

    flights: a flight.csv and whether it was lost, which is marked. Raises ValueError for a log without a path.
    """
    logs = [path_rows(log) for log, _ in flights]
    extent = np.ptp(logs[0][:, :3], axis=0)
    wider = int(extent[1] > extent[0])
    across, up = (0, 1) if extent[2] < FLAT * extent[wider] else (wider, 2)  # from above; from the side if it is not flat
    paths = [rows[:, [across, up]] for rows in logs] + [logs[0][:, [3 + across, 3 + up]]]
    low = np.min([path.min(axis=0) for path in paths], axis=0)
    span = np.max([path.max(axis=0) for path in paths], axis=0) - low
    size = float(min((np.array([WIDE, HIGH - CAPTION]) - 2.0 * MARGIN) / np.maximum(span, 1e-9)))
    *flown, asked = [(path - low - 0.5 * span) * [size, -size] + [0.5 * WIDE, 0.5 * (HIGH - CAPTION)] for path in paths]
    lines = [line(asked, f'stroke="var(--{COLOURS[0] if len(flights) == 1 else "muted"})" stroke-width="5" opacity="0.26"')]
    for path, (_, lost), colour in zip(flown, flights, COLOURS, strict=False):  # the first shows between the second's dashes
        dashes = 'stroke-dasharray="5 4" ' * (colour != COLOURS[0])
        x, y = path[-1]
        end = f"M{x - 6:.1f} {y - 6:.1f}l12 12m0-12l-12 12" if lost else f"M{x:.1f} {y:.1f}h0"
        stroke = 'stroke="var(--bad)" stroke-width="3"' if lost else f'stroke="var(--{colour})" stroke-width="6"'
        lines += [line(path, f'stroke="var(--{colour})" {dashes}stroke-width="1.6"'), f'<path d="{end}" {stroke}/>']
    letters = 12 if len(flights) == 1 else 9  # two are drawn larger, beside the page's text
    wide, high = (f"{short(size)} m in {'xyz'[axis]}" for size, axis in zip(span, (across, up), strict=True))
    said = f"from {'above' if up == 1 else 'the side'}: {wide}, {high}"
    caption = f'<text x="{WIDE - 4:g}" y="{HIGH - 5:g}" text-anchor="end" {written(letters)}>{said}</text>'
    return stamped(f'<g fill="none" stroke-linecap="round" stroke-linejoin="round">{"".join(lines)}</g>{caption}')


def stamped(content: str) -> str:
    """Markup as an SVG of the size of a card's picture, with the typeface of the page around it."""
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" viewBox="0 0 {WIDE:g} {HIGH:g}">'
    )
    return f"{head}<style>{colours.STYLE}{PLOT}{face(TEXT)}</style>{content}</svg>"


def written(letters: int) -> str:
    """Attributes of text [px]."""
    return f'font-family="{TEXT}, sans-serif" font-size="{letters}" fill="var(--muted)"'


PLOT = (
    ".plot text, .plot [id^=legend], .plot [id^=xtick], .plot [id^=ytick] { display: none } "
    ".plot path { vector-effect: non-scaling-stroke }"
)
"""Of a panel: its letters and ticks, which are too small, are left out; lines keep their width however it is stretched."""

AXES, BODY = re.compile('<svg data-axes="([^"]*)"'), re.compile(r"<svg [^>]*>(.*)</svg>", re.DOTALL)
LARGEST_FIGURE, TOP = 4_000_000, 24.0


def first_panel(figure: io.BufferedReader) -> str:
    """The first panel of a figure of ours, an SVG, as large as the card, its axes named in letters that can be read; another's
    as it is. Raises ValueError for a file that is too large.
    """
    with figure:
        text = figure.read(LARGEST_FIGURE + 1).decode("utf-8", "replace")
    if len(text) > LARGEST_FIGURE:
        raise ValueError("too large")
    try:
        one = json.loads(unescape(AXES.search(text)[1]))[0]  # type: ignore[index]
        body = colours.themed(BODY.search(text)[1])  # type: ignore[index]
        box = " ".join(f"{float(number):.2f}" for number in one["box"])
        below, above = (
            escape(f"{re.sub('[{}]', '', label)}, {' to '.join(map(short, axis.get('data', ())))}".rstrip(", "))
            for label, axis in ((one["across"], one["x"]), (one["up"], one["y"]))
        )
    except (AttributeError, TypeError, ValueError, KeyError, IndexError, RecursionError):
        return text
    return stamped(
        f'<svg class="plot" x="10" y="{TOP:g}" width="{WIDE - 20.0:g}" height="{HIGH - TOP - 22.0:g}" viewBox="{box}" '
        f'preserveAspectRatio="none">{body}</svg><text x="10" y="18" {written(12)}>{above}</text>'
        f'<text x="{WIDE - 10:g}" y="{HIGH - 6:g}" text-anchor="end" {written(12)}>{below}</text>'
    )


def short(value: float) -> str:
    return number(value, 2) if 0.0 < abs(value) < 1e-4 else f"{float(f'{value:.2g}'):,g}".replace("-", "−")


def line(points: NDArray[np.float64], style: str) -> str:
    """A path through points, those left out that lie where the one before does."""
    texts = [f"{x:.1f} {y:.1f}" for x, y in points]
    moved = [texts[0], *(one for before, one in pairwise(texts) if one != before)]
    return f'<path d="M{"L".join(moved)}" {style}/>'


def path_rows(log: io.BufferedReader) -> NDArray[np.float64]:
    """(n, 6): position flown and asked for in a log's first row, its last, and some between. Raises ValueError for no rows."""
    columns = [name.partition(b"[")[0] for name in log.readline(LONGEST_LINE).strip().split(b",")]
    wanted = [columns.index(name) for name in (b"x", b"y", b"z", b"x_d", b"y_d", b"z_d")]
    first, last = log.tell(), os.fstat(log.fileno()).st_size
    texts = [log.readline(LONGEST_LINE)]
    for place in range(1, ROWS):
        log.seek(first + (last - first) * place // ROWS)
        log.readline(LONGEST_LINE)  # the rest of a row
        texts.append(log.readline(LONGEST_LINE))
    log.seek(max(first, last - LONGEST_LINE))
    texts += log.read(LONGEST_LINE).splitlines()[-1:]
    cells = [text.split(b",") for text in texts]
    rows = np.array([[float(one[place]) for place in wanted] for one in cells if len(one) == len(columns)]).reshape(-1, 6)
    rows = rows[np.all(np.abs(rows) < LARGEST, axis=1)]
    if not len(rows):
        raise ValueError("no row can be drawn")
    return rows

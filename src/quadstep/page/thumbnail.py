"""A flight in a picture of the size of a stamp: its path, and where it was lost; from a few rows of its log."""

import io
import os
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from quadstep.io.files import LONGEST_LINE

ROWS = 240
"""Of a log that are drawn."""

WIDE, HIGH, MARGIN = 300.0, 150.0, 14.0
FLAT = 0.3
"""Height over width of a path below which it is seen from above."""

STYLES = 'stroke="#111"', 'stroke="#c22" stroke-dasharray="4 3"'
"""Of the path as flown, and as desired."""

LARGEST = 1e15
"""Of a number that is drawn."""


def thumbnail(log: io.BufferedReader, lost: bool) -> str:
    """An SVG of a flight.csv. lost: whether it ended so, which is marked. Raises ValueError for a log without a path."""
    columns = [name.partition(b"[")[0] for name in log.readline(LONGEST_LINE).strip().split(b",")]
    rows = sampled(log, [columns.index(name) for name in (b"x", b"y", b"z", b"x_d", b"y_d", b"z_d")], len(columns))
    across, up = seen_from(rows[:, :3])
    flown, desired = rows[:, [across, up]], rows[:, [3 + across, 3 + up]]
    low = np.minimum(flown.min(axis=0), desired.min(axis=0))
    span = np.maximum(flown.max(axis=0), desired.max(axis=0)) - low
    size = float(min((np.array([WIDE, HIGH]) - 2.0 * MARGIN) / np.maximum(span, 1e-9)))
    drawn = [(one - low - 0.5 * span) * [size, -size] + [0.5 * WIDE, 0.5 * HIGH] for one in (flown, desired)]
    lines = [line(one, style) for one, style in zip(drawn, STYLES, strict=True)]
    x, y = drawn[0][-1]
    end = f"M{x - 6:.1f} {y - 6:.1f}l12 12m0-12l-12 12" if lost else f"M{x:.1f} {y:.1f}h0"
    stroke = 'stroke="#c22" stroke-width="3"' if lost else 'stroke="#111" stroke-width="6"'
    said = f"{'xyz'[across]} {span[0]:.2g} m, {'xyz'[up]} {span[1]:.2g} m"
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDE:g} {HIGH:g}" fill="none" stroke-linecap="round" '
        f'stroke-linejoin="round">{"".join(lines)}<path d="{end}" {stroke}/>'
        f'<text x="{WIDE - 4:g}" y="{HIGH - 5:g}" text-anchor="end" font-family="sans-serif" font-size="11" fill="#666">{said}'
        "</text></svg>"
    )


def line(points: NDArray[np.float64], style: str) -> str:
    """A path through points, those left out that lie where the one before does."""
    texts = [f"{x:.1f} {y:.1f}" for x, y in points]
    moved = [texts[0], *(one for before, one in pairwise(texts) if one != before)]
    return f'<path d="M{"L".join(moved)}" stroke-width="1.6" {style}/>'


def seen_from(flown: NDArray[np.float64]) -> tuple[int, int]:
    """The axes to the right and upwards: x and y, or the wider of the two and z where the path is not flat."""
    span = np.ptp(flown, axis=0)
    wider = int(span[1] > span[0])
    return (0, 1) if span[2] < FLAT * span[wider] else (wider, 2)


def sampled(log: io.BufferedReader, wanted: list[int], width: int) -> NDArray[np.float64]:
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

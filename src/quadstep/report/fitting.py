"""What fits: points of a line, and titles and labels of a figure of a given width, broken where they are longer than that."""

import re
from collections.abc import Sequence

import numpy as np
from matplotlib import rcParams
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.text import Text
from numpy.typing import NDArray

Numbers = NDArray[np.float64]

WORD = re.compile(r"[\d.]+ %\S*|\S*\[[^\]]*\]\S*|(?:\$[^$]*\$|\S)+")
"""What stays together: a share, a unit in its brackets, a symbol, a word."""

COMMAND = re.compile(r"\\[a-z]+|[{}$_^]")
"""Of mathtext, what is no letter."""

LETTER = 0.55
"""Width of a letter over the size of its font, on average."""

BESIDE = 1.25
"""A label beside an axis may be so many times as long: axes above one another have some room between them."""

SIDES, MARK, SPACE = 1.05, 4.4, 1.2
"""What stands beside axes [in], above which a legend is; what a name in it needs besides, and what of this the last one does
not need, in sizes of the font.
"""


BUCKETS = 400
"""The fewest stretches of a line, each drawn by its lowest and highest point; more cannot be seen, no peak is lost."""


def thin(t: Numbers, values: Numbers, log: bool = False) -> tuple[Numbers, Numbers]:
    """The line with fewer points: first, last, and the extremes of each bucket, in order. log: buckets grow like t does."""
    last = len(values) - 1
    size = len(values) // BUCKETS
    if size < 3:
        return t[: len(values)], values
    if log:
        starts = np.unique(np.geomspace(1, last, BUCKETS).astype(int)) - 1
        pieces = list(zip(starts, [*starts[1:], last], strict=True))
        found = [a + np.array([values[a:b].argmin(), values[a:b].argmax()]) for a, b in pieces]
        kept = np.unique(np.concatenate([[0], *found, [last]]))
        return t[kept], values[kept]
    buckets = np.pad(values, (0, -len(values) % size), mode="edge").reshape(-1, size)
    starts = size * np.arange(len(buckets))
    kept = np.concatenate([[0], starts + buckets.argmin(axis=1), starts + buckets.argmax(axis=1), [last]])
    kept = np.unique(np.minimum(kept, last))
    return t[kept], values[kept]


def wrapped(text: str, room: float, size: float) -> str:
    """The text in lines that fit into `room` [in]. size: of the font [pt]."""
    most, lines = max(1.0, 72.0 * room / (LETTER * size)), [""]
    for word in WORD.findall(text):
        longer = f"{lines[-1]} {word}".strip()
        if lines[-1] and letters(longer) > most:
            lines.append(word)
        else:
            lines[-1] = longer
    return "\n".join(lines)


def letters(text: str) -> int:
    """How many are seen."""
    return len(COMMAND.sub("", text.replace(r"\mathrm", "")))


def fit(figure: Figure) -> None:
    """Break the labels of axes, and their titles, that are longer than the axes."""
    figure.draw_without_rendering()  # which lays it out
    for axes in figure.axes:
        box = axes.get_window_extent()
        for text in (axes.yaxis.label, axes.xaxis.label, *titles(axes.get_children())):
            room = (BESIDE * box.height if text is axes.yaxis.label else box.width) / figure.dpi
            text.set_text(wrapped(text.get_text(), room, float(text.get_fontsize())) if text.get_text() else "")


def beside(wide: float, names: Sequence[str], most: int) -> int:
    """How many of a legend's names fit beside one another above the axes of a figure so wide [in]."""
    room = 72.0 * (wide - SIDES) / FontProperties(size=rcParams["legend.fontsize"]).get_size_in_points()
    for count in range(min(most, len(names)), 1, -1):
        columns = np.array_split([letters(name) for name in names], count)
        if sum(LETTER * int(column.max()) + MARK for column in columns) - SPACE <= room:
            return count
    return 1


def titles(artists: Sequence[object]) -> list[Text]:
    """The texts among an axes' own parts that stand above it."""
    return [one for one in artists if isinstance(one, Text) and one.get_position()[1] >= 1.0]

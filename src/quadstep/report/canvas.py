"""The style that all figures share, their files, and what fits: points of a line, and titles and labels broken where they are
longer than the figure is wide.
"""

import io
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal

import numpy as np
from matplotlib import rc_context, rcParams
from matplotlib.backend_bases import RendererBase
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties, fontManager
from matplotlib.text import Text
from numpy.typing import NDArray

from quadstep.report.axes import typeset_decades
from quadstep.report.colours import CURVES
from quadstep.report.markup import FOR_FIGURES, TEXT
from quadstep.report.sheet import Sheet
from quadstep.report.told import described_svg, mark

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
        above = [one for one in axes.get_children() if isinstance(one, Text) and one.get_position()[1] >= 1.0]
        for text in (axes.yaxis.label, axes.xaxis.label, *above):
            room = (BESIDE * box.height if text is axes.yaxis.label else box.width) / figure.dpi
            text.set_text(wrapped(text.get_text(), room, float(text.get_fontsize())) if text.get_text() else "")


def legend_columns(wide: float, names: Sequence[str], most: int) -> int:
    """How many of a legend's names fit beside one another above the axes of a figure so wide [in]."""
    room = 72.0 * (wide - SIDES) / FontProperties(size=rcParams["legend.fontsize"]).get_size_in_points()
    for count in range(min(most, len(names)), 1, -1):
        columns = np.array_split([letters(name) for name in names], count)
        if sum(LETTER * int(column.max()) + MARK for column in columns) - SPACE <= room:
            return count
    return 1


fontManager.addfont(FOR_FIGURES)

STYLE: dict[str, object] = {
    "font.family": [TEXT, "DejaVu Sans"],  # the second for signs that the first lacks
    "mathtext.fontset": "custom",
    **{f"mathtext.{kind}": TEXT for kind in ("rm", "it", "bf", "bfit", "sf", "tt", "cal")},
    "mathtext.default": "regular",
    "mathtext.fallback": "stixsans",
    "font.size": 9,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "0.88",
    "grid.linewidth": 0.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.formatter.useoffset": False,
    "axes.unicode_minus": True,
    "legend.frameon": False,
    "axes.titlesize": "medium",
    "axes.titlelocation": "left",
    "legend.fontsize": 8.5,  # 11 pixels on a screen; nothing in a figure is smaller
    "text.parse_math": False,
    "svg.fonttype": "none",
    "svg.hashsalt": "quadstep",
    "pdf.fonttype": 42,
    "path.simplify": True,
    "path.simplify_threshold": 0.3,
}

LINES: tuple[dict[str, Any], ...] = (
    {"color": CURVES[0], "linestyle": "-", "linewidth": 1.3},
    {"color": CURVES[1], "linestyle": "--", "linewidth": 1.4},
    {"color": CURVES[2], "linestyle": ":", "linewidth": 1.8},
    {"color": CURVES[3], "linestyle": "-.", "linewidth": 1.3},
)
"""Told apart by dashes alone; colour only helps."""

PALE = {**LINES[0], "color": "0.5", "zorder": 1.9}
"""What goes on where a line ends, and is below it before."""

BAND = {**LINES[0], "alpha": 0.26, "linewidth": 4.0, "zorder": 1.9, "solid_capstyle": "butt"}
"""What is asked for, below the line of what comes of it, which it would hide."""

PACKED = 3
"""How hard a PNG is packed: three quarters of the usual time for 4 % more bytes."""


class Typeset(Figure):
    """A figure whose symbols keep the typeface that it was made with: Matplotlib asks for it only when it draws."""

    def __init__(
        self, figsize: tuple[float, float], dpi: float | None = None, layout: Literal["constrained"] | None = None
    ) -> None:
        super().__init__(figsize=figsize, dpi=dpi, layout=layout)
        self.type = {name: value for name, value in rcParams.copy().items() if name.startswith("mathtext.")}

    def draw(self, renderer: RendererBase) -> None:
        with rc_context(self.type):
            super().draw(renderer)


@contextmanager
def drawing(sheet: Sheet, more: Mapping[str, object] | None = None) -> Iterator[None]:
    """Matplotlib's settings for a figure. more: settings that this figure needs."""
    settings: Any = {**STYLE, **dict(sheet.settings), **(more or {})}  # its keys are literals to the type checker
    with rc_context(settings):
        yield


def new_figure(sheet: Sheet, size: Sequence[float], *sides: float) -> Figure:
    """A figure of this width and height [in], whose margins and gaps are `sides`, as `subplots_adjust` has them; or one as
    wide as the sheet, and as tall as the last of `size`, laid out by Matplotlib. size: width, height, and that in print if
    it is another.
    """
    width, height, *_ = size
    if sheet.width is not None:
        return Typeset(figsize=(sheet.inches(width), size[-1]), dpi=sheet.dpi, layout="constrained")
    figure = Typeset(figsize=(width, height), dpi=sheet.dpi)
    figure.subplots_adjust(*sides)
    return figure


@contextmanager
def figure_at(
    path: Path, sheet: Sheet, size: Sequence[float], *sides: float, more: Mapping[str, object] | None = None
) -> Iterator[Figure]:
    """A `new_figure` to draw on, written as `path` where the block ends. more: as in `drawing`."""
    with drawing(sheet, more):
        figure = new_figure(sheet, size, *sides)
        yield figure
        write(figure, path, sheet)


def write(figure: Figure, path: Path, sheet: Sheet) -> None:
    """`path` with each of the sheet's endings; the same figure gives the same bytes, whenever it is drawn."""
    for axes in figure.axes:
        typeset_decades(axes)
    if sheet.width is not None:
        fit(figure)
    for ending in sheet.formats:
        figure.set_dpi(sheet.dpi)
        file = path.with_name(f"{path.name}.{ending}")
        canvas: Any  # Matplotlib's canvases have no types
        if ending == "png":
            canvas = FigureCanvasAgg(figure)
            canvas.print_png(file, metadata={"Software": None}, pil_kwargs={"compress_level": PACKED})
        elif ending == "svg":
            mark(figure)
            canvas, text = FigureCanvasSVG(figure), io.StringIO()
            canvas.print_svg(text, metadata={"Date": None, "Creator": None})
            file.write_text(described_svg(text.getvalue(), figure), encoding="utf-8")
        else:
            from matplotlib.backends.backend_pdf import FigureCanvasPdf  # noqa: PLC0415 (a fourth of all that loads)

            canvas = FigureCanvasPdf(figure)
            canvas.print_pdf(file, metadata={"CreationDate": None, "Creator": None, "Producer": None})

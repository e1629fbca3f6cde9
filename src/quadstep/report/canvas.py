"""The style that all figures share, and their files."""

import io
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal

from matplotlib import rc_context, rcParams
from matplotlib.backend_bases import RendererBase
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.font_manager import fontManager

from quadstep.report.axes import typeset_decades
from quadstep.report.fitting import fit
from quadstep.report.readable import mark, told
from quadstep.report.sheet import Sheet
from quadstep.report.typeface import FOR_FIGURES, TEXT

fontManager.addfont(FOR_FIGURES)

STYLE: dict[str, object] = {
    "font.family": [TEXT, "DejaVu Sans"],  # the second for signs that the first lacks
    "mathtext.fontset": "custom",
    **{f"mathtext.{kind}": TEXT for kind in ("rm", "it", "bf", "bfit", "sf", "tt", "cal")},
    "mathtext.default": "regular",
    "mathtext.fallback": "stixsans",
    "font.size": 9,
    "axes.grid": True,
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
    {"color": "black", "linestyle": "-", "linewidth": 1.2},
    {"color": "#b2182b", "linestyle": "--", "linewidth": 1.4},
    {"color": "#2166ac", "linestyle": "-.", "linewidth": 1.3},
    {"color": "0.45", "linestyle": ":", "linewidth": 1.8},
)
"""Told apart by dashes alone; colour only helps."""


BAND = {**LINES[0], "color": "#efb4ae", "linestyle": "-", "linewidth": 3.6, "zorder": 1.9, "solid_capstyle": "butt"}
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


def new_figure(sheet: Sheet, width: float, height: float, in_print: float | None = None) -> Figure:
    """A figure of this size [in], or as wide as the sheet and `in_print` tall, laid out by Matplotlib."""
    if sheet.width is None:
        return Typeset(figsize=(width, height), dpi=sheet.dpi)
    return Typeset(figsize=(sheet.inches(width), in_print or height), dpi=sheet.dpi, layout="constrained")


def margins(figure: Figure, sheet: Sheet, *sides: float) -> None:
    """left, bottom, right, top, between columns, between rows: as `subplots_adjust` has them, of a figure of its own size."""
    if sheet.width is None:
        figure.subplots_adjust(*sides)


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
            file.write_text(told(text.getvalue(), figure), encoding="utf-8")
        else:
            from matplotlib.backends.backend_pdf import FigureCanvasPdf  # noqa: PLC0415 (a fourth of all that loads)

            canvas = FigureCanvasPdf(figure)
            canvas.print_pdf(file, metadata={"CreationDate": None, "Creator": None, "Producer": None})

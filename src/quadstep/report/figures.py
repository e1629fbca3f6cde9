"""Figures that read in black and white: one style, panels stacked over time."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from quadstep.report.panel import Panel

STYLE: Any = {
    "font.family": "sans-serif",
    "font.size": 9,
    "axes.grid": True,
    "grid.color": "0.88",
    "grid.linewidth": 0.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.formatter.limits": (-3, 4),
    "legend.frameon": False,
    "legend.fontsize": 8,
    "text.parse_math": False,
    "svg.fonttype": "none",
    "svg.hashsalt": "quadstep",
    "path.simplify": True,
    "path.simplify_threshold": 0.3,
}

LINES = (
    {"color": "black", "linestyle": "-", "linewidth": 1.2},
    {"color": "#b2182b", "linestyle": "--", "linewidth": 1.4},
    {"color": "#2166ac", "linestyle": "-.", "linewidth": 1.3},
    {"color": "0.45", "linestyle": ":", "linewidth": 1.8},
)
"""Told apart by dashes alone; colour only helps."""

BUCKETS = 400
"""At least so many stretches of a line, each drawn by its lowest and highest point; more cannot be seen, no peak is lost."""


def prefixed(unit: str, largest: float) -> tuple[str, float]:
    """A unit that suits values up to `largest`, and the factor to it: 3e-5 m reads as 30 um."""
    if unit in ("-", "m/s, rad/s") or largest == 0.0:
        return unit, 1.0
    for prefix, factor in (("", 1.0), ("m", 1e3), ("u", 1e6)):
        if largest * factor >= 0.05:
            return prefix + unit, factor
    return "n" + unit, 1e9


def thin(t: NDArray[np.float64], values: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The line with fewer points: first, last, and the extremes of each bucket, in order."""
    size = len(values) // BUCKETS
    if size < 3:
        return t[: len(values)], values
    last = len(values) - 1
    buckets = np.pad(values, (0, -len(values) % size), mode="edge").reshape(-1, size)
    starts = size * np.arange(len(buckets))
    kept = np.concatenate([[0], starts + buckets.argmin(axis=1), starts + buckets.argmax(axis=1), [last]])
    kept = np.unique(np.minimum(kept, last))
    return t[kept], values[kept]


def draw(axes: Axes, t: NDArray[np.float64], panel: Panel) -> None:
    """Fill one set of axes; entries may be shorter than t (a flight that ended early)."""
    largest = max((float(np.abs(values).max()) for values in panel.lines.values() if len(values)), default=0.0)
    unit, factor = prefixed(panel.unit, largest)
    for style, (name, values) in zip(LINES * 2, panel.lines.items(), strict=False):
        axes.plot(*thin(t, factor * values), label=name, **style)  # type: ignore[arg-type]
    axes.set_ylabel(f"{panel.label} [{unit}]")
    axes.yaxis.set_major_locator(MaxNLocator(4))
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.1, ncols=4, handlelength=2.6)  # above the lines


def save(path: Path, title: str, t: NDArray[np.float64], panels: Sequence[Panel], columns: int = 1) -> None:
    """Write `path`.png and `path`.svg: panels over a shared time axis, filled column by column.

    Margins are set in inches and the canvases print directly: automatic layout would draw each picture four times.
    """
    rows = -(-len(panels) // columns)
    width, height = 3.2 + 3.6 * columns, 0.8 + 1.6 * rows
    with rc_context(STYLE):
        figure = Figure(figsize=(width, height))
        figure.subplots_adjust(0.85 / width, 0.45 / height, 1.0 - 0.15 / width, 1.0 - 0.55 / height, 0.36, 0.32)
        grid = figure.subplots(rows, columns, sharex=True, squeeze=False)
        for axes, panel in zip(grid.T.flat, panels, strict=False):
            draw(axes, t, panel)
        for axes in grid[-1]:
            axes.set_xlabel("time [s]")
        figure.align_ylabels()
        figure.text(0.15 / width, 1.0 - 0.22 / height, title, fontsize=10)
        figure.set_dpi(130)
        raster: Any = FigureCanvasAgg(figure)
        raster.print_png(path.with_suffix(".png"), metadata={"Software": None})
        drawing: Any = FigureCanvasSVG(figure)
        drawing.print_svg(path.with_suffix(".svg"), metadata={"Date": None, "Creator": None})

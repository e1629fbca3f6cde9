"""A flight in space: its distance from the desired path over time, both paths from above and from the side."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from quadstep.report.axes import STEPS, linear, logarithmic, plain
from quadstep.report.canvas import BAND, LINES, margins, new_figure
from quadstep.report.fitting import thin
from quadstep.report.panel import Track
from quadstep.report.sheet import Sheet
from quadstep.report.units import handy

ROOM = 1.0
"""Margin around the desired path, in sizes of it: a flight that diverges leaves the view, and the path stays visible."""

MOST_POINTS = 2000

DECADES = 20.0
"""Ratio of the largest distance to the usual one above which its axis is logarithmic."""


def arranged(t: NDArray[np.float64], track: Track, sheet: Sheet) -> Figure:
    narrow = sheet.side_by_side(3, 2.2) < 3
    figure = new_figure(sheet, 9.6, 2.9, 3.8 if narrow else 2.6)
    errors, top, side = panels(figure, narrow)
    margins(figure, sheet, 0.075, 0.16, 0.985, 0.9, 0.33)
    seen = track.distance > 0.0
    unit, factor = handy("m", float(track.distance.max()))
    if seen.any() and track.distance.max() > DECADES * np.quantile(track.distance[seen], 0.05):
        errors.plot(*thin(t[seen], factor * track.distance[seen]), **LINES[0])
        logarithmic(errors, [factor * track.distance[track.distance >= 0.5 * np.quantile(track.distance[seen], 0.02)]])
    else:
        errors.plot(*thin(t, factor * track.distance), **LINES[0])
        linear(errors, [factor * track.distance])
        errors.set_ylim(bottom=0.0)
    errors.set_xlabel("time [s]")
    errors.xaxis.set_major_locator(MaxNLocator(5, steps=STEPS))
    errors.xaxis.set_major_formatter(plain())
    errors.set_ylabel(f"distance from the path [{unit}]" if sheet.width is None else f"distance [{unit}]")
    low, high = view(track.wanted, track.flown)
    across = int(np.argmax(np.ptp(track.wanted[:, :2], axis=0)))  # from the side: along the longer of x and y
    for axes, a, b in ((top, 0, 1), (side, across, 2)):
        draw_path(axes, track.wanted[:, [a, b]], track.flown[:, [a, b]])
        axes.set_xlim(low[a], high[a])
        axes.set_ylim(low[b], high[b])
        axes.set_box_aspect(1.0)
        axes.set_xlabel(f"{'xyz'[a]} [m]")
        axes.set_ylabel(f"{'xyz'[b]} [m]")
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_locator(MaxNLocator(5, steps=STEPS))
            axis.set_major_formatter(plain())
    if narrow:
        top.figure.legend(*top.get_legend_handles_labels(), loc="outside upper left", ncols=2)
    else:
        top.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, borderaxespad=0.1)
    return figure


def panels(figure: Figure, narrow: bool) -> tuple[Axes, Axes, Axes]:
    """The axes of the error, the view from above and that from the side; narrow: below the error."""
    if not narrow:
        errors, top, side = figure.subplots(1, 3, width_ratios=(1.5, 1.0, 1.0))
        return errors, top, side
    above, below = figure.subfigures(2, 1, squeeze=False)[:, 0]
    top, side = below.subplots(1, 2)
    return above.subplots(), top, side


def draw_path(axes: Axes, wanted: NDArray[np.float64], flown: NDArray[np.float64]) -> None:
    """One view: the desired path, the flown one, where it began and where it ended."""
    for points, name, style in ((wanted, "desired", BAND), (flown, "flown", LINES[0])):
        axes.plot(*points[:: max(1, len(points) // MOST_POINTS)].T, label=name, **style)
    axes.plot(*flown[0], marker="o", color="black", markerfacecolor="white", markersize=5, linestyle="")
    axes.plot(*flown[-1], marker="x", color="black", markersize=6, linestyle="")


def view(wanted: NDArray[np.float64], flown: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lower and upper corner of the view: a cube around both paths, as far as they are near the desired one."""
    size = max(float(np.ptp(wanted, axis=0).max()), 0.5)
    least, most = wanted.min(axis=0) - ROOM * size, wanted.max(axis=0) + ROOM * size
    both = np.clip(np.concatenate([wanted, flown]), least, most)
    middle, half = 0.5 * (both.min(axis=0) + both.max(axis=0)), 0.54 * max(float(np.ptp(both, axis=0).max()), 1e-3)
    return middle - half, middle + half

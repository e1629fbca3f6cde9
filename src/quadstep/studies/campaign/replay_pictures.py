"""A replayed flight of a campaign as a figure: its error over time, its path from above and from the side."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from quadstep.engines.fly import FlightPlan
from quadstep.interfaces.log import FlightLog
from quadstep.metrics.quantities import position_errors
from quadstep.report.canvas import LINES, drawing, headline, margins, new_figure, write
from quadstep.report.figures import thin
from quadstep.report.sheet import Sheet
from quadstep.studies.campaign.pictures import SCREEN, logarithmic
from quadstep.studies.campaign.varied import spans_decades

MOST_ROWS = 20_000
"""Most rows of a log that is made for a figure."""

ROOM = 1.0
"""Margin around the desired path, in sizes of it: a flight that diverges leaves the view, and the path stays visible."""


def for_a_picture(plan: FlightPlan) -> FlightPlan:
    """The same flight with no more rows than the figure can show."""
    every = max(plan.ticks.log, -(-plan.ticks.last // MOST_ROWS))
    return plan._replace(ticks=plan.ticks._replace(log=every))


def in_space(log: FlightLog, suffix: str = "") -> NDArray[np.float64]:
    """x, y and z, shape (samples, 3); 0 along an axis that the plant does not have."""
    columns = [log.column(f"{axis}{suffix}") if axis in log.columns else np.zeros(len(log.rows)) for axis in "xyz"]
    return np.stack(columns, axis=1)


def draw_flight(path: Path, log: FlightLog, title: str, sheet: Sheet = SCREEN) -> None:
    """The picture; the log has at least two rows."""
    t, distance = log.column("t"), np.linalg.norm(position_errors(log), axis=1)
    wanted, flown = in_space(log, "_d"), in_space(log)
    with drawing(sheet):
        narrow = sheet.side_by_side(3, 2.2) < 3
        figure = new_figure(sheet, 9.6, 3.0, 3.8 if narrow else 2.6)
        errors, top, side = panels(figure, narrow)
        margins(figure, sheet, 0.075, 0.16, 0.985, 0.82, 0.33)
        seen = distance > 0.0
        if seen.any() and spans_decades(float(np.quantile(distance[seen], 0.05)), float(distance.max())):
            errors.plot(*thin(t[seen], distance[seen]), **LINES[0])
            errors.set_ylim(0.5 * float(np.quantile(distance[seen], 0.02)), 1.5 * float(distance.max()))
            logarithmic(errors, "y")
        else:
            errors.plot(*thin(t, distance), **LINES[0])
            errors.set_ylim(bottom=0.0)
        errors.set_xlabel("time [s]")
        errors.set_ylabel("distance from the path [m]" if sheet.width is None else "distance [m]")
        low, high = view(wanted, flown)
        across = int(np.argmax(np.ptp(wanted[:, :2], axis=0)))  # from the side: along the longer of x and y
        for axes, a, b in ((top, 0, 1), (side, across, 2)):
            draw_path(axes, wanted[:, [a, b]], flown[:, [a, b]])
            axes.set_xlim(low[a], high[a])
            axes.set_ylim(low[b], high[b])
            axes.set_box_aspect(1.0)
            axes.set_xlabel(f"{'xyz'[a]} [m]")
            axes.set_ylabel(f"{'xyz'[b]} [m]")
        if narrow:
            top.figure.legend(*top.get_legend_handles_labels(), loc="outside upper left", ncols=2)
        else:
            top.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, borderaxespad=0.1)
        if sheet.titled:
            headline(figure, sheet, (0.01, 0.945), title)
        write(figure, path, sheet)


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
    for points, name, style in ((wanted, "desired", LINES[3]), (flown, "flown", LINES[0])):
        axes.plot(*points[:: max(1, len(points) // 2000)].T, label=name, **style)
    axes.plot(*flown[0], marker="o", color="black", markerfacecolor="white", markersize=5, linestyle="")
    axes.plot(*flown[-1], marker="x", color="black", markersize=6, linestyle="")


def view(wanted: NDArray[np.float64], flown: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lower and upper corner of the view: a cube around both paths, as far as they are near the desired one."""
    size = max(float(np.ptp(wanted, axis=0).max()), 0.5)
    least, most = wanted.min(axis=0) - ROOM * size, wanted.max(axis=0) + ROOM * size
    both = np.clip(np.concatenate([wanted, flown]), least, most)
    middle, half = 0.5 * (both.min(axis=0) + both.max(axis=0)), 0.54 * max(float(np.ptp(both, axis=0).max()), 1e-3)
    return middle - half, middle + half

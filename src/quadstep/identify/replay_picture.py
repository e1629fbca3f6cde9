"""Figures of a replay: errors of predictions over how far ahead they are, deviations of estimates over time."""

from pathlib import Path

import numpy as np

from quadstep.identify.errors import GROUPS
from quadstep.identify.estimator import Deviation, Estimated
from quadstep.identify.logs.flight import Floats
from quadstep.identify.table import ErrorTable
from quadstep.report.axes import logarithmic, plain_decades
from quadstep.report.canvas import LINES, drawing, margins, new_figure, write
from quadstep.report.drawing import FigureJob
from quadstep.report.panel import Panel
from quadstep.report.sheet import Sheet
from quadstep.report.units import handy

UNIT = {"position": "m", "velocity": "m/s", "attitude": "°", "rates": "rad/s"}
"""Units in which errors are drawn and said."""

FACTOR = {"position": 1.0, "velocity": 1.0, "attitude": 180.0 / np.pi, "rates": 1.0}
"""To these units."""


def draw_errors(path: Path, found: ErrorTable, period: float, sheet: Sheet) -> None:
    """Mean errors of the predictions and of the two guesses over the time ahead."""
    ahead = period * np.array(found.horizons)
    columns = sheet.side_by_side(2)
    with drawing(sheet):
        figure = new_figure(sheet, 8.0, 4.6, 1.45 * len(GROUPS) / columns)
        margins(figure, sheet, 0.09, 0.1, 0.98, 0.92, 0.24, 0.2)
        panels = figure.subplots(len(GROUPS) // columns, columns, sharex=True, squeeze=False)
        for group, axes in zip(GROUPS, panels.flat, strict=True):
            rows = np.array([found.means(horizon, group) for horizon in found.horizons]).T * FACTOR[group]
            unit, factor = handy(UNIT[group], float(rows.max()))
            for style, name, row in zip(LINES, ("predicted", "constant", "zero rate"), factor * rows, strict=False):
                axes.plot(ahead, row, label=name, marker="o", markersize=3, **style)
            axes.set_xscale("log")
            logarithmic(axes, list(factor * rows))
            axes.set_ylabel(f"{group} [{unit}]")
            plain_decades(axes.xaxis)
        for axes in panels[-1]:
            axes.set_xlabel("time ahead [s]")
        panels[0, 0].legend(
            loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.1, ncols=3, handlelength=2.2, columnspacing=1.2
        )
        write(figure, path, sheet)


def estimate_picture(one: Estimated, place: int) -> tuple[FigureJob, str]:
    """Errors of the filter and of the log's own estimate over time, and the caption. place: of the flight among the others."""
    several = {"filter": sizes(one.filter_deviation)}
    if one.own_deviation:
        several["estimate in the log"] = sizes(one.own_deviation)
    known = np.logical_and.reduce([np.isfinite(values) for parts in several.values() for values in parts])
    panels = [
        Panel(name, unit, {who: parts[i][known] for who, parts in several.items()})
        for i, (name, unit) in enumerate((("position", "m"), ("velocity", "m/s"), ("tilt", "°"), ("yaw", "°")))
    ]
    return FigureJob(f"estimate{place}", "", one.time[known], panels, 2), f"{one.name}: how far estimates are from the truth"


def sizes(one: Deviation) -> tuple[Floats, ...]:
    """How large each part is [m, m/s, °, °]."""
    lengths = [np.linalg.norm(values, axis=1) for values in (one.position, one.velocity)]
    return (*lengths, np.degrees(one.tilt), np.degrees(np.abs(one.yaw)))

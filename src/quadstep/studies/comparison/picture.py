"""A comparison as pictures: for each vehicle, what every controller does in every situation."""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib import rcParams
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from quadstep.metrics.verdict import RULES
from quadstep.report.axes import plain_decades
from quadstep.report.canvas import drawing, write
from quadstep.report.colours import COLOURS, CURVES
from quadstep.report.sheet import COLUMN, PHONE, Sheet
from quadstep.report.told import ToldPlace, tell
from quadstep.report.units import number, percent
from quadstep.studies.comparison.answer import leaders, median, unit_of
from quadstep.studies.comparison.cells import Situation
from quadstep.studies.comparison.entrants import Comparison, SituationResult
from quadstep.studies.comparison.words import LOST, interval_text, share_lost, situation_caption, title

SHAPES = "osD^v<>ph*"
"""Of marks."""

LARGE = COLOURS["vermillion"]
"""Of the line at which errors begin to be large."""

MANY = 10
"""Controllers."""

A_CONTROLLER, BETWEEN = 0.17, 0.36
"""Height of a controller's line, and between situations, whose names stand there [in]."""


def draw_vehicle(path: Path, results: Comparison, vehicle: str, sheet: Sheet) -> None:
    """A group of rows for each situation, a row for each controller: median with its interval, a line to the 95 % quantile;
    a panel for each of the first metrics. Of more controllers than marks can tell apart, a square for each.
    """
    if len(results.controllers) > MANY:
        draw_heat(path, results, vehicle, sheet)
        return
    situations = [one for one in results.ranked if one.vehicle == vehicle]
    group = A_CONTROLLER * len(results.controllers) + BETWEEN
    with drawing(sheet):
        metrics = list(results.metrics)[: sheet.side_by_side(2)]
        width = sheet.inches(COLUMN if len(metrics) > 1 else PHONE)
        figure = Figure(figsize=(width, 0.9 + group * len(situations)), layout="constrained")
        for axes, metric in zip(figure.subplots(1, len(metrics), squeeze=False)[0], metrics, strict=True):
            draw_panel(axes, results, situations, metric, group)
            axes.set_xlabel(f"{title(results, metric)}{scaled(axes)}")
        write(figure, path, sheet)


def draw_panel(axes: Axes, results: Comparison, situations: Sequence[Situation], metric: str, group: float) -> None:
    """A metric in every situation; a dashed line stands where a position RMSE is a large error, a mark is open where that of
    the median flight is one.
    """
    unit, rows = unit_of(results, metric), {}
    for row, situation in enumerate(situations):
        axes.annotate(
            situation_caption(results, situation), (0.0, A_CONTROLLER - row * group), xycoords=("axes fraction", "data"),
            xytext=(4, 0), textcoords="offset points", va="center",
        )  # fmt: skip
        limit = results.limits.get(situation, math.inf) if metric == "position_rmse" else math.inf
        last = -row * group - A_CONTROLLER * (len(results.controllers) - 0.5)
        if any(limit <= 2.0 * one.spreads[metric].high.value < math.inf for one in results.of(situation)):
            ends = [-row * group + 0.5 * A_CONTROLLER, last]
            axes.plot([unit.factor * limit] * 2, ends, color=LARGE, linestyle="--", linewidth=0.9)
            axes.annotate(
                f"large above {unit.text(limit)}", (unit.factor * limit, last), (3, 0), textcoords="offset points", va="top",
                fontsize=rcParams["legend.fontsize"], color=LARGE,
            )  # fmt: skip
        for one in results.of(situation):
            place = results.controllers.index(one.controller)
            height = -row * group - place * A_CONTROLLER
            rows[height] = one.controller
            best = metric == results.metric and one.controller in leaders(results, situation)
            color = CURVES[0] if best else "0.35"
            large = metric == "position_rmse" and one.grade is not None and RULES[0].label in one.grade.labels
            looks = SHAPES[place % len(SHAPES)], "white" if large else color, color
            draw_result(axes, one, metric, height, unit.factor, looks)
            tell_result(axes, one, results, metric, height)
    axes.set_yticks(list(rows), list(rows.values()))
    axes.tick_params("y", length=0.0)
    axes.set_ylim(-len(situations) * group + 0.5 * BETWEEN, BETWEEN)
    axes.grid(visible=False, axis="y")


def draw_result(
    axes: Axes, one: SituationResult, metric: str, height: float, factor: float, looks: tuple[str, str, str]
) -> None:
    """One controller in one situation; an arrow where its 95 % quantile is lost."""
    size = rcParams["legend.fontsize"]
    median, high = one.spreads[metric].median, one.spreads[metric].high.value
    if not math.isfinite(median.value):
        axes.annotate("lost", (0.995, height), xycoords=("axes fraction", "data"), ha="right", va="center", fontsize=size)
        return
    value, low, top = (factor * part for part in median)
    if math.isfinite(high):
        axes.plot([value, factor * high], [height, height], color="0.65", linewidth=0.8, zorder=1)
    else:
        axes.annotate(
            share_lost(one), (value, height), (12, 0), textcoords="offset points", va="center",
            fontsize=size, arrowprops={"arrowstyle": "<-", "linewidth": 0.6},
        )  # fmt: skip
    shape, face, color = looks
    if math.isfinite(low) and math.isfinite(top):
        axes.plot([low, top], [height, height], color=color, linewidth=1.6, zorder=2)
    axes.plot(value, height, marker=shape, color=color, markerfacecolor=face, markersize=4.5, linestyle="", zorder=3)


def tell_result(axes: Axes, one: SituationResult, results: Comparison, metric: str, height: float) -> None:
    """What a point is, for a report's reader who points at it."""
    spread, factor = one.spreads[metric], unit_of(results, metric).factor
    at, low, high = (factor * part for part in spread.median)
    if math.isfinite(at):
        left, right = (value if math.isfinite(value) else at for value in (low, high))
        said = [
            (title(results, metric), interval_text(spread.median, factor)),
            (results.high, interval_text(spread.high, factor)),
        ]
        said += [("lost", percent(*one.lost))] if one.lost.value else []
        name = f"{one.controller}, {situation_caption(results, one.situation)}"
        tell(axes, ToldPlace(left, right, height, height, name, said))


def scaled(axes: Axes) -> str:
    """A logarithmic axis with plain numbers, where there is anything to be shown; what its label says of that."""
    if not any(np.size(line.get_xdata()) for line in axes.lines):
        return ""
    axes.set_xscale("log")
    plain_decades(axes.xaxis)
    return ", logarithmic scale"


WORST = 20.0
"""Times the best median of a situation, at which colours end."""

DARK = 0.55
"""Of the colours, from which on text is white."""

A_COLUMN, A_ROW = 0.66, 0.32
"""Of squares [in]."""


def draw_heat(path: Path, results: Comparison, vehicle: str, sheet: Sheet) -> None:
    """Controllers, the palest on top; the darker a square, the farther from the best of its situation."""
    situations = [one for one in results.ranked if one.vehicle == vehicle]
    cells = {(one.controller, one.situation): one for one in results.results if one.situation.vehicle == vehicle}
    unit = unit_of(results, results.metric)
    best = [min(median(results, one) for (_, place), one in cells.items() if place == where) for where in situations]
    known = {
        key: min(1.0, math.log(value / best[situations.index(key[1])]) / math.log(WORST))
        for key, one in cells.items()
        if math.isfinite(value := median(results, one))
    }
    names = sorted(
        dict.fromkeys(name for name, _ in cells), key=lambda name: sum(known.get((name, where), 1.0) for where in situations)
    )
    shades = np.array([[known.get((name, where), 1.0) for where in situations] for name in names])
    with drawing(sheet):
        small = rcParams["legend.fontsize"]
        size = (sheet.inches(2.6 + A_COLUMN * len(situations)), 2.6 + A_ROW * len(names))
        figure = Figure(figsize=size, layout="constrained")
        axes = figure.add_subplot()
        axes.imshow(shades, cmap="YlGnBu", vmin=0.0, vmax=1.0, aspect="auto")
        for row, name in enumerate(names):
            for column, where in enumerate(situations):
                if (name, where) in cells:
                    text = square_text(cells[name, where], results.metric, unit.factor)
                    colour = "white" if shades[row, column] > DARK else "black"
                    axes.text(column, row, text, ha="center", va="center", fontsize=small, color=colour, linespacing=0.9)
        axes.set_yticks(range(len(names)), names)
        labels = [situation_caption(results, one) for one in situations]
        axes.set_xticks(range(len(labels)), labels, rotation=40.0, ha="left", rotation_mode="anchor")
        axes.xaxis.tick_top()
        axes.grid(visible=False)
        axes.tick_params(length=0.0)
        axes.set_xlabel(
            f"median {title(results, results.metric)}, and share lost; the palest cell has the smallest median of its "
            f"situation, the darkest {WORST:g} times as much"
        )
        write(figure, path, sheet)


def square_text(one: SituationResult, metric: str, factor: float) -> str:
    value = one.spreads[metric].median.value
    shown = number(factor * value) if math.isfinite(value) else LOST
    return f"{shown}\n{share_lost(one)}" if one.lost.value > 0.0 and shown != LOST else shown

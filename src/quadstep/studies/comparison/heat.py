"""A comparison of many controllers as a picture: a square for each controller and situation, with its median in it."""

import math
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from quadstep.report.canvas import drawing, write
from quadstep.report.sheet import Sheet
from quadstep.studies.comparison.found import Comparison, Result
from quadstep.studies.comparison.words import LOST, below, share_lost, title, unit_of

WORST = 20.0
"""Times the best median of a situation, at which colours end."""

DARK = 0.55
"""Of the colours, from which on text is white."""

A_COLUMN, A_ROW = 0.62, 0.27
"""Of squares [in]."""


def draw_heat(path: Path, found: Comparison, vehicle: str, sheet: Sheet) -> None:
    """Controllers by mean rank, the best on top; the darker a square, the farther from the best of its situation."""
    situations = [one for one in found.situations if one.vehicle == vehicle]
    cells = {(one.controller, one.situation): one for one in found.results if one.situation.vehicle == vehicle}
    names = [name for name in sorted(found.overall(), key=found.overall().__getitem__) if any(name == key[0] for key in cells)]
    unit = unit_of(found.metrics[found.metric])
    best = [min(median(one, found.metric) for (_, place), one in cells.items() if place == where) for where in situations]
    shades = np.ones((len(names), len(situations)))
    for row, name in enumerate(names):
        for column, where in enumerate(situations):
            if (name, where) in cells and math.isfinite(value := median(cells[name, where], found.metric)):
                shades[row, column] = min(1.0, math.log(value / best[column]) / math.log(WORST))
    with drawing(sheet):
        size = (sheet.inches(2.6 + A_COLUMN * len(situations)), 2.6 + A_ROW * len(names))
        figure = Figure(figsize=size, layout="constrained")
        axes = figure.add_subplot()
        axes.imshow(shades, cmap="YlGnBu", vmin=0.0, vmax=1.0, aspect="auto")
        for row, name in enumerate(names):
            for column, where in enumerate(situations):
                if (name, where) in cells:
                    text = said(cells[name, where], found.metric, unit.factor)
                    colour = "white" if shades[row, column] > DARK else "black"
                    axes.text(column, row, text, ha="center", va="center", fontsize=6.5, color=colour, linespacing=0.9)
        axes.set_yticks(range(len(names)), names)
        labels = [below(one) for one in situations]
        axes.set_xticks(range(len(labels)), labels, rotation=40.0, ha="left", rotation_mode="anchor")
        axes.xaxis.tick_top()
        axes.grid(visible=False)
        axes.tick_params(length=0.0)
        axes.set_xlabel(
            f"median {title(found.metrics[found.metric])}, and share lost; the palest cell is the best of its situation, "
            f"the darkest {WORST:g} times as much"
        )
        write(figure, path, sheet)


def median(one: Result, metric: str) -> float:
    """Infinite where it is lost."""
    return one.spreads[metric].median.value


def said(one: Result, metric: str, factor: float) -> str:
    """In a square."""
    value = median(one, metric)
    shown = f"{factor * value:.3g}" if math.isfinite(value) else LOST
    return f"{shown}\n{share_lost(one)}" if one.lost.value > 0.0 and shown != LOST else shown

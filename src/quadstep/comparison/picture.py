"""The comparison as pictures: for each vehicle the RMSE of every scenario and controller, with its interval."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

from quadstep.comparison.cell import Cell
from quadstep.comparison.flights import CONTROLLERS, PUBLISHED, WINDS
from quadstep.report.canvas import drawing, write
from quadstep.report.sheet import Sheet

MARKS = (("o", "black"), ("o", "white"), ("s", "#b2182b"), ("^", "#2166ac"), ("D", "0.55"))
"""Shape and colour of each controller: told apart by shape alone."""

SHORT = {
    "adaptive, nets": "nets", "adaptive, no nets": "no nets", "paper's law": "paper's", "geometric": "geometric", "PID": "PID"
}  # fmt: skip


def draw_vehicle(folder: Path, vehicle: str, cells: Sequence[Cell]) -> None:
    """vehicle.png and vehicle.svg: a row for each scenario, a mark for each controller, and what was lost."""
    scenarios = list(dict.fromkeys(cell.scenario for cell in cells))
    with drawing(Sheet()):
        figure = Figure(figsize=(11.0, 1.2 + 0.42 * len(scenarios)))
        axes: Any = figure.subplots()
        figure.subplots_adjust(0.235, 0.08, 0.8, 0.88)
        for place, (controller, (marker, colour)) in enumerate(zip(CONTROLLERS, MARKS, strict=True)):
            for cell in cells:
                if cell.controller == controller:
                    height = len(scenarios) - 1 - scenarios.index(cell.scenario) + 0.28 - 0.14 * place
                    draw_cell(axes, cell, height, marker, colour)
            axes.plot([], [], linestyle="", marker=marker, color="black", markerfacecolor=colour, label=controller)
        for row, scenario in enumerate(reversed(scenarios)):
            lost = [
                f"{SHORT[cell.controller]} {100 * cell.lost.value:.0f} %"
                for cell in cells
                if cell.scenario == scenario and cell.lost.value > 0.0
            ]
            text = "\n".join(", ".join(lost[i : i + 2]) for i in range(0, len(lost), 2))
            if lost:
                axes.text(1.01, row, f"lost: {text}", va="center", fontsize=7, transform=axes.get_yaxis_transform())
        axes.set_yticks(range(len(scenarios)), scenarios[::-1])
        axes.set_xscale("log")
        plain(axes.xaxis)
        axes.set_xlabel("position RMSE [cm], mean over completed flights, 95 % interval")
        axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=5, columnspacing=1.0, handletextpad=0.2)
        figure.text(0.015, 0.955, vehicle, fontsize=11)
        write(figure, folder / vehicle, Sheet())


def draw_cell(axes: Any, cell: Cell, height: float, marker: str, colour: str) -> None:
    """One mark with its interval."""
    if math.isfinite(cell.rmse.value):
        value, low, high = (100.0 * part for part in cell.rmse)
        if math.isfinite(low):
            axes.plot([low, high], [height, height], color="0.4", linewidth=1.0, zorder=1)
        axes.plot(value, height, marker=marker, color="black", markerfacecolor=colour, markersize=4.5, linestyle="")


def draw_wind(folder: Path, cells: Sequence[Cell]) -> None:
    """wind.png and wind.svg: the vertical figure eight of the 2.6 kg vehicle over the wind, beside published real flights."""
    winds = list(WINDS)
    with drawing(Sheet()):
        figure = Figure(figsize=(8.4, 4.2))
        axes: Any = figure.subplots()
        figure.subplots_adjust(0.09, 0.12, 0.69, 0.93)
        for (name, values), dashes in zip(PUBLISHED.items(), ("-", "--", "-.", ":"), strict=True):
            axes.plot(range(len(winds)), values, color="0.65", linestyle=dashes, linewidth=1.2, label=f"{name} (real flights)")
        for place, (controller, (marker, colour)) in enumerate(zip(CONTROLLERS, MARKS, strict=True)):
            named = {cell.scenario: cell for cell in cells if cell.controller == controller}
            found = [named.get(f"vertical eight, wind {wind}") for wind in winds]
            for i, cell in enumerate(found):
                if cell and math.isfinite(cell.rmse.value):
                    value, low, high = (100.0 * part for part in cell.rmse)
                    at = i + 0.08 * (place - 2)
                    if math.isfinite(low):
                        axes.plot([at, at], [low, high], color="0.3", linewidth=1.0)
                    axes.plot(at, value, marker=marker, color="black", markerfacecolor=colour, markersize=5)
            axes.plot([], [], linestyle="", marker=marker, color="black", markerfacecolor=colour, label=controller)
        axes.set_xticks(range(len(winds)), winds)
        axes.set_yscale("log")
        plain(axes.yaxis)
        axes.set_xlabel("wind [m/s]")
        axes.set_ylabel("position RMSE [cm]")
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
        write(figure, folder / "wind", Sheet())


def plain(axis: Any) -> None:
    """Ticks of a logarithmic axis as plain numbers at 1, 2 and 5."""
    axis.set_major_locator(LogLocator(10.0, (1.0, 2.0, 5.0)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_locator(NullLocator())

"""The picture of a tuning run: the objective and the gains of every candidate over the flights."""

import math
from collections.abc import Mapping
from pathlib import Path

from matplotlib.axes import Axes

from quadstep.mission.fields import label
from quadstep.report import units
from quadstep.report.axes import plain_decades
from quadstep.report.canvas import LINES, figure_at, legend_columns
from quadstep.report.colours import COLOURS
from quadstep.report.sheet import COLUMN, Sheet
from quadstep.report.told import ToldPlace, tell
from quadstep.studies.tuning.gains import TunedGain
from quadstep.studies.tuning.ground import TuningRequest
from quadstep.studies.tuning.search import Candidate, SearchResult

MOST_TOLD = 400
"""Candidates of a kind that a report's reader can point at."""

LEGEND_ROW = 0.18
"""Height of a legend's row [in]."""


def draw_search(path: Path, request: TuningRequest, result: SearchResult, sheet: Sheet) -> None:
    """Write `path` in the sheet's formats."""
    rows, columns = max(3, len(request.gains)), sheet.side_by_side(2)  # rows: of a legend, at most
    height = 2.9 + LEGEND_ROW * rows
    sides = 0.075, 0.48 / height, 0.985, 1.0 - (0.14 + LEGEND_ROW * rows) / height, 0.24
    with figure_at(path, sheet, (COLUMN, height, 4.2), *sides) as figure:
        both = figure.subplots(2 // columns, columns, sharex=True)
        draw_objective(both[0], request, result)
        draw_gains(both[1], request, result)
        for axes in both:
            marks, names = axes.get_legend_handles_labels()
            if marks:
                ncols = legend_columns(figure.get_figwidth() / columns, names, 3)
                legend = axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.1, ncols=ncols)
                for text in legend.get_texts():
                    text.set_parse_math(True)
            axes.set_xlabel("flights" if axes is both[1] or columns > 1 else "")
        figure.align_ylabels()


def draw_objective(axes: Axes, request: TuningRequest, result: SearchResult) -> None:
    """Every candidate's, told apart by whether it completed and kept the constraints, and the best so far."""
    known = [one for one in result.history if math.isfinite(one.judged.objective)]
    kinds = (
        (
            "keeps the constraints so far tested",
            [one for one in known if one.judged.feasible],
            {"marker": ".", "color": "0.55"},
        ),
        (
            "misses a constraint or loses a flight",
            [one for one in known if not one.judged.feasible],
            {"marker": "x", "color": COLOURS["vermillion"], "linewidths": 0.7},
        ),
    )
    for kind, candidates, marks in kinds:
        if candidates:
            places, values = zip(*((one.flights, one.judged.objective) for one in candidates), strict=True)
            axes.scatter(places, values, s=14, label=kind, **marks)
            for one in candidates[:MOST_TOLD]:
                x, y = one.flights, one.judged.objective
                told = [("objective", units.number(y)), *gain_texts(request, one.values).items()]
                tell(axes, ToldPlace(x, x, y, y, kind, told))
    best = [one for one in leaders(result) if math.isfinite(one.judged.objective)]
    if best:
        last = result.history[-1].flights
        axes.step(
            [*(one.flights for one in best), last], [*(one.judged.objective for one in best), best[-1].judged.objective],
            where="post", label="best so far", **LINES[0],
        )  # fmt: skip
    if known and min(one.judged.objective for one in known) > 0.0:
        axes.set_yscale("log")
        plain_decades(axes.yaxis)
    axes.set_ylabel("objective")


def draw_gains(axes: Axes, request: TuningRequest, result: SearchResult) -> None:
    """Those of the best so far, each in its range."""
    best = leaders(result)
    last = result.history[-1].flights
    for place, one in enumerate(request.gains):
        values = [candidate.point[place] for candidate in best]
        style = LINES[place % len(LINES)]
        flights = [*(candidate.flights for candidate in best), last]
        axes.step(flights, [*values, values[-1]], where="post", label=gain_range(request, one), **style)
    axes.set_ylim(-0.03, 1.03)
    axes.set_yticks([0.0, 1.0], ["low", "high"])
    axes.set_ylabel("best gains so far, in their ranges")


def gain_range(request: TuningRequest, one: TunedGain) -> str:
    """A gain, its unit and its range."""
    name, *unit = label(request.mission, one.key).removeprefix("controller ").partition(" [")
    return f"{units.label(name)}{''.join(unit)}: {one.range.low:.4g} to {one.range.high:.4g}"


def leaders(result: SearchResult) -> list[Candidate]:
    """Each candidate that was the best so far."""
    best: list[Candidate] = []
    for one in result.history:
        if one.leads(best[-1] if best else None):
            best.append(one)
    return best


def gain_texts(request: TuningRequest, values: Mapping[str, float]) -> dict[str, str]:
    """Each gain by its name with its unit."""
    return {label(request.mission, one.key): listed([values[leaf.key] for leaf in one.leaves]) for one in request.gains}


def listed(values: list[float]) -> str:
    """Some numbers, or just one where all are equal."""
    return ", ".join(units.number(value, 4) for value in (values if len(set(values)) > 1 else values[:1]))

"""The picture of a tuning run: the objective of every candidate over the flights."""

import math
from collections.abc import Mapping
from pathlib import Path

from matplotlib.axes import Axes

from quadstep.mission.fields import label
from quadstep.report import units
from quadstep.report.axes import plain_decades
from quadstep.report.canvas import LINES, figure_at, legend_columns
from quadstep.report.colours import COLOURS
from quadstep.report.evidence import Figure
from quadstep.report.sheet import PHONE, Sheet
from quadstep.report.told import ToldPlace, tell
from quadstep.studies.tuning.ground import TuningRequest
from quadstep.studies.tuning.objective import Compared
from quadstep.studies.tuning.search import Candidate, SearchResult

MOST_TOLD = 400
"""Candidates of a kind that a report's reader can point at."""

LEGEND_ROWS = 0.54
"""Height of a legend's three rows [in]."""


def draw_search(path: Path, request: TuningRequest, result: SearchResult, compared: Compared, sheet: Sheet) -> Figure:
    """Write `path` in the sheet's formats; gives it with its caption."""
    height = 2.9 + LEGEND_ROWS
    with figure_at(path, sheet, (PHONE, height), 0.14, 0.48 / height, 0.985, 1.0 - (0.14 + LEGEND_ROWS) / height) as figure:
        axes = figure.subplots()
        draw_objective(axes, request, result)
        names = axes.get_legend_handles_labels()[1]
        ncols = legend_columns(figure.get_figwidth(), names, 3)
        axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.1, ncols=ncols)
        axes.set_xlabel("flights")
    missed = any(not one.judged.feasible and math.isfinite(one.judged.objective) for one in result.history)
    return Figure(
        path.name,
        f"The objective of each candidate{'; a cross misses a constraint or loses a flight' * missed}"
        f"{'; most margins are estimates' * bool(compared.limits)}. The lower, the better.",
    )


def draw_objective(axes: Axes, request: TuningRequest, result: SearchResult) -> None:
    """Every candidate's, told apart by whether it completed and kept the constraints, and the best so far."""
    known = [one for one in result.history if math.isfinite(one.judged.objective)]
    good, bad = ([one for one in known if one.judged.feasible is kept] for kept in (True, False))
    cross = {"marker": "x", "color": COLOURS["vermillion"], "linewidths": 0.7}
    kinds = (
        ("keeps the constraints so far tested", good, {"marker": ".", "color": "0.55"}),
        ("misses a constraint or loses a flight", bad, cross),
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

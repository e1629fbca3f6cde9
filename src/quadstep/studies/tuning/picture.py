"""A picture of the search: the objective and the gains of every candidate over the flights."""

import math
from pathlib import Path

from matplotlib.axes import Axes

from quadstep.report.axes import plain_decades
from quadstep.report.canvas import LINES, drawing, margins, new_figure, write
from quadstep.report.fitting import beside
from quadstep.report.sheet import Sheet
from quadstep.studies.tuning.ground import Asked
from quadstep.studies.tuning.search import Candidate, Found


def draw_search(path: Path, asked: Asked, found: Found, sheet: Sheet) -> None:
    """Write `path` in the sheet's formats."""
    with drawing(sheet):
        figure = new_figure(sheet, 7.4, 5.2, 4.2)
        top, bottom = figure.subplots(2, 1, sharex=True)
        margins(figure, sheet, 0.11, 0.09, 0.97, 0.93, 0.2, 0.25)
        draw_objective(top, found)
        draw_gains(bottom, asked, found)
        for axes, most in ((top, 3), (bottom, 4)):
            marks, names = axes.get_legend_handles_labels()
            if marks:
                ncols = beside(figure.get_figwidth(), names, most)
                axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.1, ncols=ncols)
        bottom.set_xlabel("flights")
        figure.align_ylabels()
        write(figure, path, sheet)


def draw_objective(axes: Axes, found: Found) -> None:
    """Every candidate's, told apart by whether it completed and kept the constraints, and the best so far."""
    known = [one for one in found.history if math.isfinite(one.judged.objective)]
    kinds = (
        ("feasible", [one for one in known if one.judged.feasible], {"marker": ".", "color": "0.55"}),
        (
            "a constraint broken or a flight lost",
            [one for one in known if not one.judged.feasible],
            {"marker": "x", "color": "#b2182b", "linewidths": 0.7},
        ),
    )
    for label, candidates, marks in kinds:
        if candidates:
            places, values = zip(*((one.flights, one.judged.objective) for one in candidates), strict=True)
            axes.scatter(places, values, s=14, label=label, **marks)
    best = [one for one in leaders(found) if math.isfinite(one.judged.objective)]
    if best:
        last = found.history[-1].flights
        axes.step(
            [*(one.flights for one in best), last], [*(one.judged.objective for one in best), best[-1].judged.objective],
            where="post", label="best so far", **LINES[0],
        )  # fmt: skip
    if known and min(one.judged.objective for one in known) > 0.0:
        axes.set_yscale("log")
        plain_decades(axes.yaxis)
    axes.set_ylabel("objective")


def draw_gains(axes: Axes, asked: Asked, found: Found) -> None:
    """Those of the best so far, each in its range."""
    best = leaders(found)
    last = found.history[-1].flights
    for place, one in enumerate(asked.gains):
        values = [candidate.point[place] for candidate in best]
        style = LINES[place % len(LINES)]
        flights = [*(candidate.flights for candidate in best), last]
        axes.step(flights, [*values, values[-1]], where="post", label=one.key, **style)
    axes.set_ylim(-0.03, 1.03)
    axes.set_yticks([0.0, 1.0], ["low", "high"])
    axes.set_ylabel("gain of the best so far")


def leaders(found: Found) -> list[Candidate]:
    """Each candidate that was the best so far."""
    best: list[Candidate] = []
    for one in found.history:
        if one.leads(best[-1] if best else None):
            best.append(one)
    return best

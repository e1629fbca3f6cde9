"""The picture of a tuning run: the objective of every candidate over the flights."""

import math
from collections.abc import Mapping
from itertools import product
from pathlib import Path
from typing import Any

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
from quadstep.studies.tuning.search import Candidate, SearchResult
from quadstep.studies.tuning.trial import trial_flights

MOST_TOLD = 400
"""Candidates of a kind that a report's reader can point at."""

KINDS: tuple[tuple[str, bool, bool, dict[str, Any]], ...] = (
    ("keeps the constraints", True, False, {"marker": "o", "s": 5, "color": "0.4"}),
    ("keeps them by a guess of its margins", True, True, {"marker": "o", "s": 9, "facecolors": "none", "edgecolors": "0.4"}),
    *(
        ("misses a constraint or loses a flight", False, guess, {"marker": "x", "s": 14, "color": COLOURS["vermillion"]})
        for guess in (False, True)
    ),
)
"""Of candidates: what is said of it, whether it lost no flight and kept the constraints, by a guess or not, its looks."""

LEGEND_ROW = 0.18
"""Height of a legend's row [in]."""


def draw_search(path: Path, request: TuningRequest, result: SearchResult, sheet: Sheet) -> Figure:
    """Write `path` in the sheet's formats; gives it with its caption."""
    kinds = {(one.judged.feasible, one.judged.feasible and guessed(request, one)) for one in result.history}
    above = LEGEND_ROW * (len(kinds) + 1)
    height = 2.9 + above
    with figure_at(path, sheet, (PHONE, height), 0.14, 0.48 / height, 0.985, 1.0 - (0.14 + above) / height) as figure:
        axes = figure.subplots()
        draw_objective(axes, request, result)
        names = axes.get_legend_handles_labels()[1]
        ncols = legend_columns(figure.get_figwidth(), names, 3)
        axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.1, ncols=ncols)
        axes.set_xlabel("flights")
    first = trial_flights(request.seeds)
    pale = f" Pale: flown on {first} of {units.counted(request.seeds, 'flight')} only." * (first < request.seeds)
    looked = sum(not guessed(request, one) for one in result.history)
    few = f" Margins were computed for {looked:,} of {len(result.history):,} candidates." * bool(request.section.margins)
    missed = any(not one.judged.feasible for one in led(result))
    best = " Where all so far miss a limit or lose flights, the best is the one that does so least." * missed
    ring = "The objective of each candidate; the lower, the better. The ring is the tuned gains."
    return Figure(path.name, ring + best + pale + few)


def guessed(request: TuningRequest, one: Candidate) -> bool:
    """Whether its margins are a guess from those of others."""
    margins, whole = request.section.margins, one.tried.whole
    return bool(margins) and not (whole and all(math.isfinite(whole.parts[name]) for name in margins))


def draw_objective(axes: Axes, request: TuningRequest, result: SearchResult) -> None:
    """Every candidate's, told apart by whether it completed and kept the constraints, paler where it flew only the first
    flights; and the best so far.
    """
    known = [one for one in result.history if math.isfinite(one.judged.objective)]
    first = trial_flights(request.seeds)
    for (kind, kept, guess, looks), some in product(KINDS, (False, True)):
        there = [one for one in known if (one.judged.feasible, guessed(request, one)) == (kept, guess)]
        there = [one for one in there if bool(one.tried.whole or first == request.seeds) is not some]
        if there:
            places, values = zip(*((one.flights, one.judged.objective) for one in there), strict=True)
            named, alpha = None if kind in axes.get_legend_handles_labels()[1] else kind, 0.4 if some else 1.0
            axes.scatter(places, values, label=named, linewidths=0.7, alpha=alpha, **looks)
            said = f"{kind}, in {units.counted(first, 'flight')}" if some else kind
            for one in there[:MOST_TOLD]:
                x, y = one.flights, one.judged.objective
                told = [("objective", units.number(y)), *gain_texts(request, one.values).items()]
                tell(axes, ToldPlace(x, x, y, y, said, told))
    if steps := led(result):
        places, values = zip(*((one.flights, one.judged.objective) for one in steps), strict=True)
        line = {**LINES[0], "marker": "o", "markevery": [len(steps) - 1], "markerfacecolor": "none", "markersize": 7.0}
        axes.step([*places, result.history[-1].flights], [*values, values[-1]], where="post", label="best so far", **line)
    if known and min(one.judged.objective for one in known) > 0.0:
        axes.set_yscale("log")
        plain_decades(axes.yaxis)
    axes.set_ylabel("objective")


def led(result: SearchResult) -> list[Candidate]:
    """The best so far after each generation that found a better one, as far as a flight completed with it."""
    return list({one.flights: one for one in result.led if math.isfinite(one.judged.objective)}.values())


def gain_texts(request: TuningRequest, values: Mapping[str, float]) -> dict[str, str]:
    """Each gain by its name with its unit."""
    return {label(request.mission, one.key): listed([values[leaf.key] for leaf in one.leaves]) for one in request.gains}


def listed(values: list[float]) -> str:
    """Some numbers, or just one where all are equal."""
    return ", ".join(units.number(value, 4) for value in (values if len(set(values)) > 1 else values[:1]))

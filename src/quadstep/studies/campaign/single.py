"""Single flights of a campaign: flown again, as points of a figure that open on a page where they move; and the loop of each
draw at rest where its path begins.
"""

import itertools
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from matplotlib import rcParams
from matplotlib.axes import Axes
from matplotlib.font_manager import FontProperties
from matplotlib.transforms import Bbox
from numpy.typing import NDArray

from quadstep.engines.fly import fly_all
from quadstep.interfaces.log import FlightLog
from quadstep.io.errors import UserError
from quadstep.io.run_record import REPORT
from quadstep.linear.analysis import Analysis, analyse_rest
from quadstep.linear.several import Several, collected
from quadstep.linear.several import write as write_loops
from quadstep.metrics.verdict import FlightGrade
from quadstep.mission.fields import unit, words
from quadstep.page.build import build_page, flown_mission
from quadstep.page.flights import ShownFlight
from quadstep.page.model import Cell, Link
from quadstep.report import units
from quadstep.report.axes import CLEAR
from quadstep.report.canvas import figure_at
from quadstep.report.evidence import Evidence
from quadstep.report.panels import grade_of
from quadstep.report.progress import Progress
from quadstep.report.publish import publishing
from quadstep.report.sheet import PHONE, Sheet
from quadstep.studies.campaign.page import judged
from quadstep.studies.campaign.pictures import LIMIT, LINE, NEAR, PlottedMetric, logarithmic
from quadstep.studies.campaign.schema import Campaign, read_campaign
from quadstep.studies.campaign.single_flight import Replay, replay
from quadstep.studies.campaign.varied import spans_decades, text_of

USUAL = 100
"""Default number of draws."""

AROUND = (1.0, 0.8), (1.0, -0.8), (-1.0, 0.8), (-1.0, -0.8), (0.0, 1.15), (0.0, -1.15), (1.15, 0.0), (-1.15, 0.0)
AWAY = 1.0, 2.5, 4.0, 6.0, 9.0, 12.0
"""Where the number of a flight may stand about its ring, in its own halves, and how far, in the ring's: at the first place
where it hides nothing, with a line to the ring where that is not the nearest.
"""

RING, DOT = 6.5, 3.5
"""Half the width of a ring and the width of a dot [points]."""


def draws(path: Path, count: int | None, folder: Path, overwrite: bool, sheet: Sheet, progress: Progress) -> Evidence:
    """The loops of a campaign's first draws. Raises UserError."""
    campaign = read_campaign(path)
    count = min(campaign.flights, USUAL) if count is None else count
    with publishing(folder, f"linear-draws-{count}-{campaign.fingerprint}", overwrite, named=campaign.named) as out:
        found = collected(((f"flight {flight}", one) for flight, one in of_draws(campaign, count)), progress)
        done = Several(campaign.file.name, "draws", found, [float(flight) for flight in range(count)],
                       campaign.mission.shortfall(campaign.mission.plan(campaign.folder, warn=False)))  # fmt: skip
        return write_loops(out, done, path, sheet)


def of_draws(campaign: Campaign, count: int) -> Iterator[tuple[int, Analysis | str]]:
    """The first draws by the numbers of their flights, and the loop of each, or why there is none."""
    for flight in range(count):
        try:
            found: Analysis | str = analyse_rest(replay(campaign, flight).mission).analysis
        except UserError as error:
            found = str(error)
        yield flight, found


PAGE = "flights.html"

MOST_ROWS = 20_000
"""Most rows of a log that is made for a figure."""

MOST_OTHERS = 7
"""Flights that are flown again beside the worst."""

MOST_POINTS = 1000
"""Flights that are drawn: the first of the campaign, which are as good a sample as any."""


class FlownAgain(NamedTuple):
    """A flight, flown again. reason: why it could not be."""

    replay: Replay | None
    log: FlightLog | None
    reason: str = ""

    @property
    def drawable(self) -> bool:
        """Whether it lasted long enough to be seen."""
        return self.log is not None and len(self.log.rows) > 1


def flown_again(campaign: Campaign, flights: list[int]) -> list[FlownAgain]:
    """These flights with their logs, if they can be replayed."""
    replays: list[Replay | str] = []
    for flight in flights:
        try:
            replays.append(replay(campaign, flight))
        except UserError as error:
            replays.append(str(error))
    ticked = [(one.plan, one.plan.ticks) for one in replays if isinstance(one, Replay)]
    rows = [max(ticks.log, -(-ticks.last // MOST_ROWS)) for _, ticks in ticked]  # no more than the figure can show
    plans = [plan._replace(ticks=ticks._replace(log=every)) for (plan, ticks), every in zip(ticked, rows, strict=True)]
    logs: Iterator[FlightLog] = iter(fly_all(plans))
    return [FlownAgain(one, next(logs)) if isinstance(one, Replay) else FlownAgain(None, None, one) for one in replays]


def lacking(again: Iterable[tuple[int, FlownAgain]]) -> dict[int, tuple[str, ...]]:
    """What those of these flights that reach the end lack of being as commanded, in a word or two each."""
    shown = ((flight, one.replay, one.log) for flight, one in again if one.drawable)
    graded = {flight: grade_of(log, one.mission.flight_metrics(log)[0]) for flight, one, log in shown if one and log}
    return {flight: one.labels for flight, one in graded.items() if one.grade is not FlightGrade.LOST}


def others(rmse: NDArray[np.float64], worst: Collection[int]) -> list[int]:
    """Flights that completed, from the closest to its path to the farthest, evenly spread. rmse: NaN for all others."""
    order = np.argsort(rmse)[: int(np.isfinite(rmse).sum())]
    spread = order[np.linspace(0, len(order) - 1, MOST_OTHERS).round().astype(int)].tolist() if len(order) else []
    return [flight for flight in dict.fromkeys(spread) if flight not in worst]


def write_flights(
    out: Path, campaign: Campaign, again: Mapping[int, FlownAgain], cells: Mapping[int, Cell] = MappingProxyType({}),
    why: Mapping[int, str] = MappingProxyType({}), intro: Sequence[str] = (),
) -> dict[int, str]:  # fmt: skip
    """flights.html, where they move, and the address of each there; none where the package has no front end. cells: the place
    of each where the page has them in a table. why: of each why it is shown. intro: of the page.
    """
    shown: dict[int, ShownFlight] = {}
    for flight, (found, log, _) in again.items():
        if found is not None and log is not None and again[flight].drawable:
            one = judged(flown_mission(found.mission, found.plan, log, campaign.folder), campaign)
            name = one.name.removeprefix(f"{campaign.defaults['name']}, ")  # which all have in common
            drawn = [f"{words(key)} {text_of(value, 3)}{units.unit_suffix(unit(campaign.mission, key) or '-')}"
                     for key, value in found.values.items() if flight not in cells]  # fmt: skip
            note = f"{why.get(flight, '')} Drawn: {', '.join(drawn)}." if drawn else why.get(flight, "")
            group, cell = campaign.file.name, cells.get(flight)
            shown[flight] = one._replace(name=name, id=f"flight-{flight}", group=group, cell=cell, note=note)
    try:
        text = build_page(campaign.file.name, intro, list(shown.values()), links=(Link("Report", REPORT),)) if shown else ""
    except UserError:
        return {}
    if text:
        (out / PAGE).write_text(text, encoding="utf-8")
    return {flight: f"{PAGE}#flight={one.id}" for flight, one in shown.items()}


def draw_points(
    path: Path, metrics: tuple[PlottedMetric, PlottedMetric], lost: NDArray[np.bool_], links: Mapping[int, str], sheet: Sheet
) -> bool:
    """Every flight as a point; those with a ring are links. metrics: `RMSE` and `LARGEST`. Whether there was any to draw."""
    known = np.isfinite(metrics[0].values) & np.isfinite(metrics[1].values)
    seen = known & (np.arange(len(lost)) < MOST_POINTS)
    seen[[flight for flight in links if known[flight]]] = True
    if not seen.any():
        return False
    all_points = {"path.simplify": False}
    with figure_at(path, sheet, (PHONE, 3.8, 4.6), 0.16, 0.13, 0.965, 0.92, more=all_points) as figure:
        axes = figure.subplots()
        x, y = (scaled(axes, which, metric, seen) for which, metric in zip("xy", metrics, strict=True))
        for name, chosen, marker, colour in (("completed", ~lost, "o", "0.6"), ("ended early", lost, "x", LIMIT)):
            if (seen & chosen).any():  # a line without width is what the script of reports reads points off
                at = (x[seen & chosen], y[seen & chosen])
                axes.plot(*at, marker=marker, markersize=DOT, color=colour, linewidth=0.0, label=name)
        axes.autoscale_view()
        marks = dict(zip(*axes.get_legend_handles_labels()[::-1], strict=True))  # one for the limits of both axes
        close = {"columnspacing": 0.8, "handlelength": 1.2, "handletextpad": 0.4, "borderpad": 0.0}
        axes.legend(marks.values(), marks.keys(), loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3, **close)
        dots = axes.transData.transform(np.column_stack((x, y))) * 72.0 / figure.dpi
        rings = {flight: dots[flight] for flight in links if known[flight]}
        left, bottom, right, top = (np.array(axes.bbox.extents) * 72.0 / figure.dpi).tolist()
        size = FontProperties(size=rcParams["legend.fontsize"]).get_size_in_points()
        taken = [Bbox([ring - RING, ring + RING]) for ring in rings.values()]
        for flight, ring in rings.items():
            at, link = (x[flight], y[flight]), links[flight]
            axes.scatter(*at, 130.0, color=[(1.0, 1.0, 1.0, 0.01)], edgecolor=LINE, zorder=3, urls=[link])
            half = np.array([0.32 * size * len(str(flight)), 0.5 * size])
            for far, way in itertools.product(AWAY, AROUND):
                middle = ring + np.array(way) * (far * RING + half)
                box = Bbox([middle - half, middle + half])
                inside = box.x0 >= left and box.x1 <= right and box.y0 >= bottom and box.y1 <= top
                hides = (abs(dots[seen] - middle) < half + 0.5 * DOT).all(axis=1).any()
                crosses = any(one.contains(*at) for one in taken[len(rings) :] for at in np.linspace(ring, middle, 20))
                if inside and not hides and not crosses and not any(box.overlaps(other) for other in taken):
                    taken.append(box)
                    looks: dict[str, Any] = {"ha": "center", "va": "center_baseline", "fontsize": size, "bbox": CLEAR}
                    if far > AWAY[0]:
                        looks["arrowprops"] = {"arrowstyle": "-", "color": LINE, "linewidth": 0.6, "shrinkB": RING}
                    axes.annotate(str(flight), at, (middle - ring).tolist(), textcoords="offset points", url=link, **looks)
                    break  # where no place is free, the ring has to do
    return True


def scaled(axes: Axes, which: str, metric: PlottedMetric, seen: NDArray[np.bool_]) -> NDArray[np.float64]:
    """The numbers of a metric in a unit that suits them, for one axis of the figure, with the limit where it is near."""
    name, unit_of = units.metric(metric.name)
    unit_of, factor = units.handy(unit_of, float(metric.values[seen].max()))
    values: NDArray[np.float64] = factor * metric.values
    label, line = (axes.set_xlabel, axes.axvline) if which == "x" else (axes.set_ylabel, axes.axhline)
    label(f"{name} [{unit_of}]")
    if metric.limit is not None and factor * metric.limit <= NEAR * values[seen].max():
        line(factor * metric.limit, color=LIMIT, linestyle="--", linewidth=1.2, label="limit")
    low, high = float(values[seen].min()), float(values[seen].max())
    if low > 0.0 and spans_decades(low, high):
        margin = (high / low) ** 0.05
        (axes.set_xlim if which == "x" else axes.set_ylim)(low / margin, high * margin)
        logarithmic(axes, which)
    return values

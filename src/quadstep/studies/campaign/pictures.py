"""The figures of a campaign: how its flights ended, how far they were from the path, and what that depends on."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib import rcParams
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, MaxNLocator
from numpy.typing import NDArray

from quadstep.metrics.statistics import Estimate, share
from quadstep.report import units
from quadstep.report.axes import STEPS, plain_decades, powers
from quadstep.report.canvas import LINES, MARK, SIDES, drawing, figure_at, legend_columns, new_figure, wrapped, write
from quadstep.report.colours import COLOURS, CURVES
from quadstep.report.sheet import COLUMN, PHONE, Sheet
from quadstep.studies.campaign.varied import DECADES, Bins, spans_decades

Numbers = NDArray[np.float64]

LINE, LIMIT = CURVES[0], COLOURS["vermillion"]
GREY = ("0.4",)
NEAR, ROOM = 3.0, 0.3
"""Times the largest value, up to which a limit is drawn among the values; share of the width that half of its name takes."""

POINTS = 300
"""Of a curve."""

QUANTILES = (0.1, 0.5, 0.9)

SCREEN = Sheet()


class PlottedMetric(NamedTuple):
    """What is drawn for a metric. values: of completed flights, finite; limit: above it a flight has failed."""

    name: str
    values: Numbers
    limit: float | None


def draw_distributions(path: Path, metrics: Sequence[PlottedMetric], flights: int, sheet: Sheet = SCREEN) -> None:
    """The share of all flights whose metric is larger; those that ended early count as larger."""
    columns = sheet.side_by_side(len(metrics), 2.2)
    rows, width = -(-len(metrics) // columns), COLUMN if columns > 1 else PHONE
    sides = 0.75 / width, 0.2 / rows, 0.985, 1.0 - 0.12 / rows, 0.32, 0.35
    with figure_at(path, sheet, (width, 2.4 * rows, 2.2 * rows), *sides) as figure:
        for place, axes in enumerate(figure.subplots(rows, columns, squeeze=False).ravel()):
            axes.set_visible(place < len(metrics))
            if place < len(metrics):
                draw_metric(axes, metrics[place], flights)


def draw_metric(axes: Axes, metric: PlottedMetric, flights: int) -> None:
    """One panel of `draw_distributions`, in a unit that suits it."""
    words, known = units.metric(metric.name)
    unit, factor = units.handy(known, float(metric.values.max()))
    limit = None if metric.limit is None else factor * metric.limit
    ordered = factor * np.sort(metric.values)
    count, high = len(ordered), float(ordered[-1])
    rank = np.unique(np.concatenate([np.linspace(0, count - 1, POINTS), count - np.geomspace(1, count, POINTS)]).astype(int))
    axes.step(ordered[rank], (flights - rank) / flights, color=LINE, linewidth=1.2, where="post")
    lost = (flights - count) / flights
    axes.set_ylim(0.3 * lost if lost else 0.5 / flights, 1.5)
    axes.set_ylabel("share of flights with more")
    logarithmic(axes, "y")
    if lost:
        axes.axhline(lost, color="0.45", linestyle=":", linewidth=1.6)
        side = "bottom" if lost < 0.3 else "top"
        axes.text(0.01, lost, "ended early", transform=axes.get_yaxis_transform(), va=side)
    if spans_decades(max(float(ordered[0]), float(ordered[count // 1000])), high):
        logarithmic(axes)
    else:
        axes.xaxis.set_major_locator(MaxNLocator(6, steps=STEPS))
    if metric.limit is not None and limit is not None:
        seen = limit <= NEAR * high
        if seen:
            axes.axvline(limit, color=LIMIT, linestyle="--", linewidth=1.4)
        mark_limit(axes, f"limit {units.quantity(metric.limit, known)}", limit, seen)
    axes.set_xlabel(words if unit == "-" else f"{words} [{unit}]")


def mark_limit(axes: Axes, said: str, limit: float, seen: bool) -> None:
    """Name a limit along x above its line; if that is too far right to be seen, at the edge."""
    x = limit if seen else axes.get_xlim()[1]
    place = (axes.transData + axes.transAxes.inverted()).transform((x, 1.0))[0]
    side = "left" if place < ROOM else "right" if place > 1.0 - ROOM else "center"
    axes.text(x, 1.02, f"{said}{' →' * (not seen)}", transform=axes.get_xaxis_transform(), color=LIMIT, ha=side)


def draw_ranking(path: Path, ranking: Mapping[str, Mapping[str, Estimate]], sheet: Sheet = SCREEN) -> None:
    """A panel for each explained quantity, with a bar for each key. ranking: by key, then by quantity; the first on top."""
    explained = list(dict.fromkeys(name for found in ranking.values() for name in found))
    columns, height = sheet.side_by_side(len(explained), 3.0), 0.9 + 0.38 * len(ranking)
    width, below = COLUMN if columns > 1 else PHONE, -(-len(explained) // columns)
    with drawing(sheet):
        names = [wrapped(key, min(1.35, 0.4 * sheet.inches(width) / columns), rcParams["font.size"]) for key in ranking]
        sides = 1.45 / width, 0.5 / height, 0.97, 1.0 - 0.3 / height, 0.62
        figure = new_figure(sheet, (width, height, 0.9 * height * below), *sides)
        for axes, name in zip(figure.subplots(below, columns, squeeze=False).ravel(), explained, strict=True):
            known = [(row, one[name]) for row, one in enumerate(ranking.values()) if name in one]
            axes.barh([row for row, _ in known], [100.0 * one.value for _, one in known], 0.6, color=LINE)
            for row, one in known:
                axes.plot([100.0 * one.low, 100.0 * one.high], [row, row], color="black", linewidth=1.4, solid_capstyle="butt")
                axes.text(
                    100.0 * one.high + 0.6, row, units.percent(one.value), va="center", fontsize=rcParams["legend.fontsize"]
                )
            axes.set_yticks(range(len(ranking)), names)
            axes.set_ylim(len(ranking) - 0.5, -0.5)
            axes.set_xlim(0.0, min(116.0, 8.0 + 116.0 * max((one.high for _, one in known), default=0.0)))
            axes.set_title(name)
            axes.set_xlabel("share of the variance [%]")
            axes.grid(axis="y", visible=False)
        write(figure, path, sheet)


class ByKey(NamedTuple):
    """What is drawn over a key. good: share of successes by bin, for bins that have flights; errors: `QUANTILES` of a metric
    of completed flights by bin, for bins that have any.
    """

    good: dict[int, Estimate]
    errors: dict[int, Numbers]


def by_key(bins: Bins, success: NDArray[np.bool_], metric: Numbers, where: NDArray[np.bool_]) -> ByKey:
    """Some flights of each bin. metric: one number per flight, NaN where it did not complete; where: which."""
    counts = np.bincount(bins.places[where], minlength=bins.size)
    good = np.bincount(bins.places[where], success[where], minlength=bins.size).astype(int)
    known = np.isfinite(metric) & where
    places, values = bins.places[known], metric[known]
    small = places.astype(np.int16)  # sorted by counting
    apart = np.split(values[np.argsort(small, kind="stable")], np.cumsum(np.bincount(places, minlength=bins.size))[:-1])
    errors = {place: np.quantile(some, QUANTILES) for place, some in enumerate(apart) if len(some)}
    return ByKey({i: share(int(good[i]), int(counts[i])) for i in np.flatnonzero(counts).tolist()}, errors)


class PlottedKey(NamedTuple):
    """What is drawn over a key. name: as its axis has it; lines: by the value of another key, if that matters much; metric:
    with its limit.
    """

    name: str
    bins: Bins
    lines: Mapping[str, ByKey]
    metric: tuple[str, float | None]

    @property
    def grey(self) -> bool:
        """Whether it is a choice without lines of its own, whose values may have the colours of lines elsewhere."""
        return self.bins.edges is None and len(self.lines) == 1


def draw_keys(path: Path, keys: Sequence[PlottedKey], sheet: Sheet = SCREEN) -> None:
    """Success rates over keys side by side; over one, also the metric."""
    with drawing(sheet):
        panels = [(one, draw_success) for one in keys] + [(one, draw_errors) for one in keys if len(keys) == 1]
        columns = sheet.side_by_side(len(panels), 2.4)
        rows, size = -(-len(panels) // columns), rcParams["font.size"]
        room = [0.75 * sheet.inches(COLUMN) / columns / max(1, one.bins.size) for one in keys]
        labels = [
            one.bins.labels if len(one.bins.labels) > 5 else [broken(label, wide, size) for label in one.bins.labels]
            for one, wide in zip(keys, room, strict=True)
        ]
        lines = [max(0.05 * len(one) if len(some) > 5 else 0.16 * one.count("\n") for one in some or [""]) for some in labels]
        below = 0.55 + max(lines)
        wide, size = 0.91 * sheet.inches(COLUMN) / (1.2 * columns - 0.2), rcParams["legend.fontsize"]
        named = [[broken(name, wide - MARK * size / 72.0, size) for name in one.lines] for one in keys]
        beside = [legend_columns(wide + SIDES, names, len(names)) for names in named]
        high = [len("\n".join(some).split("\n")) / many for some, many in zip(named, beside, strict=True) if len(some) > 1]
        above = 0.3 + (0.1 + 0.2 * max(high) if high else 0.0)
        height = 1.7 + above + below
        sides = 0.075, below / height, 0.985, 1.0 - above / height, 0.2
        figure = new_figure(sheet, (COLUMN, height * rows, 0.8 * height * len(panels) / columns), *sides)
        grid = figure.subplots(rows, columns, squeeze=False)
        for place, (axes, (one, draw)) in enumerate(zip(grid.ravel(), panels, strict=False)):
            draw(axes, one)
            if len(keys) > 1:
                axes.set_title("succeed [%]" if place % columns == 0 else "")
            over_key(axes, one, labels[place % len(keys)])
            if len(one.lines) > 1 and (not place or one.lines.keys() != keys[0].lines.keys()):
                drawn, which = axes.get_legend_handles_labels()[0], place % len(keys)
                close = {"loc": "lower left", "bbox_to_anchor": (-0.03, 1.12)}  # hides no interval
                axes.legend(drawn, named[which], ncols=beside[which], **close)
        lowest = min(axes.get_ylim() for axes in grid.ravel()[: len(panels)])
        for place, axes in enumerate(grid.ravel()):
            axes.set_ylim(lowest if len(keys) > 1 else None)  # one scale for all
            axes.set_visible(place < len(panels))
        write(figure, path, sheet)


def broken(label: str, room: float, size: float) -> str:
    """`wrapped`, also behind a hyphen between words."""
    return wrapped(re.sub("(?<=[a-z])-(?=[a-z])", "- ", label), room, size).replace("- ", "-")


def over_key(axes: Axes, key: PlottedKey, labels: Sequence[str]) -> None:
    """The axis of a key."""
    bins, crowded = key.bins, len(labels) > 5
    axes.set_xlabel(key.name)
    if bins.edges is not None and bins.edges[0] < bins.edges[-1]:
        axes.set_xlim(bins.edges[0], bins.edges[-1])
    if bins.edges is None:
        axes.set_xticks(range(bins.size), labels)
        axes.tick_params(axis="x", rotation=35 if crowded else 0)
        for label in axes.get_xticklabels() if crowded else ():
            label.set_horizontalalignment("right")
            label.set_rotation_mode("anchor")
        axes.set_xlim(-0.6, bins.size - 0.4)
        axes.grid(axis="x", visible=False)
    elif bins.log:
        logarithmic(axes)


def draw_success(axes: Axes, key: PlottedKey) -> None:
    """The share of successes in each bin, with its interval."""
    least, bins, lines = 100.0, key.bins, key.lines
    for color, (name, (good, _)) in zip(GREY if key.grey else CURVES, lines.items(), strict=False):
        value, low, high = (100.0 * np.array(part) for part in zip(*good.values(), strict=True))
        at, left, right = across(bins, list(good))
        axes.hlines(value, left, right, color=color, linewidth=1.2)
        axes.vlines(at, low, high, color="0.4" if len(lines) == 1 else color, linewidth=1.0)
        axes.plot(at, value, linestyle="", marker="o", markersize=3.0, color=color, label=name or "succeed [%]")
        least = min(least, float(low.min()))
    bottom = max(0.0, 100.0 - 1.15 * (100.0 - least))
    axes.set_ylim(1.03 * bottom - 3.0 if bottom < 100.0 else 99.0, 100.0 + 0.04 * (100.0 - bottom or 1.0))
    axes.set_title("succeed [%], with exact 95 % intervals")
    axes.yaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10]))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda percent, _: f"{percent:.10g}"))


def draw_errors(axes: Axes, key: PlottedKey, steep: float = DECADES) -> None:
    """Median and, where flights of a bin differ, the middle 80 % of the metric in each bin, with its limit. NaN is a gap.

    steep: how many times the least the largest is where the axis is logarithmic.
    """
    bins, lines = key.bins, {name: one.errors for name, one in key.lines.items()}
    every = np.array([some for errors in lines.values() for some in errors.values()]).reshape(-1, len(QUANTILES))
    (name, limit), most = key.metric, float(np.nanmax(every, initial=0.0))
    differ = bool((every[:, 0] < every[:, -1]).any())
    what, known = units.metric(name)
    unit, factor = units.handy(known, most)
    axes.set_title(f"{what}{f' [{unit}]' * (unit != '-')}{': median and middle 80 %' * differ}")
    if not len(every):
        axes.text(0.5, 0.5, "none completed", transform=axes.transAxes, ha="center")
        return
    for style, (name, errors) in zip(LINES, lines.items(), strict=False):
        if not errors:
            continue
        low, middle, high = factor * np.array(list(errors.values())).T
        color = GREY[0] if key.grey else style["color"]
        at, left, right = across(bins, list(errors))
        if bins.edges is None:
            axes.bar(at, high - low, right - left, low, color=color, alpha=0.35)
            axes.hlines(middle, left, right, color=color, linewidth=1.6)
        else:
            axes.fill_between(at, low, high, linewidth=0.0, color=style["color"], alpha=0.35)
            median = f"{'median ' * differ}{name}{f' [{unit}]' * (unit != '-')}".strip()
            axes.plot(at, middle, marker="o", markersize=2.5, label=median, **style)
    least, most = factor * float(np.nanmin(every)), factor * most
    if limit is not None and limit * factor <= NEAR * most:
        axes.axhline(limit * factor, color=LIMIT, linestyle="--", linewidth=1.4)
        axes.text(0.99, limit * factor, "limit", transform=axes.get_yaxis_transform(), color=LIMIT, va="bottom", ha="right")
    if 0.0 < least * steep < most:
        axes.set_ylim(0.8 * least, 1.25 * most)
        logarithmic(axes, "y")
    else:
        axes.set_ylim(bottom=0.0)


def across(bins: Bins, places: Sequence[int]) -> tuple[Numbers, Numbers, Numbers]:
    """The middle of some bins as it appears on the axis, and their ends."""
    if bins.edges is None:
        at = np.array(places, dtype=float)
        return at, at - 0.3, at + 0.3
    left, right = bins.edges[list(places)], bins.edges[[place + 1 for place in places]]
    return np.sqrt(left * right) if bins.log else 0.5 * (left + right), left, right


def logarithmic(axes: Axes, which: str = "x") -> None:
    """A logarithmic axis with plain numbers: at 1, 2 and 5 where it is short."""
    (axes.set_xscale if which == "x" else axes.set_yscale)("log")
    axis = axes.xaxis if which == "x" else axes.yaxis
    low, high = sorted(axis.get_view_interval())
    (plain_decades if high < 100.0 * low else powers)(axis)

"""Figures of a flight that read in black and white: panels stacked over time, or its path from above and from the side."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib import rcParams
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from quadstep.report.axes import GRID, STEADY, linear, logarithmic, logarithmic_time, peaked, signed_logarithmic, ticked
from quadstep.report.canvas import BAND, BUCKETS, LINES, PALE, SIDES, Typeset, drawing, legend_columns, new_figure, thin, write
from quadstep.report.moments import ROW, mark, rows_above
from quadstep.report.panel import (
    ASKED_FOR,
    COMMANDED,
    DESIRED,
    LOG,
    SIGNED_LOG,
    STACKED,
    UNJUDGED,
    EventMark,
    Panel,
    Track,
    seen_from,
)
from quadstep.report.sheet import COLUMN, PHONE, Sheet
from quadstep.report.units import label, prefixed, prose, suited

Numbers = NDArray[np.float64]

LONGEST_LABEL = 18
"""Letters of a quantity and its unit that are as long as a panel is high: of more, the unit has a line of its own."""

FLOWN, TOGETHER, BEFORE, AFTER = "flown", "sum", "current", "tuned"

NAMES = 4
"""Most names of a legend beside one another."""

LEFT, RIGHT, BETWEEN, LABEL, SPARE = 0.85, 0.15, 1.0, 0.66, 0.45
"""Room [in] left and right of the panels, between them, from an axis to the middle of its label, and for a legend that is
wider than its panel.
"""


def steady(lines: dict[str, Numbers]) -> float | None:
    """The size, to three digits, of a line that stands alone and hardly varies: it is shown as what it is away from that."""
    values = next(iter(lines.values()))
    if len(lines) > 1 or not len(values):
        return None
    low, high = float(values.min()), float(values.max())
    return float(f"{0.5 * (low + high):.3g}") if 0.0 < high - low < STEADY * max(abs(low), abs(high)) else None


def legend(panel: Panel) -> list[str]:
    """What its legend says: nothing of a single line, which the axis names; of a quantity and its command what both are."""
    first, *others = panel.lines
    if panel.scale == STACKED:
        return [*map(label, panel.lines), TOGETHER]
    wanted = COMMANDED if panel.unit == "rad" else DESIRED  # an angle follows from what the law commands
    return [FLOWN, wanted] if others == [f"{first}_d"] else list(map(label, panel.lines)) if others else []


def legends(panels: Sequence[Panel], rows: int) -> list[list[str]]:
    """Of panels below one another in columns of so many rows: nothing where it repeats the one above, or all are alike."""
    found, above, said = [], list[str](), [*map(legend, panels)]
    for place, now in enumerate(said):
        above = above if place % rows or said.count(said[0]) == len(said) else []
        found.append(now if now != above else [])
        above = now or above
    return found


def beside(across: float, names: list[str]) -> int:
    """Columns of a legend above axes so wide [in]; areas have wide marks."""
    return legend_columns(across + SPARE + SIDES, names, NAMES - (TOGETHER in names))


def draw(
    axes: Axes, t: Numbers, panel: Panel, log_time: bool = False, names: list[str] | None = None, above: float = 0.0
) -> None:
    """Fill one set of axes; entries may be shorter than t (a flight that ended early). names: those of its legend, which has
    `above` [in] below it.
    """
    lines, name = panel.lines, label(panel.label)
    scale = panel.scale or (SIGNED_LOG if not panel.band and peaked(list(lines.values())) else "")
    base = None if scale or panel.band else steady(lines)
    if base is not None:
        lines = {key: values - base for key, values in lines.items()}
        name += f" − {base:g} {prose(panel.unit).strip('-')}".rstrip()
    largest = max([panel.reach, *(float(np.abs(values).max()) for values in lines.values() if len(values))])
    unit, factor = (prefixed if panel.unit == "-" else suited)(panel.unit, largest)
    lines = {key: factor * values for key, values in lines.items()}
    drawn = [values for values in lines.values() if len(values)]
    if panel.band:
        kept = np.linspace(0, len(panel.band[0]) - 1, 3 * BUCKETS).astype(int)
        low, high = (factor * one[kept] for one in panel.band)
        axes.fill_between(t[kept], low, high, color=LINES[0]["color"], alpha=BAND["alpha"], linewidth=0.0)
        drawn += [low, high]
    if scale == STACKED:
        drawn, lines = stack(axes, t, lines, log_time), {}
    for style, (key, values) in zip(LINES * 2, lines.items(), strict=False):
        look = BAND if len(lines) > 1 and (key.endswith("_d") or key in ASKED_FOR) else PALE if key == UNJUDGED else style
        axes.plot(*thin(t, values, log_time), label=label(key), **look)
    if log_time:
        logarithmic_time(axes, t)
    if scale == LOG:
        logarithmic(axes, drawn)
    elif scale == SIGNED_LOG:
        signed_logarithmic(axes, drawn)
    else:
        linear(axes, drawn)
    space = "\n" if len(panel.label) + len(unit) > LONGEST_LABEL else " "
    axes.set_ylabel(name if unit == "-" else f"{name}{space}[{unit}]", parse_math=True)
    if not (names := legend(panel) if names is None else names):
        return
    ncols = beside(axes.bbox.width / axes.figure.dpi, names)
    shown = axes.legend(
        axes.get_legend_handles_labels()[0][: len(names)], names, loc="lower left", borderaxespad=0.1, ncols=ncols,
        bbox_to_anchor=(0.0, 1.0 + above * axes.figure.dpi / axes.bbox.height), handlelength=2.2, columnspacing=1.2,
    )  # fmt: skip
    for text in shown.get_texts():  # above the lines
        text.set_parse_math(True)


def stack(axes: Axes, t: Numbers, parts: dict[str, Numbers], log: bool) -> list[Numbers]:
    """Areas upon one another, what is positive upwards and what is negative downwards, from where they can be seen, and the
    line of their sum. Returns the extremes.
    """
    kept = np.unique((np.geomspace if log else np.linspace)(1, len(next(iter(parts.values()))), BUCKETS).astype(int)) - 1
    t, values = t[kept], np.array([one[kept] for one in parts.values()])
    above, below = np.maximum(values, 0.0), np.minimum(values, 0.0)
    colors = [*(style["color"] for style in LINES), "0.5"][: len(parts)]
    for side, names in ((above, map(label, parts)), (below, ())):
        axes.stackplot(t, side, labels=names, colors=colors, alpha=0.55, linewidth=0.0)
    axes.plot(t, values.sum(axis=0), color="black", linewidth=1.3, label=TOGETHER)
    if not log:
        axes.set_xlim(left=t[seen_from(values)])
    return [above.sum(axis=0), below.sum(axis=0)]


def grid_alone(axes: Axes) -> None:
    """Of a time axis whose labels stand further down, keep the grid: ticks are a fourth of the time that a figure takes."""
    low, high = axes.get_xlim()
    times = [time for time in axes.get_xticks() if low <= time <= high]
    axes.set_xlim(low, high)  # which the grid must not widen
    axes.xaxis.set_visible(False)
    if rcParams["axes.grid"]:
        color, width = rcParams["grid.color"], rcParams["grid.linewidth"]
        name, across = f"{GRID}{axes.figure.axes.index(axes)}", axes.get_xaxis_transform()
        axes.vlines(times, 0.0, 1.0, color, linewidth=width, transform=across, zorder=0.5, gid=name)


def save(
    path: Path, t: Numbers, panels: Sequence[Panel], columns: int, sheet: Sheet, log_time: bool = False,
    track: Track | None = None, moments: Sequence[EventMark] = (),
) -> None:  # fmt: skip
    """Write `path` in the sheet's formats: canvases print directly, as automatic layout would draw each four times."""
    with drawing(sheet):
        write(laid_out(t, panels, columns, sheet, log_time, track, moments), path, sheet)


def picture(
    t: Numbers, panels: Sequence[Panel], columns: int = 1, log_time: bool = False, track: Track | None = None,
    moments: Sequence[EventMark] = (),
) -> Figure:  # fmt: skip
    """The same figure for who draws it with settings of their own: it keeps the looks that it has here."""
    with drawing(sheet := Sheet()):
        figure = laid_out(t, panels, columns, sheet, log_time, track, moments)
        figure.draw_without_rendering()  # makes the ticks, which take their looks from the settings of that moment
    return figure


def laid_out(
    t: Numbers, panels: Sequence[Panel], columns: int, sheet: Sheet, log_time: bool, track: Track | None,
    moments: Sequence[EventMark],
) -> Figure:  # fmt: skip
    return track_figure(t, track, sheet, moments) if track else arranged(t, panels, columns, sheet, log_time, moments)


def arranged(
    t: Numbers, panels: Sequence[Panel], columns: int, sheet: Sheet, log_time: bool, moments: Sequence[EventMark] = ()
) -> Figure:
    """Panels over a shared time axis, filled column by column, with margins in inches."""
    columns = sheet.side_by_side(min(columns, len(panels)))
    rows = -(-len(panels) // columns)
    width = sheet.inches(COLUMN if columns > 1 else PHONE)
    tight = sheet.width is not None
    left, between, far = (LEFT, BETWEEN, LABEL) if not tight else (0.75, 0.83, 0.6)
    across = (width - left - RIGHT - between * (columns - 1)) / columns
    names = legends(panels, rows)
    high = [-(-len(one) // beside(across, one)) if one else 0 for one in names]
    below = max([one for place, one in enumerate(high) if place % rows], default=0)
    more, gap = 0.15 * max(0, max(high[::rows]) - 1), 0.15 * max(0, below - 1)
    above = ROW / 72.0 * (rows_above(moments, float(t[0]), float(t[-1]), across) if len(t) and not log_time else 0)
    inner = (2.3 if rows == 1 else 1.25 if tight else 1.1 if below else 0.98) * rows - 0.17
    top = (0.32 if max(high[::rows]) else 0.14) + more + above
    height = inner + 0.48 + top + gap * (rows - 1)
    apart = 0.25 if not below else 0.37 if not tight else 0.42
    apart += gap * (rows + apart * (rows - 1)) / inner  # of the height of a panel
    figure = Typeset(figsize=(width, height), dpi=sheet.dpi)
    figure.subplots_adjust(left / width, 0.48 / height, 1.0 - RIGHT / width, 1.0 - top / height, between / across, apart)
    grid = figure.subplots(rows, columns, sharex=rows > 1, squeeze=False)
    for place, (axes, panel, said) in enumerate(zip(grid.T.flat, panels, names, strict=False)):
        draw(axes, t, panel, log_time, said, above * (place % rows == 0))
    for axes in grid.T.flat[len(panels) :]:
        axes.set_visible(False)
    for axes in grid.flat:
        axes.yaxis.set_label_coords(-far / across, 0.5)
        axes.yaxis.label.set_verticalalignment("center")  # of one line or two
    shown = list(grid.T.flat[: len(panels)])
    lowest = [*shown[rows - 1 :: rows], *shown[-1:]]
    for axes in lowest:
        axes.set_xlabel("time [s]")
        axes.tick_params(labelbottom=True)
        if not log_time:
            ticked(axes.xaxis, 8)
    for place, axes in enumerate([] if log_time else shown):
        mark(axes, moments, words=place % rows == 0)
    for axes in shown:
        if axes not in lowest:
            grid_alone(axes)
    return figure


MOST_POINTS = 2000

DECADES = 20.0
"""Ratio of the largest distance to the usual one above which its axis is logarithmic."""


def track_figure(t: NDArray[np.float64], track: Track, sheet: Sheet, moments: Sequence[EventMark] = ()) -> Figure:
    views = track.views
    narrow = bool(views) and sheet.side_by_side(1 + len(views), 2.2) < 1 + len(views)
    width = COLUMN if views else PHONE
    second = 0.18 if views and track.before is not None else 0.0  # row of the legend
    free, least = (0.24 + second, 4.3 - 0.95 * len(views) + second) if views else (0.03, 1.7)  # above the axes
    across = (width - 0.94) / (1.0 + 1.5 * len(views))
    more = max(0.0, ROW / 72.0 * rows_above(moments, float(t[0]), float(t[-1]), across) - free)
    tall = least + more
    size = width, tall, 3.8 if narrow else 2.6 if views else 1.7
    sides = (0.68 if views else 0.82) / width, 0.46 / tall, 1.0 - 0.12 / width, 1.0 - (free + 0.05 + more) / tall
    figure = new_figure(sheet, size, *sides, 0.44 - 0.04 * len(views))
    *seen_from, errors = track_axes(figure, len(views), narrow)
    laid = {FLOWN: track} if track.before is None else {AFTER: track, BEFORE: track.before}
    distance = np.concatenate([one.distance for one in laid.values()])
    unit, factor = suited("m", float(distance.max()))
    seen = distance[distance > 0.0]
    steep = len(seen) > 0 and distance.max() > DECADES * np.quantile(seen, 0.05)
    for style, (name, one) in zip(LINES, laid.items(), strict=False):
        drawn = one.distance > 0.0 if steep else np.ones(len(one.distance), bool)
        errors.plot(
            *thin(t[: len(drawn)][drawn], factor * one.distance[drawn]), label=name if len(laid) > 1 else None, **style
        )
    if steep:
        logarithmic(errors, [factor * distance[distance >= 0.5 * np.quantile(seen, 0.02)]])
    else:
        linear(errors, [factor * distance])
        errors.set_ylim(bottom=0.0)
    if track.begin > t[0]:
        errors.axvspan(t[0], min(track.begin, t[-1]), color="0.9", linewidth=0.0, zorder=0.1)
    errors.set_xlabel("time [s]")
    ticked(errors.xaxis, 5)
    mark(errors, moments)
    errors.set_ylabel(f"position error [{unit}]")
    low, high = track.view
    for axes, (a, b) in zip(seen_from, views, strict=True):
        draw_path(axes, track.wanted[:, [a, b]], {name: one.flown[:, [a, b]] for name, one in laid.items()})
        axes.set_xlim(low[a], high[a])
        axes.set_ylim(low[b], high[b])
        axes.set_box_aspect(1.0)
        axes.set_xlabel(f"{'xyz'[a]} [m]")
        axes.set_ylabel(f"{'xyz'[b]} [m]")
        ticked(axes.xaxis, 5)
        ticked(axes.yaxis, 5)
    lines, names = (seen_from[0] if views else errors).get_legend_handles_labels()
    if narrow:
        seen_from[0].figure.legend(lines[::-1], names[::-1], loc="outside upper left", ncols=3)
    elif views or len(laid) > 1:
        axes = seen_from[0] if views else errors
        axes.legend(lines[::-1], names[::-1], loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, borderaxespad=0.1)
    return figure


def track_axes(figure: Figure, views: int, narrow: bool) -> list[Axes]:
    """The axes of the views, that from above, which a phone shows first, and the error; narrow: below them."""
    if not narrow:
        return [*figure.subplots(1, 1 + views, width_ratios=[*[1.0] * views, 1.2 + 0.15 * views], squeeze=False)[0]]
    above, below = figure.subfigures(2, 1, squeeze=False)[:, 0]
    return [*above.subplots(1, views, squeeze=False)[0], below.subplots()]


def draw_path(axes: Axes, wanted: NDArray[np.float64], flown: Mapping[str, NDArray[np.float64]]) -> None:
    """One view: the desired path, the flown ones by name, and where the first began and ended."""
    lines = [(DESIRED, wanted, BAND), *((*one, style) for one, style in zip(flown.items(), LINES, strict=False))]
    for name, points, style in lines:
        axes.plot(*points[:: max(1, len(points) // MOST_POINTS)].T, label=name, **style)
    first = next(iter(flown.values()))
    axes.plot(*first[0], marker="o", color="black", markerfacecolor="white", markersize=5, linestyle="")
    axes.plot(*first[-1], marker="x", color="black", markersize=6, linestyle="")

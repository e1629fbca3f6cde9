"""The map of an envelope, drawn with one panel per value of --by, coloured by RMSE, grey and hatched where flights fail."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import LogNorm, Normalize, to_hex
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, PathPatch, Rectangle
from matplotlib.path import Path as Outline
from matplotlib.patheffects import withStroke
from matplotlib.ticker import FixedFormatter, MaxNLocator, PercentFormatter
from numpy.typing import NDArray

from quadstep.engines.scored import RMSE
from quadstep.metrics.requirements import unit
from quadstep.mission.fields import label
from quadstep.mission.read import check_mission
from quadstep.report.canvas import LINES, drawing, figure_at, write
from quadstep.report.colours import COLOURS as NAMED
from quadstep.report.sheet import PHONE, Sheet
from quadstep.report.told import ToldPlace, tell
from quadstep.report.units import handy, listed, metric, percent, quantity
from quadstep.studies.campaign.pictures import ByKey, PlottedKey, draw_errors, logarithmic, over_key
from quadstep.studies.campaign.varied import Bins, text_of
from quadstep.studies.envelope_cells import CAUSES, MOSTLY, OVER_LIMIT, Cells, too_few
from quadstep.studies.envelope_request import MapAxis, Request

COLOURS = "viridis"
"""Lighter where the error is larger, also in greyscale and for the colour-blind."""

LOOKS = {
    OVER_LIMIT: ("0.97", "..", "above a limit"),
    "off-path": ("0.89", "//", "lost: off the path"),
    "spinning": ("0.79", "xxx", "lost: spinning"),
    "crashed": ("0.68", "--", "lost: crashed"),
    "singular": ("0.56", "||", "lost: theta at 90°"),
    "not-finite": ("0.43", "OO", "lost: not finite"),
}
"""Grey, hatch and words for each cause: told apart by the hatch alone, and by grey."""

STRUCK, THICK = "black", 0.9
"""Of the lines through coloured cells that cannot be flown; a white seam tells them from dark cells."""

MOST_HATCHED = 20_000
"""Spans of cells that are hatched; beyond, grey has to do."""

LISTED_TICKS = 25
LEAST = 1e-12


def draw_map(path: Path, request: Request, cells: Cells, sheet: Sheet, links: Mapping[int, str]) -> None:
    """Write `path` in the sheet's formats. links: where flights of cells can be seen, by the cell's number."""
    campaign, (count, _, _) = request.campaign, request.shape
    mission = check_mission(campaign.content, campaign.source, campaign.folder)
    columns = 1 if sheet.width is None else sheet.side_by_side(2 if count == 4 else min(count, 3), 2.0)
    rows = -(-count // columns)
    norm = scale(cells)
    with drawing(sheet, {"axes.grid": False, "hatch.linewidth": 0.6}):
        width = sheet.inches(PHONE)
        figure = Figure(figsize=(width, 1.7 + 0.72 * rows * (width - 0.7) / columns), layout="constrained")
        grid = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
        for place, axes in enumerate(grid.flat):
            if place >= count:
                axes.set_axis_off()
                continue
            draw_panel(axes, request, cells, place)
            link_cells(axes, request, place, links)
            if request.by:
                axes.set_title(request.by.in_words(request.by.values[place]))
        for axes in grid.flat[max(0, count - columns) : count]:
            axes.set_xlabel(label(mission, request.x.key))
            axes.tick_params(labelbottom=True)
        for axes in grid[:, 0]:
            axes.set_ylabel(label(mission, request.y.key))
        if norm and (by_success(cells) or np.ptp(cells.rmse[coloured(cells)]) > 0.0):  # one value needs no scale
            draw_scale(figure, grid, norm, request)
        handles = [*legend(request, cells), *mark(grid.flat[0], [], [])[: len(cells.crossed)]]
        if handles:
            beside = max(1, min(len(handles), 4, int(width / 1.7)))
            figure.legend(handles=handles, loc="outside lower left", ncols=beside, handlelength=2.6, handleheight=1.6)
        write(figure, path, sheet)


def draw_slices(path: Path, request: Request, cells: Cells, sheet: Sheet) -> bool:
    """Errors along the middle row of each panel; of a single one also along its first and last. Whether there are any."""
    panels, rows, _ = request.shape
    middle, ends = [(one, rows // 2) for one in range(panels)], [] if request.by else [(0, 0), (0, rows - 1)]
    errors = np.where(coloured(cells), cells.spread, np.nan)
    seen = [place for place in sorted({*middle, *ends}) if np.isfinite(errors[1][place]).sum() > 1]
    if by_success(cells) or not (request.x.ranged and 0 < len(seen) <= len(LINES)):
        return False
    axis, which = (request.by, 0) if request.by else (request.y, 1)
    lines = {axis.in_words(axis.values[one[which]]): ByKey({}, dict(enumerate(errors[:, *one].T))) for one in seen}
    bins, limit = Bins(np.zeros(0, int), edges(request.x), ()), request.campaign.file.failure.get("position_rmse")
    key = PlottedKey(label(request.campaign.mission, request.x.key), bins, lines, (RMSE, limit))
    high = 6.2 if request.by else 4.2
    with figure_at(path, sheet, (PHONE, high), 0.16, 0.55 / high, 0.97, 1.0 - (0.28 + 0.21 * len(lines)) / high) as figure:
        axes = figure.subplots()
        draw_errors(axes, key, 5.0)
        over_key(axes, key, ())
        axes.legend(axes.lines[: len(lines)], lines, loc="lower left", bbox_to_anchor=(0.0, 1.0 + 0.25 / high))
    return True


FEWEST_COLOURED = 0.1
"""Share of the cells of a map with an error to show, below which it shows success rates."""


def by_success(cells: Cells) -> bool:
    """Whether colour is the success rate: where few cells have an error to show."""
    few = (cells.share >= MOSTLY).mean() < FEWEST_COLOURED
    return bool(few and cells.flights > 1 and np.ptp(cells.share) > 0.0)


def scale(cells: Cells) -> Normalize | None:
    """Of what is coloured: the success rate, or the RMSE; None if nothing is."""
    if by_success(cells):
        return Normalize(0.0, float(cells.share.max()))
    shown_rmse = cells.rmse[coloured(cells)]
    if not shown_rmse.size:
        return None
    least, most = max(LEAST, float(shown_rmse.min())), max(LEAST, float(shown_rmse.max()))
    return LogNorm(least, most) if most > 1.05 * least else LogNorm(least / 1.5, most * 1.5)


def coloured(cells: Cells) -> NDArray[np.bool_]:
    """Cells in which at least half of the flights succeed, the others are grey; all where colour is the success rate."""
    return (cells.share >= MOSTLY) | by_success(cells)


def painted(cells: Cells) -> NDArray[np.float64]:
    """The colours of all cells, as red, green, blue and opacity; that is 0 of those without one."""
    norm, good = scale(cells), coloured(cells)
    image = np.zeros((*good.shape, 4))
    if norm:
        values = cells.share if by_success(cells) else np.maximum(cells.rmse, LEAST)
        image[good] = colormaps[COLOURS](norm(values[good]))
    return image


def colours(cells: Cells) -> list[str]:
    """The same as CSS, cell by cell; empty of those without one."""
    return [to_hex((r, g, b)) if shown else "" for r, g, b, shown in painted(cells).reshape(-1, 4).tolist()]


def mark(axes: Axes, x: list[float], y: list[float]) -> list[Line2D]:
    """Crosses where a flight that reaches the end is not as commanded."""
    fill, label = NAMED["vermillion"], "not as commanded"
    return axes.plot(x, y, marker="X", ms=8.0, mfc=fill, mec="white", linewidth=0.0, label=label)


def draw_panel(axes: Axes, request: Request, cells: Cells, place: int) -> None:
    """One panel: x to the right, y up."""
    good, cause = coloured(cells)[place], cells.cause[place]
    image = painted(cells)[place]
    across, up = edges(request.x), edges(request.y)
    axes.imshow(image, extent=(across[0], across[-1], up[0], up[-1]), origin="lower", aspect="auto", interpolation="none")
    for number, name in enumerate(CAUSES):
        hatch(axes, ~good & (cause == number), across, up, name)
    if cells.flyable.any():
        strike(axes, good & ~cells.flyable[place], across, up)
    x, y = (edges(axis)[:-1] + np.diff(edges(axis)) / 2.0 for axis in (request.x, request.y))
    marked = [at for at in (np.unravel_index(one, request.shape) for one in cells.crossed) if at[0] == place]
    mark(axes, [x[column] for _, _, column in marked], [y[row] for _, row, _ in marked])
    tell_cells(axes, request, cells, place)
    for axis, given in ((axes.xaxis, request.x), (axes.yaxis, request.y)):
        if given.ranged:
            axis.set_data_interval(float(given.values[0]), float(given.values[-1]), ignore=True)  # flown; not to cells' edges
            axis.set_major_locator(MaxNLocator(7, steps=[1, 2, 5, 10]))
        else:
            every = -(-len(given.values) // LISTED_TICKS)
            axis.set_ticks(range(0, len(given.values), every))
            axis.set_major_formatter(FixedFormatter([text_of(one) for one in given.values[::every]]))


def strike(axes: Axes, where: NDArray[np.bool_], across: NDArray[np.float64], up: NDArray[np.float64]) -> None:
    """A line from corner to corner of some cells."""
    lines = [[(across[x], up[y]), (across[x + 1], up[y + 1])] for y, x in np.argwhere(where)[:MOST_HATCHED].tolist()]
    seam = withStroke(linewidth=2.0 * THICK, foreground="white")
    axes.add_collection(LineCollection(lines, colors=STRUCK, linewidths=THICK, path_effects=[seam]), autolim=False)


def link_cells(axes: Axes, request: Request, place: int, links: Mapping[int, str]) -> None:
    """Make cells of a panel links, with a dot in each."""
    across, up = edges(request.x), edges(request.y)
    for cell, link in links.items():
        panel, row, column = np.unravel_index(cell, request.shape)
        if panel == place:
            (left, right), (bottom, top) = across[column : column + 2], up[row : row + 2]
            axes.add_artist(Rectangle((left, bottom), right - left, top - bottom, facecolor=HARDLY, linewidth=0.0, url=link))
            middle = (0.5 * (left + right), 0.5 * (bottom + top))
            axes.scatter(*middle, 9.0, color="white", edgecolor="black", linewidths=0.6, zorder=3, urls=[link])


HARDLY = (1.0, 1.0, 1.0, 0.01)
"""What can be clicked, and is not seen."""

MOST_TOLD = 3_000
"""Cells of a panel that answer to the pointer."""


def tell_cells(axes: Axes, request: Request, cells: Cells, place: int) -> None:
    """What each cell of a panel is, for a report's reader who points at it."""
    if cells.share[place].size > MOST_TOLD:
        return
    across, up = edges(request.x).tolist(), edges(request.y).tolist()
    for (row, column), good in np.ndenumerate(cells.share[place]):
        where = ((request.x, column), (request.y, row))
        name = ", ".join(axis.in_words(axis.values[i]) for axis, i in where)
        rmse, causes = float(cells.rmse[place, row, column]), cells.causes[place, row, column]
        told = [("succeed", percent(float(good)))] if cells.flights > 1 else []
        told += [("position RMSE", quantity(rmse, "m"))] if math.isfinite(rmse) else []
        why = f"{'mostly ' * bool((causes > 0).sum() > 1)}{LOOKS[CAUSES[causes.argmax()]][2]}" if causes.any() else ""
        told += [("failures" if cells.flights > 1 else "result", why)] if why else []
        lacking = cells.lacking.get(int(np.ravel_multi_index((place, row, column), request.shape)))
        such = f"not as commanded: {listed(lacking)}" if lacking else "as commanded"
        told += [("flight shown" if cells.flights > 1 else "result", such)] if lacking is not None else []
        tell(axes, ToldPlace(across[column], across[column + 1], up[row], up[row + 1], name, told))


def edges(axis: MapAxis) -> NDArray[np.float64]:
    """The edges of the cells along an axis; listed values are 0, 1, 2, ..."""
    count = len(axis.values)
    first, last = (float(axis.values[0]), float(axis.values[-1])) if axis.ranged else (0.0, count - 1.0)
    half = 0.5 * (last - first) / (count - 1) if count > 1 else 0.5
    return np.linspace(first - half, last + half, count + 1)


def hatch(axes: Axes, where: NDArray[np.bool_], across: NDArray[np.float64], up: NDArray[np.float64], cause: str) -> None:
    """Grey and hatch some cells, neighbours in a row as one."""
    corners = []
    for row, bottom, top in zip(where, up[:-1], up[1:], strict=True):
        changes = np.flatnonzero(np.diff(np.concatenate([[False], row, [False]])))
        for first, past in changes.reshape(-1, 2).tolist():
            left, right = across[first], across[past]
            corners.append([(left, bottom), (right, bottom), (right, top), (left, top), (left, bottom)])
    if corners:
        codes = [Outline.MOVETO, Outline.LINETO, Outline.LINETO, Outline.LINETO, Outline.CLOSEPOLY] * len(corners)
        outline = Outline(np.array(corners).reshape(-1, 2), codes)
        look = look_of(cause)
        look["hatch"] = look["hatch"] if len(corners) <= MOST_HATCHED else None
        axes.add_patch(PathPatch(outline, **look))


def look_of(cause: str) -> dict[str, Any]:
    """How patches of a cause look: dark on a light grey, light on a dark one."""
    grey, pattern, _ = LOOKS[cause]
    return {"facecolor": grey, "edgecolor": "0.2" if float(grey) > 0.6 else "white", "linewidth": 0.0, "hatch": pattern}


def legend(request: Request, cells: Cells) -> list[Artist]:
    """The legend of greys and lines, as far as they occur."""
    grey = ~coloured(cells)
    limits = ", ".join(
        f"{metric(full := request.campaign.thresholds[name])[0]} more than {most:g} {unit(full)}".strip()
        for name, most in request.campaign.file.failure.items()
    )
    limits = "fewer than half succeed" if cells.flights > 1 and not cells.cause[grey].any() else limits
    handles: list[Artist] = [
        Patch(**look_of(name), label=limits if name == OVER_LIMIT else LOOKS[name][2])
        for number, name in enumerate(CAUSES)
        if (grey & (cells.cause == number)).any()
    ]
    some = bool((~grey & ~cells.flyable).any() and cells.flyable.any())
    return [*handles, *[Line2D([], [], color=STRUCK, linewidth=THICK, label=too_few(cells.flights))][:some]]


def draw_scale(figure: Figure, grid: NDArray[np.object_], norm: Normalize, request: Request) -> None:
    (unit, factor), by_error = handy("m", norm.vmax or 1.0), isinstance(norm, LogNorm)
    norm = LogNorm(factor * (norm.vmin or 1.0), factor * (norm.vmax or 1.0)) if by_error else norm
    shown = ScalarMappable(norm, colormaps[COLOURS])
    bar = figure.colorbar(shown, ax=grid.ravel().tolist(), location="top", pad=0.02, aspect=40)
    if not by_error:
        bar.ax.xaxis.set_major_formatter(PercentFormatter(1.0, symbol=" %", decimals=0))
        bar.set_label("share of flights that succeed")
        return
    logarithmic(bar.ax)
    bar.set_label(f"{'median ' * (request.flights > 1)}position RMSE [{unit}]")

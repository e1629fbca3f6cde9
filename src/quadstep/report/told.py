"""What a figure's SVG tells of its axes to the script of reports (`frontend/src/report`), which reads values off it."""

import json
import re
from collections.abc import Iterator, Sequence
from html import escape
from itertools import pairwise
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.collections import PathCollection, QuadMesh
from matplotlib.container import BarContainer
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle, StepPatch
from matplotlib.ticker import FixedFormatter

from quadstep.report.axes import GRID
from quadstep.report.sheet import PHONE

KINDS = frozenset(("linear", "log", "symlog"))
"""Scales that it knows."""


class ToldPlace(NamedTuple):
    """A point or a cell, in values of its axes, and what is said of it where the pointer is: names with what they are."""

    left: float
    right: float
    bottom: float
    top: float
    name: str
    said: Sequence[tuple[str, str]]


CUT = 3.0
"""Room between a cut and what is drawn [pt]."""

SPOTS: "WeakKeyDictionary[Axes, list[ToldPlace]]" = WeakKeyDictionary()
"""Of each axes whose points or cells are told."""


def tell(axes: Axes, spot: ToldPlace) -> None:
    """Have a point or a cell told."""
    SPOTS.setdefault(axes, []).append(spot)


MATH = re.compile(r"\\mathrm\{([^}]*)\}|\\(?:dot|ddot|tilde|hat)\{([^}]*)\}|\$")


def mark(figure: Figure) -> None:
    """Name axes, and what is drawn in them, in the SVG to come."""
    for place, axes in enumerate(figure.axes):
        axes.set_gid(f"axes{place}")
        for number, one in enumerate(plotted_artists(axes)):
            one.set_gid(f"drawn{place}.{number}")


def described_svg(svg: str, figure: Figure) -> str:
    """The SVG of a marked figure, just drawn, with what is known of its axes; its links open in the same window."""
    svg = svg.replace(' target="_blank"', "")
    known = [described(place, axes, figure) for place, axes in enumerate(figure.axes) if readable(axes)]
    for name, told in (("strips", strips(figure)), ("axes", known)):
        if told:
            content = escape(json.dumps(told, separators=(",", ":"), ensure_ascii=False, allow_nan=False))
            svg = svg.replace("<svg ", f'<svg data-{name}="{content}" ', 1)
    return svg


def strips(figure: Figure) -> list[tuple[float, float, float, list[str]]]:
    """Parts of a drawn figure beside one another, each as wide as a phone at most where there is room to cut: left, width,
    height [pt], and the names of its axes. One part where it has words of its own across them.
    """
    figure.set_dpi(72.0)  # as it was drawn
    wide, high = 72.0 * figure.get_size_inches()
    shown = sorted((*extent(axes, high), f"axes{place}") for place, axes in enumerate(figure.axes) if axes.get_visible())
    found: list[tuple[float, float, float, list[str]]] = []
    whole = bool(figure.legends or figure.texts)
    for left, right, low, name in shown:
        if found and (whole or left < found[-1][1] or right - found[-1][0] <= 72.0 * PHONE):
            start, end, bottom, names = found[-1]
            found[-1] = (start, max(end, right), max(bottom, low), [*names, name])
        else:
            found.append((left, right, low, [name]))
    cuts = [0.0, *(one[0] - CUT for one in found[1:]), float(wide)]
    return [
        (round(left, 1), round(right - left, 1), round(high if whole else min(low, high), 1), names)
        for (left, right), (_, _, low, names) in zip(pairwise(cuts), found, strict=True)
    ]


def extent(axes: Axes, high: float) -> tuple[float, float, float]:
    """Left, right and bottom of axes with their labels [pt]: all that they draw would take a third of the drawing's time."""
    box, label, below = axes.get_window_extent(), axes.yaxis.label, axes.xaxis.label
    beside = label.get_window_extent() if label.get_text() else axes.yaxis.get_tightbbox(None) or box
    low = below.get_window_extent().y0 - CUT if below.get_text() else 0.0
    low = low if axes.xaxis.get_visible() else box.y0
    return min(box.x0, beside.x0), max(box.x1, beside.x1), high - low


def plotted_artists(axes: Axes) -> list[Artist]:
    """All that is drawn in them but the grid."""
    parts = [*axes.lines, *axes.patches, *axes.collections, *axes.texts]
    return [one for one in parts if not str(one.get_gid()).startswith(GRID)]


def curves(axes: Axes) -> list[Line2D | StepPatch]:
    """Those with values, outlines of histograms too: a lone point, or a line across all of the axes, is a mark."""
    sizes = [(line, np.asarray(line.get_xdata()).size) for line in axes.lines]
    lines = [line for line, size in sizes if size > 2 or (size == 2 and name(line))]
    return [*lines, *(one for one in axes.patches if isinstance(one, StepPatch) and not one.get_fill())]


def bars(axes: Axes) -> Iterator[tuple[BarContainer, Rectangle, str]]:
    """Each with its name: that of the tick that it stands at, and that of its kind."""
    for container in axes.containers:
        if not isinstance(container, BarContainer):
            continue
        axis = axes.yaxis if container.orientation == "horizontal" else axes.xaxis
        ticks = dict(zip(axis.get_ticklocs(), (one.get_text() for one in axis.get_ticklabels()), strict=False))
        for one in container.patches:
            (x, y), (dx, dy) = one.get_xy(), (one.get_width(), one.get_height())
            middle = y + 0.5 * dy if axis is axes.yaxis else x + 0.5 * dx
            words = ticks[min(ticks, key=lambda tick: abs(tick - middle))] if ticks else ""
            yield container, one, ", ".join(filter(None, (words, name(container))))


def name(one: Artist | BarContainer) -> str:
    """In a legend; "" where it is in none."""
    label = str(one.get_label())
    return "" if label.startswith("_") else as_text(label)


def readable(axes: Axes) -> bool:
    """Whether it has curves, bars or spots, on scales that are known."""
    some = bool(curves(axes)) or axes in SPOTS or any(isinstance(one, BarContainer) for one in axes.containers)
    return axes.get_visible() and some and {axes.get_xscale(), axes.get_yscale()} <= KINDS


def along(one: Artist, axes: Axes) -> str:
    """The axes in whose values it is drawn: "xy", "x", "y" or none."""
    transform = one.get_offset_transform() if isinstance(one, PathCollection) else one.get_transform()
    in_x, in_y = transform.contains_branch_seperately(axes.transData)
    return "x" * in_x + "y" * in_y


def described(place: int, axes: Axes, figure: Figure) -> dict[str, object]:
    """One set of a figure's axes. box: left, top, width and height [pt]."""
    wide, high = 72.0 * figure.get_size_inches()
    box = axes.get_window_extent().transformed(figure.transFigure.inverted())
    labels = (one.get_xlabel() for one in (axes, *axes.get_shared_x_axes().get_siblings(axes)))  # whose numbers it shares
    return {
        "id": f"axes{place}",
        "box": [round(float(one), 3) for one in (box.x0 * wide, (1.0 - box.y1) * high, box.width * wide, box.height * high)],
        "x": scale(axes.xaxis),
        "y": scale(axes.yaxis),
        "across": as_text(next(filter(None, labels), "")),
        "up": as_text(axes.get_ylabel()),
        "ours": not axes.images and not any(isinstance(one, QuadMesh) for one in axes.collections),
        "curves": [{"id": one.get_gid(), "name": name(one)} for one in curves(axes)],
        "bars": [bar(*one) for one in bars(axes)],
        "spots": [spot(axes, one, figure) for one in SPOTS.get(axes, [])],
        "drawn": [{"id": one.get_gid(), "along": along(one, axes)} for one in plotted_artists(axes)],
    }


def spot(axes: Axes, one: ToldPlace, figure: Figure) -> list[object]:
    """A spot: left, top, width and height [pt], name, and what is said of it."""
    wide, high = 72.0 * figure.get_size_inches()
    corners = (axes.transData + figure.transFigure.inverted()).transform([(one.left, one.bottom), (one.right, one.top)])
    (left, right), (bottom, top) = sorted(wide * corners[:, 0]), sorted(high * corners[:, 1])
    box = [round(float(value), 1) for value in (left, high - top, right - left, top - bottom)]
    return [*box, one.name, [list(row) for row in one.said]]


def bar(container: BarContainer, one: Rectangle, words: str) -> dict[str, object]:
    """A bar: where it begins and ends, and along which axis."""
    flat = container.orientation == "horizontal"
    low, size = (one.get_x(), one.get_width()) if flat else (one.get_y(), one.get_height())
    return {"id": one.get_gid(), "name": words, "along": "x" if flat else "y", "low": float(low), "high": float(low + size)}


def scale(axis: Axis) -> dict[str, object]:
    """Ends and kind of an axis, and between them the ends of what it shows; none where words or a list stand along it."""
    low, high = map(float, axis.get_view_interval())
    edge = float(getattr(axis.get_transform(), "linthresh", 0.0))
    first, last = sorted((low, high))
    ends = (min(max(float(one), first), last) for one in sorted(axis.get_data_interval()))
    shown = [one if abs(one) > 1e-12 * (last - first) else 0.0 for one in ends]
    listed = isinstance(axis.get_major_formatter(), FixedFormatter)
    return {"low": low, "high": high, "kind": axis.get_scale(), "edge": edge, "data": [] if listed else shown}


def as_text(text: str) -> str:
    """A label without mathtext but for what stands below: x_{d}."""
    return MATH.sub(lambda match: match[1] or match[2] or "", text.replace("\n", " "))

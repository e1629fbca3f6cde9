"""What the script of reports (`frontend/src/report`) needs to read values off a figure: its axes, told in its SVG."""

import json
import re
from html import escape

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

KINDS = frozenset(("linear", "log", "symlog"))
"""Scales that it knows."""

GRID = "grid"
"""Begins the names of the lines of a grid that are no ticks."""

MATH = re.compile(r"\\mathrm\{([^}]*)\}|\\(?:dot|ddot|tilde|hat)\{([^}]*)\}|\$")


def mark(figure: Figure) -> None:
    """Name axes and curves in the SVG to come."""
    for place, axes in enumerate(figure.axes):
        axes.set_gid(f"axes{place}")
        for number, line in enumerate(curves(axes)):
            line.set_gid(f"curve{place}.{number}")


def told(svg: str, figure: Figure) -> str:
    """The SVG of a marked figure, just drawn, with what is known of its axes; its links open in the same window."""
    svg = svg.replace(' target="_blank"', "")
    known = [described(place, axes) for place, axes in enumerate(figure.axes) if readable(axes)]
    if not known:
        return svg
    content = escape(json.dumps(known, separators=(",", ":"), ensure_ascii=False, allow_nan=False))
    return svg.replace("<svg ", f'<svg data-axes="{content}" ', 1)


def curves(axes: Axes) -> list[Line2D]:
    """Those with values: a lone point, or a line across all of the axes, is a mark."""
    sizes = [(line, np.asarray(line.get_xdata()).size) for line in axes.lines]
    return [line for line, size in sizes if size > 2 or (size == 2 and named(line))]


def named(line: Line2D) -> bool:
    """Whether it is in a legend."""
    return not str(line.get_label()).startswith("_")


def readable(axes: Axes) -> bool:
    """Whether it has curves, on scales that are known."""
    return axes.get_visible() and bool(curves(axes)) and {axes.get_xscale(), axes.get_yscale()} <= KINDS


def described(place: int, axes: Axes) -> dict[str, object]:
    """One set of axes. box: left, top, width and height [pt]."""
    figure = axes.figure.get_figure(root=True)
    assert figure is not None
    wide, high = 72.0 * figure.get_size_inches()
    box = axes.get_window_extent().transformed(figure.transFigure.inverted())
    return {
        "id": f"axes{place}",
        "box": [round(float(one), 3) for one in (box.x0 * wide, (1.0 - box.y1) * high, box.width * wide, box.height * high)],
        "x": scale(axes.xaxis),
        "y": scale(axes.yaxis),
        "across": plain(axes.get_xlabel()) or shared_label(axes),
        "up": plain(axes.get_ylabel()),
        "ours": all(str(one.get_gid()).startswith(GRID) for one in axes.collections),
        "curves": [
            {"id": f"curve{place}.{number}", "name": plain(str(line.get_label())) if named(line) else ""}
            for number, line in enumerate(curves(axes))
        ],
    }


def shared_label(axes: Axes) -> str:
    """Of the axes whose numbers it shares."""
    found = [plain(one.get_xlabel()) for one in axes.get_shared_x_axes().get_siblings(axes) if one.get_xlabel()]
    return found[0] if found else ""


def scale(axis: Axis) -> dict[str, object]:
    """Ends and kind of an axis."""
    low, high = map(float, axis.get_view_interval())
    edge = float(getattr(axis.get_transform(), "linthresh", 0.0))
    return {"low": low, "high": high, "kind": axis.get_scale(), "edge": edge}


def plain(text: str) -> str:
    """A label without mathtext but for what stands below: x_{d}."""
    return MATH.sub(lambda match: match[1] or match[2] or "", text.replace("\n", " "))

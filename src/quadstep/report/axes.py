"""Axes with plain numbers: no offset, no exponent aside, and a scale on which all of a line can be seen."""

from collections.abc import Sequence

import numpy as np
from matplotlib import rcParams
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.ticker import (
    FixedLocator,
    Formatter,
    FuncFormatter,
    LogFormatter,
    LogLocator,
    MaxNLocator,
    NullFormatter,
    NullLocator,
)
from numpy.typing import NDArray

from quadstep.report.units import power_of_ten

Numbers = NDArray[np.float64]

PEAK = 20.0
"""A peak this many times what a line keeps below for `CALM` of the time flattens the rest of it."""

CALM = 0.97

MOST_DECADES = 4
"""Of a signed logarithmic axis, on either side."""

DEEPEST = 8
"""Most decades of a logarithmic axis."""

STEADY, ROOM = 1e-3, 0.02
"""A line that varies by less than this share of its size is shown with that much room around it."""

TICK = 0.16
"""Between the ticks of an axis [in], at least."""

STEPS = [1, 2, 2.5, 5, 10]
"""Between ticks, times a power of ten."""

CLEAR = {"facecolor": "white", "alpha": 0.8, "linewidth": 0.0, "pad": 0.8}
"""Behind text that stands on what is drawn."""


def plain() -> FuncFormatter:
    """Numbers as they are, with a power of ten where they are too small to be written out."""

    def written(value: float, _: object) -> str:
        digits, e, exponent = f"{value:.10g}".replace("-", "−").partition("e")
        return f"{digits}×{power_of_ten(int(exponent.replace('−', '-')))}" if e else digits

    return FuncFormatter(written)


def power(value: float, short: bool) -> str:
    """A power of ten; written out where its axis is short, and where it is 1 or 10."""
    exponent = round(np.log10(abs(value)))
    text = f"{abs(value):g}" if short or exponent in (0, 1) else power_of_ten(exponent)
    return f"−{text}" if value < 0.0 else text


class Powers(Formatter):
    """Powers of ten along an axis: all written out if all that are seen are short, else none."""

    def __init__(self) -> None:
        self.ticks: list[float] = []

    def set_locs(self, locs: Sequence[float]) -> None:
        self.ticks = list(locs)

    def __call__(self, value: float, _: object = None) -> str:
        low, high = sorted(self.axis.get_view_interval()) if self.axis else (-np.inf, np.inf)
        seen = [abs(one) for one in self.ticks if one and low <= one <= high]
        return power(value, all(SHORTEST <= one <= LONGEST for one in seen)) if value else "0"


SHORTEST, LONGEST = 0.999e-3, 1.001e3
"""Powers of ten that are short when written out."""


def linear(axes: Axes, lines: Sequence[Numbers]) -> None:
    """A linear axis, wide enough that a constant line looks constant."""
    low = min((float(values.min()) for values in lines), default=0.0)
    high = max((float(values.max()) for values in lines), default=0.0)
    size = max(abs(low), abs(high))
    if high - low < STEADY * size:
        middle = 0.5 * (low + high)
        axes.set_ylim(middle - ROOM * size, middle + ROOM * size)
    ticked(axes.yaxis, 4)


def ticked(axis: Axis, most: int) -> None:
    """About so many steps, at round numbers as they are."""
    axis.set_major_locator(MaxNLocator(most, steps=STEPS))
    axis.set_major_formatter(plain())


def logarithmic(axes: Axes, lines: Sequence[Numbers]) -> None:
    """A logarithmic axis for values that are not negative; zeros fall below it."""
    above = np.concatenate([values[values > 0.0] for values in lines]) if lines else np.zeros(0)
    if not above.size:
        linear(axes, lines)
        return
    high = float(above.max())
    low = max(float(above.min()), high * 10.0**-DEEPEST)
    axes.set_yscale("log")
    room = (high / low) ** 0.06 if high > 1.3 * low else 1.3
    axes.set_ylim(low / room, high * room)
    decades = np.log10(high / low) + 2.0 * np.log10(room)
    axis: Axis = axes.yaxis
    if decades < 1.5:
        plain_decades(axis)
        return
    powers(axis, 5)


def peaked(lines: Sequence[Numbers]) -> bool:
    """Whether a short peak flattens all the rest of the lines."""
    sizes = [np.abs(values) for values in lines if len(values) > 2]
    if not sizes:
        return False
    calm = max(float(np.quantile(size, CALM)) for size in sizes)
    return calm > 0.0 and max(float(size.max()) for size in sizes) > PEAK * calm


def threshold(lines: Sequence[Numbers]) -> float:
    """Up to where a signed logarithmic axis is linear: a power of ten that most of the time is not above, with what is."""
    sizes = [np.abs(values) for values in lines]
    largest = max(float(size.max()) for size in sizes)
    often = max(float(np.quantile(size, 0.5)) for size in sizes)
    return float(10.0 ** np.ceil(np.log10(max(often, largest * 10.0**-MOST_DECADES))))


def signed_logarithmic(axes: Axes, lines: Sequence[Numbers]) -> None:
    """An axis that is linear about zero, in a grey band, and logarithmic beyond; it says so."""
    if not any(np.any(values) for values in lines):
        linear(axes, lines)
        return
    edge = threshold(lines)
    low, high = min(float(values.min()) for values in lines), max(float(values.max()) for values in lines)
    axes.set_yscale("symlog", linthresh=edge, linscale=1.0)
    axes.set_ylim(min(1.6 * low, -0.3 * edge), max(1.6 * high, 0.3 * edge))
    axes.axhspan(-edge, edge, color="0.95", linewidth=0.0, zorder=0.1)
    up = [edge * 10.0**k for k in range(12) if edge * 10.0**k <= 1.6 * high]
    down = [-edge * 10.0**k for k in range(12) if edge * 10.0**k <= -1.6 * low]
    decades = sum(1.0 + max(0.0, np.log10(max(end, 1e-300) / edge)) for end in np.abs(axes.get_ylim()))
    room = axes.bbox.height / axes.figure.dpi / decades
    every = max(1, -(-(len(up) + len(down)) // 5), int(np.ceil(TICK / room)))
    seen = [side[i] for side in (down, up) for i in range(len(side) - 1, every - 2, -every)]  # the outermost always
    axis, ticks, written = axes.yaxis, [0.0, *seen], Powers()
    axis.set_major_locator(FixedLocator(ticks))
    axis.set_major_formatter(written)
    written.set_locs(ticks)
    axis.set_minor_locator(NullLocator())
    right, high = emptiest_corner(axes)
    axes.text(
        0.98 if right else 0.02, 0.98 if high else 0.02, f"linear within ±{written(edge)}", transform=axes.transAxes,
        ha="right" if right else "left", va="top" if high else "bottom", fontsize=rcParams["legend.fontsize"], color="0.35",
        bbox=CLEAR,
    )  # fmt: skip


def emptiest_corner(axes: Axes) -> tuple[int, int]:
    """The corner with the least of the lines: 0 or 1 from left to right, and from the bottom up."""

    def behind(corner: tuple[int, int]) -> int:
        ends = axes.transAxes.transform(
            [(0.6 * corner[0], 0.76 * corner[1]), (0.6 * corner[0] + 0.4, 0.76 * corner[1] + 0.24)]
        )
        return crossed(axes, *ends.T)

    return min(((1, 0), (0, 0), (1, 1), (0, 1)), key=behind)


def crossed(axes: Axes, across: Numbers, high: Numbers) -> int:
    """How much of the curves is in a box, whose ends are in pixels."""
    places = np.linspace(across[0], across[1], 100)
    lines = [axes.transData.transform(np.asarray(one.get_xydata())) for one in axes.lines if np.size(one.get_xdata()) > 2]
    inside = [(np.interp(places, *one.T) > high[0]) & (np.interp(places, *one.T) < high[1]) for one in lines]
    return sum(int(one.sum()) for one in inside)


def logarithmic_time(axes: Axes, t: Numbers) -> None:
    """Time on a logarithmic axis, from the first sample after the start on."""
    first = float(t[t > 0.0][0])
    axes.set_xscale("log")
    axes.set_xlim(first, float(t[-1]))
    powers(axes.xaxis)


def powers(axis: Axis, ticks: int | None = None) -> None:
    """Ticks of a logarithmic axis at powers of ten, about so many."""
    axis.set_major_locator(LogLocator(10.0, (1.0,), numticks=ticks))
    axis.set_major_formatter(Powers())
    axis.set_minor_locator(NullLocator())


def typeset_decades(axes: Axes) -> None:
    """Powers of ten as such where nobody chose how ticks are written: Matplotlib's own are TeX, which is not read here."""
    for axis in (axes.xaxis, axes.yaxis):
        if isinstance(axis.get_major_formatter(), LogFormatter):
            axis.set_major_formatter(Powers())
        if isinstance(axis.get_minor_formatter(), LogFormatter):
            axis.set_minor_formatter(NullFormatter())


SHORT, DENSE = 3.0, 6.0
"""Times its low end: a logarithmic axis up to there has even ticks, or more than 1, 2 and 5, of which it may hold but one."""


def plain_decades(axis: Axis) -> None:
    """Ticks of a logarithmic axis, whose ends are known, as plain numbers: at 1, 2 and 5, more densely where it is short."""
    low, high = sorted(axis.get_view_interval())
    short = not 0.0 < SHORT * low < high
    subs = (1.0, 2.0, 5.0) if high > DENSE * low else (1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0)
    axis.set_major_locator(MaxNLocator(5, steps=STEPS) if short else LogLocator(10.0, subs))
    axis.set_major_formatter(plain())
    axis.set_minor_locator(NullLocator())


GRID = "grid"
"""Begins the names of the lines of a grid that are no ticks."""

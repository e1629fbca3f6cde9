"""Axes whose numbers are whole: no offset, no exponent aside, and a scale on which all of a line can be seen."""

from collections.abc import Sequence

import numpy as np
from matplotlib import rcParams
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.ticker import FixedLocator, FuncFormatter, LogFormatter, LogLocator, MaxNLocator, NullFormatter, NullLocator
from numpy.typing import NDArray

from quadstep.report.symbols import power_of_ten

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

STEPS = [1, 2, 2.5, 5, 10]
"""Between ticks, times a power of ten."""


def plain() -> FuncFormatter:
    return FuncFormatter(lambda value, _: f"{value:.10g}".replace("-", "−"))


def power(value: float) -> str:
    """A power of ten: written out where that is short."""
    exponent = round(np.log10(abs(value))) if value else 0
    text = f"{abs(value):g}" if -3 <= exponent <= 3 else power_of_ten(exponent)
    return f"−{text}" if value < 0.0 else text


def powers() -> FuncFormatter:
    return FuncFormatter(lambda value, _: power(value) if value else "0")


def linear(axes: Axes, lines: Sequence[Numbers]) -> None:
    """A linear axis, wide enough that a constant line looks constant."""
    low = min((float(values.min()) for values in lines), default=0.0)
    high = max((float(values.max()) for values in lines), default=0.0)
    size = max(abs(low), abs(high))
    if high - low < STEADY * size:
        middle = 0.5 * (low + high)
        axes.set_ylim(middle - ROOM * size, middle + ROOM * size)
    axes.yaxis.set_major_locator(MaxNLocator(4, steps=STEPS))
    axes.yaxis.set_major_formatter(plain())


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
        axis.set_major_locator(LogLocator(10.0, (1.0, 2.0, 5.0)))
        axis.set_major_formatter(plain())
    else:
        axis.set_major_locator(LogLocator(10.0, (1.0,), numticks=5))
        axis.set_major_formatter(powers())
    axis.set_minor_locator(NullLocator())


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
    every = max(1, -(-(len(up) + len(down)) // 5))
    axis: Axis = axes.yaxis
    axis.set_major_locator(FixedLocator([*down[::every], 0.0, *up[::every]]))
    axis.set_major_formatter(powers())
    axis.set_minor_locator(NullLocator())
    axes.text(
        0.995, 0.97, f"linear within ±{power(edge)}, logarithmic beyond", transform=axes.transAxes, ha="right", va="top",
        fontsize=rcParams["legend.fontsize"], color="0.35",
    )  # fmt: skip


def logarithmic_time(axes: Axes, t: Numbers) -> None:
    """Time on a logarithmic axis, from the first sample after the start on."""
    first = float(t[t > 0.0][0])
    axes.set_xscale("log")
    axes.set_xlim(first, float(t[-1]))
    axis: Axis = axes.xaxis
    axis.set_major_locator(LogLocator(10.0, (1.0,)))
    axis.set_major_formatter(powers())
    axis.set_minor_locator(NullLocator())


def typeset_decades(axes: Axes) -> None:
    """Powers of ten as such where nobody chose how ticks are written: Matplotlib's own are TeX, which is not read here."""
    for axis in (axes.xaxis, axes.yaxis):
        if isinstance(axis.get_major_formatter(), LogFormatter):
            axis.set_major_formatter(powers())
        if isinstance(axis.get_minor_formatter(), LogFormatter):
            axis.set_minor_formatter(NullFormatter())


def plain_decades(axis: Axis) -> None:
    """Ticks of a logarithmic axis as plain numbers at 1, 2 and 5."""
    axis.set_major_locator(LogLocator(10.0, (1.0, 2.0, 5.0)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_locator(NullLocator())

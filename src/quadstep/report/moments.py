"""What happens in a flight, marked on the time axes of its figures: a line, or an area for what lasts, and a word above it."""

from collections.abc import Sequence

from matplotlib import rcParams
from matplotlib.axes import Axes

from quadstep.report.canvas import LETTER
from quadstep.report.panel import EventMark

ROW, SIZE, GAP, MOST_ROWS = 11.0, 8.5, 5.0, 2
"""Height of a row of words, size of their letters and room between words [pt]; most rows above axes."""


def named(moments: Sequence[EventMark], low: float, high: float, across: float) -> list[tuple[EventMark, int, float]]:
    """The words that have room above axes from `low` to `high` [s], `across` [in] wide, those that matter most first: the row
    of each, 0 the lowest, and where it begins [pt].
    """
    found: list[tuple[EventMark, int, float]] = []
    wide = 72.0 * across
    for one in moments:
        length = LETTER * SIZE * len(one.word)
        begin = min(wide * (one.time - low) / (high - low), wide - length)
        for row in range(MOST_ROWS) if one.word and low <= one.time <= high else ():
            others = [(at, LETTER * SIZE * len(other.word)) for other, place, at in found if place == row]
            if all(begin + length + GAP <= at or at + size + GAP <= begin for at, size in others):
                found.append((one, row, begin))
                break
    return found


def rows_above(moments: Sequence[EventMark], low: float, high: float, across: float) -> int:
    """How many rows of words there are above such axes."""
    return 1 + max((row for _, row, _ in named(moments, low, high, across)), default=-1)


def mark(axes: Axes, moments: Sequence[EventMark], words: bool = True) -> None:
    """Lines and areas in axes over time, behind all curves. words: whether they are named too, above the axes."""
    low, high = axes.get_xlim()
    across = axes.bbox.width / axes.figure.dpi
    for one in moments:
        if one.word and low <= one.time <= high:
            if one.until > one.time:
                axes.axvspan(one.time, min(one.until, high), color="0.5", alpha=0.13, linewidth=0.0, zorder=0.2)
            axes.axvline(one.time, color="0.45", linewidth=0.7, linestyle=(0, (4, 3)), zorder=0.6)
    axes.set_xlim(low, high)
    for one, row, begin in named(moments, low, high, across) if words else ():
        axes.annotate(
            one.word, (begin / (72.0 * across), 1.0), (0.0, 2.0 + ROW * row), "axes fraction", "offset points",
            color="0.35", fontsize=rcParams["legend.fontsize"], va="bottom",
        )  # fmt: skip

"""What happens in a flight, on the time axes of its figures: lines where it begins and ends; above, its word over a strip as
long as it lasts.
"""

from collections.abc import Sequence

from matplotlib import rcParams
from matplotlib.axes import Axes
from matplotlib.transforms import ScaledTranslation

from quadstep.report.canvas import LETTER
from quadstep.report.panel import EventMark

ROW, STRIP, SIZE, GAP, MOST_ROWS = 14.0, 2.5, 8.5, 5.0, 2
"""Height of a row of words, of a strip, size of letters and room between words [pt]; most rows, but for what lasts."""


def named(moments: Sequence[EventMark], low: float, high: float, across: float) -> list[tuple[EventMark, int, float]]:
    """The words that have room above axes from `low` to `high` [s], `across` [in] wide, those that matter most first: the row
    of each, 0 the lowest, and where it begins [pt].
    """
    found: list[tuple[EventMark, int, float]] = []
    wide = 72.0 * across
    taken: list[tuple[int, float, float]] = []
    for one in moments:
        length, lasts = LETTER * SIZE * len(one.word), wide * (min(one.until, high) - one.time) / (high - low)
        begin = min(wide * (one.time - low) / (high - low), wide - length)
        end = begin + max(length, lasts)
        for row in range(MOST_ROWS + 2 * (lasts > 0.0)) if one.word and one.named and low <= one.time <= high else ():
            if all(end + GAP <= first or last + GAP <= begin for place, first, last in taken if place == row):
                taken.append((row, begin, end))
                found.append((one, row, begin))
                break
    return found


def rows_above(moments: Sequence[EventMark], low: float, high: float, across: float) -> int:
    """How many rows of words there are above such axes."""
    return 1 + max((row for _, row, _ in named(moments, low, high, across)), default=-1)


def mark(axes: Axes, moments: Sequence[EventMark], words: bool = True) -> None:
    """Lines where something begins or ends, behind all curves. words: whether words and strips stand above the axes."""
    low, high = axes.get_xlim()
    across = axes.bbox.width / axes.figure.dpi
    for one in moments:
        for edge in {one.time, max(one.time, one.until)} if one.word else ():
            if low <= edge <= high:
                axes.axvline(edge, color="0.6", linewidth=0.7, linestyle=(0, (4, 3)), zorder=0.6)
    axes.set_xlim(low, high)
    for one, row, begin in named(moments, low, high, across) if words else ():
        if one.until > one.time:
            raised = ScaledTranslation(0.0, (0.5 * STRIP + 1.0 + ROW * row) / 72.0, axes.figure.dpi_scale_trans)
            along = axes.get_xaxis_transform() + raised
            axes.hlines(1.0, one.time, min(one.until, high), "0.6", linewidth=STRIP, transform=along, clip_on=False)
        axes.annotate(
            one.word, (begin / (72.0 * across), 1.0), (0.0, STRIP + 2.0 + ROW * row), "axes fraction", "offset points",
            color="0.35", fontsize=rcParams["legend.fontsize"], va="bottom",
        )  # fmt: skip

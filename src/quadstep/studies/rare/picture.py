"""The figure of an estimate: how the probability falls as the score rises, in each replicate."""

from collections.abc import Sequence
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.ticker import AsinhLocator, NullLocator

from quadstep.report.axes import powers
from quadstep.report.canvas import drawing, margins, new_figure, write
from quadstep.report.sheet import Sheet
from quadstep.report.units import metric
from quadstep.studies.campaign.pictures import logarithmic
from quadstep.studies.rare.done import Done
from quadstep.studies.rare.pieces import Kind

OWN, OTHER, END = "black", "#2166ac", "#b2182b"

FAR, LINEAR = 30.0, 3.0
"""Largest score for an all-linear axis, and the end of its linear part otherwise: scores of unstable loops can be huge."""


def draw_levels(path: Path, pieces: Sequence[Done], sheet: Sheet) -> None:
    """A panel for each kind of failure: the probability beyond each score, in replicates and second opinions."""
    names = list(dict.fromkeys(event.failure for one in pieces for event in one.events))
    with drawing(sheet):
        columns = sheet.side_by_side(len(names), 2.4)
        figure = new_figure(sheet, 0.6 + 4.2 * len(names), 3.9, 3.0 * -(-len(names) // columns))
        figure.subplots(-(-len(names) // columns), columns, squeeze=False, sharey=True)
        margins(figure, sheet, 0.75 / (0.6 + 4.2 * len(names)), 0.13, 0.97, 0.91, 0.12, 0.3)
        for place, axes in enumerate(figure.axes):
            if place >= len(names):
                axes.set_axis_off()
                continue
            draw_event(axes, names[place], pieces)
            logarithmic(axes, "y")
            axes.set_title(f"failure: {names[place]}", loc="left", fontsize=9)
            axes.set_ylabel("" if place % columns else "probability")
        write(figure, path, sheet)


def draw_event(axes: Axes, name: str, pieces: Sequence[Done]) -> None:
    """One panel: lines over the score, a cross at the right for failure itself."""
    scores: dict[str, None] = {}
    for one in pieces:
        for event in (event for event in one.events if event.failure == name):
            own = one.kind == Kind.REPLICATE.value
            colour, line = (OWN, "-") if own else (OTHER, "--")
            steps = [(threshold, share) for threshold, share in event.levels if threshold is not None and share > 0.0]
            axes.plot(
                [x for x, _ in steps],
                [y for _, y in steps],
                marker=".",
                markersize=4,
                color=colour,
                linewidth=0.8,
                linestyle=line,
            )
            if event.probability > 0.0:
                colour, place = END if own else OTHER, axes.get_yaxis_transform()
                axes.plot([0.985], [event.probability], "x", color=colour, transform=place, clip_on=False)
            scores |= dict.fromkeys(event.score)
    if max(map(abs, axes.get_xlim())) > FAR:
        axes.set_xscale("asinh", linear_width=LINEAR)
        axes.xaxis.set_major_locator(AsinhLocator(LINEAR, numticks=5))
        axes.xaxis.set_minor_locator(NullLocator())
        axes.xaxis.set_major_formatter(powers())
    axes.margins(x=0.15)
    only = next(iter(scores), "")
    axes.set_xlabel(f"score: {metric(only)[0]}" if len(scores) == 1 else f"score: largest of {len(scores)} metrics")

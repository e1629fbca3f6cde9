"""report.html of an envelope."""

from html import escape
from pathlib import Path

from quadstep.report import page, units
from quadstep.studies.envelope.axes import shown
from quadstep.studies.envelope.cells import FLYABLE
from quadstep.studies.envelope.found import Envelope, Panel


def write_report(path: Path, found: Envelope, figure: str) -> None:
    """Write it beside the map. figure: its file, without ending."""
    asked, drawn = found.asked, page.figure(path.parent / figure, caption(found), coded=True)
    body = [
        page.summary(answer(found), [fact(one) for one in found.panels], [drawn]),
        page.heading("Panel by panel", "panels"),
        page.table(
            ("panel", "cells", "flyable", "success rate", "RMSE of flyable cells", "outcomes of failed flights"),
            [row(one) for one in found.panels],
        ),
        page.heading("Settings", "flown"),
        page.table(
            ("", ""),
            [
                ("mission", str(asked.campaign.defaults["name"])),
                *(
                    (axis.key, f"{len(axis.values)} values from {shown(axis.values[0])} to {shown(axis.values[-1])}")
                    for axis in reversed(asked.axes)
                ),
                ("flights per cell", str(asked.flights)),
                (
                    "a flight fails",
                    "if it ends early"
                    + "".join(
                        f", or {units.metric(asked.campaign.thresholds[name])[0]} above {limit:g}"
                        for name, limit in asked.campaign.file.failure.items()
                    ),
                ),
                ("a cell counts as flyable", f"if at least {100 * FLYABLE:g} % of its flights succeed"),
                ("results of every cell", "envelope.parquet"),
            ],
            escape,
        ),
    ]
    page.write_page(path, f"Envelope of {asked.campaign.defaults['name']}", body, "Envelope")


def answer(found: Envelope) -> str:
    """How much of the map can be flown, in a sentence."""
    asked = found.asked
    over = f"combination{'' if max(one.cells for one in found.panels) == 1 else 's'} of {asked.x.key} and {asked.y.key}"
    if all(one.flyable == one.cells for one in found.panels):
        return f"Every one of the {found.panels[0].cells} {over} can be flown, so the limit lies outside this map."
    parts = [f"{one.flyable} of {one.cells}{f' with {one.name}' if one.name else ''}" for one in found.panels]
    return f"Of the {over}, {', '.join(parts)} can be flown."


def caption(found: Envelope) -> str:
    """What the map shows."""
    return f"{found.asked.y.key} over {found.asked.x.key}: flyable region, coloured by the median position RMSE"


def fact(one: Panel) -> page.Fact:
    """The flyable share of a panel."""
    return page.Fact(one.name or "flyable", units.percent(one.flyable / one.cells), f"{one.flyable} of {one.cells} cells")


def row(one: Panel) -> list[str]:
    """A panel in numbers."""
    causes = ", ".join(f"{name} {count}" for name, count in one.causes.items())
    rmse = f"{units.quantity(one.rmse[0], 'm')} to {units.quantity(one.rmse[1], 'm')}" if one.rmse else "–"
    return [one.name or "the map", str(one.cells), str(one.flyable), units.percent(one.success), rmse, causes or "–"]

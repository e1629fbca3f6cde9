"""Real flights beside simulated ones on a page: what was wanted, what was flown, what the simulation flew."""

from collections.abc import Sequence
from html import escape
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from quadstep.atomic import write_beside
from quadstep.identify.closed_loop import Beside, Tracking
from quadstep.report.drawing import FigureJob
from quadstep.report.page import figure, heading, page_text, paragraph, table
from quadstep.report.panel import Panel
from quadstep.report.sheet import Sheet

SVG = Sheet(formats=("svg",))


def write(path: Path, found: Sequence[Beside], controller: str) -> None:
    """Write the page. Raises UserError."""
    write_beside(path, page_text("Real and simulated flights", sections(found, controller), "Replay"))


def sections(found: Sequence[Beside], controller: str) -> list[str]:
    """Each flight with its figure and how it follows its setpoints."""
    parts = [paragraph(f"Logged setpoints flown again under {controller}, from the measured state on.")]
    for place, one in enumerate(found):
        parts.append(heading(f"{one.name}, flown again", f"{one.name}-again", escape))
        if one.lost:
            parts.append(paragraph(f"The simulated flight ended: {one.lost}."))
        rows = [(who, *numbers(tracking)) for who, tracking in (("real", one.real), ("simulated", one.simulated))]
        parts.append(table(("", "RMSE [cm]", "lead [ms]", "tilt, 99 % [deg]", "mean rate [rad/s]"), rows))
        lines = {"setpoint": one.setpoint, "real": one.real_position, "simulated": one.flown_position}
        panels = [Panel(name, "m", {key: values[:, i] for key, values in lines.items()}) for i, name in enumerate("xyz")]
        job = FigureJob(f"again{place}", "", one.time, panels)
        parts.append(drawn(job, "Setpoint, real and simulated position"))
    return parts


def drawn(job: FigureJob, caption: str) -> str:
    """A figure, inline."""
    with TemporaryDirectory() as folder:
        job.draw(Path(folder), SVG)
        return figure(Path(folder) / f"{job.name}.svg", caption)


def numbers(one: Tracking) -> tuple[str, str, str, str]:
    """How a flight follows its setpoints, as text."""
    return f"{100 * one.rmse:.1f}", f"{1e3 * one.lead:.0f}", f"{np.degrees(one.tilt):.1f}", f"{one.rate:.2f}"

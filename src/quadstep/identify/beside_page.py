"""Parts of a report on real flights beside simulated ones: the setpoints, the real flight, the simulated flight."""

from collections.abc import Sequence
from html import escape
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from quadstep.identify.closed_loop import Beside, Tracking
from quadstep.report.drawing import FigureJob
from quadstep.report.page import figure, heading, paragraph, table
from quadstep.report.panel import Panel
from quadstep.report.sheet import Sheet
from quadstep.report.units import counted, quantity

SVG = Sheet(formats=("svg",))


def answer(found: Sequence[Beside]) -> str:
    """How similar they are, in a sentence: equal errors need not be the same ones, so how far apart the flights are too."""
    near = sum(0.5 <= one.simulated.rmse / one.real.rmse <= 2.0 for one in found if not one.lost)
    apart = [one.apart for one in found if not one.lost]
    said = f"The simulated RMSE is within a factor of two of the real one in {near} of {counted(len(found), 'flight')}"
    if not apart:
        return f"{said}: all simulated flights were lost."
    span = " to ".join(dict.fromkeys(quantity(one, "m") for one in (min(apart), max(apart))))
    lost = f"; {len(found) - len(apart)} were lost" if len(apart) < len(found) else ""
    return f"{said}, and the simulated position is {span} from the real one (RMS){lost}."


def sections(found: Sequence[Beside], controller: str, pictures: Sequence[str]) -> list[str]:
    """Each flight with its figure, if that is not shown elsewhere, and how it follows its setpoints."""
    parts = []
    for place, (one, picture) in enumerate(zip(found, pictures, strict=True)):
        parts.append(heading(f"{one.name}, simulated", f"{one.name}-again", escape))
        if not place:
            parts.append(paragraph(f"Logged setpoints simulated with {controller}, starting from the measured state."))
        if one.lost:
            parts.append(paragraph(f"The simulated flight ended: {one.lost}."))
        rows = [(who, *numbers(tracking)) for who, tracking in (("real", one.real), ("simulated", one.simulated))]
        parts += [table(("", "RMSE [cm]", "lead [ms]", "tilt, 99 % [°]", "mean rate [rad/s]"), rows), picture]
    return parts


def flight_picture(one: Beside, place: int) -> tuple[FigureJob, str]:
    """The figure of a flight, and its caption. place: of the flight among the others."""
    lines = {"setpoint": one.setpoint, "real": one.real_position, "simulated": one.flown_position}
    reach = max(float(np.abs(values).max(initial=0.0)) for values in lines.values())
    panels = [
        Panel(name, "m", {key: values[:, i] for key, values in lines.items()}, reach=reach) for i, name in enumerate("xyz")
    ]
    return FigureJob(f"again{place}", "", one.time, panels), f"{one.name}: setpoint, real and simulated position"


def drawn(job: FigureJob, caption: str) -> str:
    with TemporaryDirectory() as folder:
        return drawn_in(Path(folder), job, caption, SVG)


def drawn_in(folder: Path, job: FigureJob, caption: str, sheet: Sheet) -> str:
    """The same, kept in a folder. The caption has names of files, not symbols."""
    job.draw(folder, sheet)
    return figure(folder / job.name, caption, set_as=escape)


def numbers(one: Tracking) -> tuple[str, str, str, str]:
    """How a flight follows its setpoints, as text."""
    return f"{100 * one.rmse:.1f}", f"{1e3 * one.lead:.0f}", f"{np.degrees(one.tilt):.1f}", f"{one.rate:.2f}"

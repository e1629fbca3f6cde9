"""Parts of a report on real flights beside simulated ones: the setpoints, the real flight, the simulated flight."""

from collections.abc import Sequence
from html import escape
from pathlib import Path

import numpy as np

from quadstep.identify.closed_loop import Beside, Tracking
from quadstep.io.results.record import FIGURES
from quadstep.report.drawing import FigureJob
from quadstep.report.evidence import Figure, Table
from quadstep.report.panel import Panel
from quadstep.report.sheet import Sheet
from quadstep.report.units import counted, number, quantity

HEADER = ("real / simulated", "RMSE [cm]", "lead [ms]", "tilt, 99 % [°]", "mean rate [rad/s]", "lost")


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


def table(found: Sequence[Beside], controller: str) -> Table:
    """How each flight, and its simulation, follows its setpoints."""
    rows = [
        (one.name, *map(" / ".join, zip(numbers(one.real), numbers(one.simulated), strict=True)), one.lost) for one in found
    ]
    title = f"Logged setpoints simulated with {controller}"
    text = f"{title}, starting from the measured state."
    return Table("Real and simulated flights", "simulated", HEADER, rows, text, escape, shown=title)


def flight_picture(one: Beside, place: int) -> FigureJob:
    """The figure of a flight. place: of the flight among the others."""
    lines = {"setpoint": one.setpoint, "real": one.real_position, "simulated": one.flown_position}
    reach = max(float(np.abs(values).max(initial=0.0)) for values in lines.values())
    panels = [
        Panel(name, "m", {key: values[:, i] for key, values in lines.items()}, reach=reach) for i, name in enumerate("xyz")
    ]
    apart = f"the simulation was lost: {one.lost}" if one.lost else f"they are {quantity(one.apart, 'm')} apart (RMS)"
    return FigureJob(
        f"{FIGURES}/again{place}", f"{one.name}: setpoint, real and simulated position; {apart}.", one.time, panels
    )


def drawn(out: Path, job: FigureJob, sheet: Sheet) -> Figure:
    """A figure in the folder of a report. Its caption has names of files, not symbols."""
    job.draw(out, sheet)
    return Figure(job.name, job.caption, set_as=escape)


def numbers(one: Tracking) -> tuple[str, str, str, str]:
    """How a flight follows its setpoints, as text."""
    cm, ms, degrees, rate = map(number, (100 * one.rmse, 1e3 * one.lead, np.degrees(one.tilt), one.rate))
    return cm, ms, degrees, rate

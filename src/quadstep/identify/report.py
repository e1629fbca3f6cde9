"""The report of an identification as an HTML page: the parameters, how well they predict, the residuals."""

from collections.abc import Sequence
from html import escape
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from matplotlib.axes import Axes

from quadstep.identify.beside_page import SVG, drawn, flight_picture, sections
from quadstep.identify.closed_loop import fly_again, hover_ratio
from quadstep.identify.errors import GROUPS, HORIZONS
from quadstep.identify.fit import Identified
from quadstep.identify.logs.flight import FlightRecord
from quadstep.identify.logs.signals import spectrum
from quadstep.identify.residual import Followed, followed
from quadstep.identify.run import AHEAD, Identification, answer
from quadstep.identify.table import ErrorTable
from quadstep.identify.vehicle_file import identified_vehicle
from quadstep.io.atomic import write_beside
from quadstep.io.errors import UserError
from quadstep.mission.airframe import AirframeSection
from quadstep.report.axes import plain_decades, powers
from quadstep.report.canvas import LINES, drawing, new_figure
from quadstep.report.canvas import write as write_figure
from quadstep.report.drawing import FigureJob
from quadstep.report.page import Fact, figure, heading, page_text, paragraph, summary, table
from quadstep.report.panel import Panel
from quadstep.report.units import percent

SHOWN = 8.0
"""Longest part of a flight that is drawn [s]."""

AXES = ("roll", "pitch", "yaw")


def write(path: Path, run: Identification, flights: Sequence[FlightRecord], start: AirframeSection) -> None:
    """Write the page for the flights that were held out or, if none were, for the fitted ones. Raises UserError."""
    tested = run.tested or run.found
    shown = [flight for flight in flights if flight.name in run.held_out] or list(flights)
    kind = "held out of this fit" if run.held_out else "fitted"
    followers = [one for one in (followed(flight, start, tested.numbers) for flight in shown) if one]
    pictures = [
        [predictions(one, f"predicted{place}", kind), spectra(one, f"spectra{place}")] for place, one in enumerate(followers)
    ]
    vehicle = run.vehicle if run.tested is None else identified_vehicle(start, tested, "", "")
    parts = [
        summary(answer(run), facts(run), pictures[0] if pictures else []),
        paragraph(f"Flights: {', '.join(flight.name for flight in flights)}.", escape),
        *fitted(run.found),
        *compared(run),
        heading("What the model cannot explain", "left"),
        paragraph(
            "While the model follows a flight it is corrected by the measurements; the corrections needed in addition "
            "to its own "
            "torque and thrust are unexplained. RMS and mean values over the flights that were " + kind + "."
        ),
        unexplained(followers, shown, vehicle),
    ]
    for one, drawn_of in list(zip(followers, pictures, strict=True))[1:]:
        parts += [heading(f"{one.name} ({kind})", one.name, escape), *drawn_of]
    parts += again(shown, vehicle)
    write_beside(path, page_text("Identified vehicle", parts, "Identification"))


def facts(run: Identification) -> list[Fact]:
    """Errors relative to those of the baseline with constant velocity and rates: of each group the worse of the tables."""
    tables = run.tables
    found = []
    for group in GROUPS if tables else ():
        ratio, knows = max((one.ratio(AHEAD, group).value, knows) for knows, one in tables.items())
        more = f"of the error of the constant baseline, {AHEAD} samples ahead, from {knows}"
        found.append(Fact(group, percent(ratio), more))
    return found


def fitted(found: Identified) -> list[str]:
    rows = [
        (key, f"{one.value:.4g}", f"{one.low:.4g} to {one.high:.4g}", one.unit, one.source)
        for key, one in found.fitted.items()
    ]
    rows += [(key, "stays", "", "", reason) for key, reason in found.kept.items()]
    return [heading("Identified parameters", "found"), table(("number", "value", "95 % interval", "unit", "from"), rows)]


def compared(run: Identification) -> list[str]:
    """Errors on held-out flights over those of "constant"."""
    parts = [heading("Prediction of held-out flights", "held-out")]
    if not run.held_out:
        return [*parts, paragraph("No flight was held out: fewer than four, or --no-hold-out.")]
    parts.append(
        paragraph(
            f'{", ".join(run.held_out)}: mean error relative to the baseline "velocity and rates stay constant".', escape
        )
    )
    for knows, found in run.tables.items():
        header = (f"from {knows}, samples ahead", *GROUPS, "rates to zero rate")
        parts.append(table(header, [ratios(found, horizon) for horizon in found.horizons]))
    return parts


def ratios(found: ErrorTable, horizon: int) -> tuple[str, ...]:
    values = [found.ratio(horizon, group).value for group in GROUPS] + [found.ratio(horizon, "rates", "zero").value]
    return (str(horizon), *(f"{value:.2f}" for value in values))


def unexplained(found: Sequence[Followed], flights: Sequence[FlightRecord], vehicle: AirframeSection) -> str:
    """A row for each flight: unexplained angular acceleration and force beside the measured ones, and the thrust."""
    thrust = {flight.name: hover_ratio(flight, vehicle) for flight in flights}
    rows = []
    for one in found:
        numbers = [np.sqrt((values**2).mean(axis=0)) for values in (one.turning, one.torque, one.force)]
        measured, torque, force = (" / ".join(f"{value:.2g}" for value in values) for values in numbers)
        mean = " / ".join(f"{value:+.2g}" for value in one.force.mean(axis=0))
        rows.append((one.name, measured, torque, force, mean, f"{thrust[one.name]:.3f}"))
    header = (
        "flight, x / y / z", "angular acceleration [rad/s²]", "unexplained part", "unexplained acceleration [m/s²]",
        "its mean", "thrust / needed",
    )  # fmt: skip
    return table(header, rows, escape)


def predictions(one: Followed, file: str, kind: str) -> str:
    """Measured and predicted signals, and the residuals. file: its name, without extension. kind: of flight."""
    kept = one.time - one.time[0] <= SHOWN
    measured, predicted = one.measured[AHEAD], one.predicted[AHEAD]
    panels = []
    for axis, name in enumerate(AXES):
        lines = {"measured": measured.rates[kept, axis], f"predicted {AHEAD} samples earlier": predicted.rates[kept, axis]}
        panels.append(Panel(f"{name} rate", "rad/s", lines))
    rest = {name: (predicted.rates - measured.rates)[kept, axis] for axis, name in enumerate(AXES)}
    panels.append(Panel("residual of the rates", "rad/s", rest))
    for axis, name in enumerate("xyz"):
        lines = {"measured": measured.velocity[kept, axis], "predicted": predicted.velocity[kept, axis]}
        panels.append(Panel(f"velocity along {name}", "m/s", lines))
    rest = {name: (predicted.velocity - measured.velocity)[kept, axis] for axis, name in enumerate("xyz")}
    panels.append(Panel("residual of the velocity", "m/s", rest))
    job = FigureJob(file, "", one.time[kept], panels, 2)
    return drawn(job, f"{one.name} ({kind}): measured, and predicted {AHEAD} samples earlier; residuals below")


def spectra(one: Followed, file: str) -> str:
    """Amplitude spectral densities of the measured rates and of the residuals. file: its name, without extension."""
    with TemporaryDirectory() as folder, drawing(SVG):
        sheet = new_figure(SVG, 9.0, 2.8)
        sheet.subplots_adjust(0.08, 0.18, 0.99, 0.84, 0.08)
        first: Axes | None = None
        for axis, name in enumerate(AXES):
            panel = sheet.add_subplot(1, 3, axis + 1, sharey=first)
            frequencies, signal = spectrum(one.measured[HORIZONS[0]].rates, one.period)
            panel.loglog(frequencies, signal[:, axis], label="measured", **LINES[0])
            for style, horizon in zip(LINES[1:], HORIZONS[:2], strict=False):
                rest = one.predicted[horizon].rates - one.measured[horizon].rates
                panel.loglog(*(values[:, axis] if values.ndim > 1 else values for values in spectrum(rest, one.period)),
                             label=f"residual, {horizon} ahead", **style)  # fmt: skip
            plain_decades(panel.xaxis)
            panel.yaxis.set_major_formatter(powers())
            panel.set_title(f"{name} rate", fontsize=9, loc="left")
            panel.set_xlabel("frequency [Hz]")
            if first is None:
                first = panel
                panel.set_ylabel("rad/s per √Hz")
                panel.legend(loc="upper right", fontsize="x-small")
            else:
                panel.tick_params(labelleft=False)
        write_figure(sheet, Path(folder) / file, SVG)
        return figure(Path(folder) / f"{file}.svg", "Spectra of the rates and of the prediction residuals")


def again(flights: Sequence[FlightRecord], vehicle: AirframeSection) -> list[str]:
    """The real flights beside simulated ones, if they have setpoints."""
    found = []
    for flight in flights:
        try:
            found += fly_again([flight], vehicle, {"type": "pid"})
        except UserError:
            continue
    pictures = [drawn(*flight_picture(one, place)) for place, one in enumerate(found)]
    return [heading("Real and simulated flights", "again"), *sections(found, "pid", pictures)] if found else []

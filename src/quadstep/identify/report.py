"""What an identification has found, for its readers: the parameters, how well they predict, the residuals."""

import contextlib
from collections.abc import Sequence
from html import escape
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from matplotlib.axes import Axes

from quadstep.identify.beside_page import drawn, flight_picture, table
from quadstep.identify.closed_loop import fly_again, hover_ratio
from quadstep.identify.errors import GROUPS, HORIZONS
from quadstep.identify.fit import Identified
from quadstep.identify.logs.flight import FlightRecord
from quadstep.identify.logs.signals import spectrum
from quadstep.identify.replay_report import METHOD, error_table
from quadstep.identify.residual import Followed, followed
from quadstep.identify.run import AHEAD, Identification, answer
from quadstep.identify.vehicle_file import identified_vehicle
from quadstep.io.atomic import write_beside
from quadstep.io.errors import UserError
from quadstep.io.results.record import FIGURES
from quadstep.mission.airframe import AirframeSection
from quadstep.report import page
from quadstep.report.axes import plain_decades, powers
from quadstep.report.canvas import LINES, drawing, new_figure
from quadstep.report.canvas import write as write_figure
from quadstep.report.drawing import FigureJob
from quadstep.report.evidence import Evidence, Figure, Section, Table
from quadstep.report.panel import Panel
from quadstep.report.sheet import Sheet
from quadstep.report.units import percent

SHOWN = 8.0
"""Longest part of a flight that is drawn [s]."""

SVG = Sheet(formats=("svg",))

AXES = ("roll", "pitch", "yaw")


def evidence(run: Identification, flights: Sequence[FlightRecord], start: AirframeSection, mass: str) -> Evidence:
    """What was found. start: the vehicle that it began with; mass: where its mass is from."""
    names, period = ", ".join(run.held_out), flights[0].period
    kept = [f"{key} stays as in the given vehicle: {reason}." for key, reason in run.found.kept.items()]
    said = [answer(run), *kept, f"mass = {start.mass:g} kg: {mass}.", *of_residual(run)]
    tables = [
        error_table(f"Held out of the first fit: {names}, predicted from {knows}", found, period)
        for knows, found in (
            ("commands alone", run.commands),
            ("commands and setpoints", run.guided),
            ("commands alone, with the learned residual", run.commands_residual),
            ("commands and setpoints, with the learned residual", run.guided_residual),
        )
        if found
    ]
    if not tables:
        said.append("No flight was held out: only the intervals say how well this holds for other flights.")
    return Evidence(
        name="Identified vehicle",
        kind="Identification",
        answer=said[0],
        sentences=said,
        record={},
        facts=facts(run),
        sections=[
            fitted(run.found),
            *([page.heading("Prediction of held-out flights", "held-out"), page.paragraph(METHOD)] if tables else []),
            *tables,
        ],
        more=said[1:],
    )


def write(path: Path, told: Evidence, run: Identification, flights: Sequence[FlightRecord], start: AirframeSection) -> None:
    """Write the page, its figures of the flights that were held out or, if none were, of the fitted ones. Raises UserError."""
    tested = run.tested or run.found
    shown = [flight for flight in flights if flight.name in run.held_out] or list(flights)
    kind = "held out of this fit" if run.held_out else "fitted"
    followers = [one for one in (followed(flight, start, tested.numbers) for flight in shown) if one]
    vehicle = run.vehicle if run.tested is None else identified_vehicle(start, tested, "", "")
    with TemporaryDirectory() as folder:
        out = Path(folder)
        (out / FIGURES).mkdir()
        pictures: list[Figure] = [
            part for i, one in enumerate(followers) for part in (predictions(out, one, i, kind), spectra(out, one, i))
        ]
        sections: list[Section] = [
            page.paragraph(f"Flights: {', '.join(flight.name for flight in flights)}.", escape),
            *told.sections,
            unexplained(followers, shown, vehicle, kind),
            *again(out, shown, vehicle),
            *([page.heading("The other flights", "others")] if pictures[2:] else []),
            *pictures[2:],
        ]
        text = told._replace(figures=pictures[:2], sections=sections).html(out)
    write_beside(path, text)


def of_residual(run: Identification) -> list[str]:
    """What held-out flights say of the residual, if it was trained."""
    if not run.shares:
        return []
    much = " and ".join(f"{share:.3f}" for share in run.shares)
    if run.residual is not None:
        return [f"With the residual errors are {much} times as large; the vehicle has it, switched off (effects.residual)."]
    return [f"With the residual errors are {much} times as large on flights held out, so it is left out of the vehicle."]


def facts(run: Identification) -> list[page.Fact]:
    """Errors relative to those of the baseline with constant velocity and rates: of each group the worse of the tables."""
    tables = run.tables
    found = []
    for group in GROUPS if tables else ():
        ratio, knows = max((one.ratio(AHEAD, group).value, knows) for knows, one in tables.items())
        more = f"of the error of the constant baseline, {AHEAD} samples ahead, from {knows}"
        found.append(page.Fact(group, percent(ratio), more))
    return found


def fitted(found: Identified) -> Table:
    rows = [
        (key, f"{one.value:.4g}", f"{one.low:.4g} to {one.high:.4g}", one.unit, one.source)
        for key, one in found.fitted.items()
    ]
    header = ("key", "value", "95 % interval", "unit", "from")
    return Table("Identified parameters", "found", header, rows, shown="Identified")


def unexplained(found: Sequence[Followed], flights: Sequence[FlightRecord], vehicle: AirframeSection, kind: str) -> Table:
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
    text = (
        "While the model follows a flight it is corrected by the measurements; the corrections needed in addition to its own "
        f"torque and thrust are unexplained. RMS and mean values over the flights that were {kind}."
    )
    return Table("What the model cannot explain", "left", header, rows, text, escape)


def predictions(out: Path, one: Followed, place: int, kind: str) -> Figure:
    """Measured and predicted signals, and the residuals. place: of the flight among the others; kind: of flight."""
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
    caption = (
        f"{one.name} ({kind}): measured, and predicted {AHEAD} samples earlier. The residuals show what the vehicle does not "
        "explain: a slow wave is a missing force, a burst at each manoeuvre a wrong inertia, lag or delay."
    )
    return drawn(out, FigureJob(f"{FIGURES}/predicted{place}", caption, one.time[kept], panels, 2), SVG)


def spectra(out: Path, one: Followed, place: int) -> Figure:
    """Amplitude spectral densities of the measured rates and of the residuals. place: of the flight among the others."""
    name = f"{FIGURES}/spectra{place}"
    with drawing(SVG):
        sheet = new_figure(SVG, 9.0, 2.8)
        sheet.subplots_adjust(0.08, 0.18, 0.99, 0.84, 0.08)
        first: Axes | None = None
        for axis, turn in enumerate(AXES):
            panel = sheet.add_subplot(1, 3, axis + 1, sharey=first)
            frequencies, signal = spectrum(one.measured[HORIZONS[0]].rates, one.period)
            panel.loglog(frequencies, signal[:, axis], label="measured", **LINES[0])
            for style, horizon in zip(LINES[1:], HORIZONS[:2], strict=False):
                rest = one.predicted[horizon].rates - one.measured[horizon].rates
                panel.loglog(*(values[:, axis] if values.ndim > 1 else values for values in spectrum(rest, one.period)),
                             label=f"residual, {horizon} ahead", **style)  # fmt: skip
            plain_decades(panel.xaxis)
            panel.yaxis.set_major_formatter(powers())
            panel.set_title(f"{turn} rate", fontsize=9, loc="left")
            panel.set_xlabel("frequency [Hz]")
            if first is None:
                first = panel
                panel.set_ylabel("rad/s per √Hz")
                panel.legend(loc="upper right", fontsize="x-small")
            else:
                panel.tick_params(labelleft=False)
        write_figure(sheet, out / name, SVG)
    return Figure(name, "Spectra of the rates and of what predictions miss of them: the vehicle explains a frequency as far "
                        "as the residual is below the measurement.")  # fmt: skip


def again(out: Path, flights: Sequence[FlightRecord], vehicle: AirframeSection) -> list[Section]:
    """The real flights beside simulated ones, if they have setpoints."""
    found = []
    for flight in flights:
        with contextlib.suppress(UserError):
            found += fly_again([flight], vehicle, {"type": "pid"})
    pictures = [drawn(out, flight_picture(one, place), SVG) for place, one in enumerate(found)]
    return [table(found, "pid"), *pictures] if found else []

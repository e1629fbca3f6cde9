"""What an identification has found, for its readers: the parameters, how well they predict, the residuals."""

from collections.abc import Sequence
from html import escape

import numpy as np

from quadstep.identify.closed_loop import hover_ratio
from quadstep.identify.fit import Identified
from quadstep.identify.logs.flight import FlightRecord
from quadstep.identify.replay_report import METHOD, error_table
from quadstep.identify.residual import Followed
from quadstep.identify.run import AHEAD, Identification, answer
from quadstep.identify.starts import GROUPS
from quadstep.mission.airframe import AirframeSection
from quadstep.report import page
from quadstep.report.evidence import Evidence, Table
from quadstep.report.units import percent


def evidence(run: Identification, flights: Sequence[FlightRecord], start: AirframeSection, mass: str) -> Evidence:
    """What was found. start: the vehicle that it began with; mass: where its mass is from."""
    names, period = ", ".join(run.held_out), flights[0].period
    kept = [f"{key} keeps the value of the given vehicle: {reason}." for key, reason in run.found.kept.items()]
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
        said.append("No flight was held out: only the intervals show how well this holds for other flights.")
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

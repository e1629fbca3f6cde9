"""`quadstep identify` and `quadstep replay`: a vehicle from logged flights, and its predictions compared with them."""

import os
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from quadstep.commands.options import FigureOptions, OverwriteOption, ReplaceOption, SignalsOption, show
from quadstep.io.errors import UserError
from quadstep.report.screen import complain, say, say_whole
from quadstep.report.units import counted

if TYPE_CHECKING:
    from quadstep.identify.logs.flight import FlightRecord
    from quadstep.mission.airframe import AirframeSection

LogsArgument = Annotated[list[Path], typer.Argument(metavar="LOG", help="Logs of flights.")]
MappingOption = Annotated[
    str | None, typer.Option(help="Meaning of a CSV's columns: nanobench, crazypad, idsia, or a mapping file (TOML).")
]


def read_logs(logs: Sequence[Path], mapping: str | None) -> "list[FlightRecord]":
    """Flights, named like their files, with as much of their folders as tells them apart. Raises UserError."""
    from quadstep.identify.logs.flight import refuse_shared
    from quadstep.identify.logs.read import read_log

    paths = [Path(os.path.realpath(log)) for log in logs]  # Path.resolve raises for links in a circle
    if twice := next((log for log, path in zip(logs, paths, strict=True) if paths.count(path) > 1), None):
        raise UserError(f"{twice}: given twice; a flight counts once")
    stems = [path.with_suffix("") for path in paths]
    named = [(path if stems.count(stem) > 1 else stem).parts for path, stem in zip(paths, stems, strict=True)]
    flights = []
    for log, one in zip(logs, named, strict=True):
        depth = next(n for n in range(1, len(one) + 1) if sum(each[-n:] == one[-n:] for each in named) == 1)
        flights.append(replace(read_log(log, mapping), name="/".join(one[-depth:])))
    refuse_shared(flights)
    return flights


def identify(
    logs: LogsArgument,
    vehicle: Annotated[str, typer.Option(metavar="VEHICLE", help="Vehicle to start from: a preset's name, or a file (TOML).")],
    out: Annotated[Path, typer.Option(metavar="FILE", help="Where to write the vehicle.")] = Path("vehicle.toml"),
    mass: Annotated[float | None, typer.Option(metavar="KG", help="Mass, if it differs from --vehicle's.")] = None,
    mapping: MappingOption = None,
    trust: Annotated[
        bool,
        typer.Option("--trust-mapping", help="Fit even if a log contradicts its mapping; the contradictions are printed."),
    ] = False,
    still_air: Annotated[
        bool, typer.Option("--still-air", help="Assume no wind, as indoors: a mean tilt is then the sensor's.")
    ] = False,
    hold_out: Annotated[
        bool, typer.Option("--hold-out/--no-hold-out", help="Hold out one flight in four and test the first fit on it.")
    ] = True,
    residual: Annotated[
        bool, typer.Option("--residual", help="Train a small network on the residual; it is switched off in the vehicle file.")
    ] = False,
    report: Annotated[bool, typer.Option("--report/--no-report", help="Write an HTML page next to the vehicle file.")] = True,
    overwrite: ReplaceOption = False,
) -> None:
    """Fit a vehicle to logs of its flights: thrust, torque, lag, delay, inertia, drag, with an interval for each number.

    Logs cannot reveal the mass; it comes from --vehicle or --mass.
    """
    from quadstep.identify.run import evidence, followers, run
    from quadstep.identify.vehicle_file import as_toml
    from quadstep.io.files import refuse_other, write_beside
    from quadstep.mission.listings import vehicle_named

    if out.suffix != ".toml":
        raise UserError(f"{out}: the name of a vehicle file should end in .toml")
    if mass is not None and not 1e-4 <= mass <= 1e4:
        raise UserError(f"--mass: should be 0.0001 to 10000 kg, not {mass:g}")
    refuse_other(out, None, overwrite)
    if report:
        refuse_other(out.with_suffix(".html"), None, overwrite)
    begun = time.monotonic()
    section = vehicle_named(vehicle)
    source = f"--mass {mass:g}; a flight cannot reveal it" if mass else f"that of {vehicle}; a flight cannot reveal it"
    if mass:
        section = section.model_copy(update={"mass": mass})
    flights = read_logs(logs, mapping)
    notes = check_logs(flights, section, trust)
    result = run(flights, section, source, hold_out, lambda what: complain(f"fitting: {what}"), residual, still_air)
    write_beside(out, as_toml(result.vehicle))
    found = followers(result, flights, section)
    told = evidence(result, flights, section, found, notes)
    if report:
        from quadstep.identify.pages import write_identification

        complain("drawing: the report")
        write_identification(out.with_suffix(".html"), told, result, flights[0].period, found)
    show(told, None)
    say(f"{counted(len(flights), 'flight')} in {time.monotonic() - begun:.0f} s")
    pages = f" and {out.with_suffix('.html')}" if report else ""
    say_whole(f"Wrote {out}{pages}")


def check_logs(flights: "list[FlightRecord]", vehicle: "AirframeSection", trust: bool) -> list[str]:
    """Refuse what contradicts its mapping unless trusted, then say, and return, what is worth knowing of each log. Raises
    UserError.
    """
    from quadstep.identify.logs.judge import in_few_lines, judge, refuse

    judged = {flight.name: judge(flight, vehicle.geometry()) for flight in flights}
    for name, findings in judged.items() if not trust else ():
        refuse(name, findings)
    for line in (lines := in_few_lines(judged)):
        say(line)
    return lines


def replay(
    logs: LogsArgument,
    vehicle: Annotated[str, typer.Option(metavar="VEHICLE", help="A preset's name, or a vehicle file (TOML).")],
    mapping: MappingOption = None,
    controller: Annotated[
        str | None, typer.Option(help="Fly the logged setpoints with this controller: a type, or a TOML file with its keys.")
    ] = None,
    estimator: Annotated[bool, typer.Option("--estimator", help="Run the Kalman filter on the logged sensors.")] = False,
    commands_only: Annotated[bool, typer.Option("--commands-only", help="Ignore setpoints.")] = False,
    residual: Annotated[bool, typer.Option("--residual", help="Also predict with the vehicle's learned residual.")] = False,
    starts: Annotated[
        Path | None, typer.Option(metavar="FILE", help='Rows to predict from: {"flight": [row, ...]} (JSON).')
    ] = None,
    predictions: Annotated[Path | None, typer.Option(metavar="FILE", help="Where to write these predictions (JSON).")] = None,
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="Write a report, its figures and tables.")] = None,
    overwrite: OverwriteOption = False,
    *,
    drawing: FigureOptions,
    signals: SignalsOption = None,
) -> None:
    """Predict logged flights from their measured states and commands, and report the errors.

    Mean errors 1, 10 and 50 samples ahead are compared with those of two baselines: velocity and rates stay constant
    ("constant"), or the rates are zero. --out writes report.html, figures/, prediction_errors.csv and, if requested,
    tracking.csv and estimates.csv.
    """
    from quadstep.identify.logs.judge import judge
    from quadstep.identify.replay import ReplayRequest, replayed
    from quadstep.identify.replay_report import evidence, identity, panels_of
    from quadstep.mission.listings import vehicle_named
    from quadstep.report.publish import files_to_replace

    if (starts is None) != (predictions is None):
        raise UserError("--starts and --predictions must be given together: rows to predict from, and where to write")
    if starts and out:
        raise UserError("--out: cannot be combined with --starts, whose predictions --predictions takes")
    drawn_on = drawing.sheet(signals)
    chosen = controller_of(controller) if controller else None
    section = vehicle_named(vehicle)
    if residual and not section.residual:
        raise UserError(f"--residual: {vehicle} has none; quadstep identify --residual makes one")
    flights = read_logs(logs, mapping)
    judged = [(flight.name, one) for flight in flights for one in judge(flight, section.geometry())]
    warnings = [f"{name}: {one.text}" for name, one in judged if one.wrong or one.grave]
    if starts and predictions:
        write_predictions(flights, section, starts, predictions, commands_only, warnings)
        return
    asked = ReplayRequest(Path(vehicle).name, section, chosen, estimator, commands_only, residual, out is not None)
    drawn_on.check_signals(panels_of(asked))
    if out:
        files_to_replace(out, identity(flights, asked), overwrite)  # before anything is computed
    found = replayed(flights, asked)
    told = evidence(flights, asked, found, warnings)
    if out:
        from quadstep.identify.pages import write_replay

        write_replay(out, flights, asked, found, told, overwrite, drawn_on)
    warn(warnings)
    show(told._replace(warnings=()), out)


def warn(warnings: Sequence[str]) -> None:
    """Say them, once there is a result: an error stands alone."""
    for one in warnings:
        complain(f"warning: {one}")


def write_predictions(
    flights: "list[FlightRecord]",
    section: "AirframeSection",
    starts: Path,
    predictions: Path,
    commands_only: bool,
    warnings: list[str],
) -> None:
    """Predict from given rows, for others to judge."""
    from quadstep.identify.replay import as_json, predictions_of, read_starts, ready
    from quadstep.io.files import write_beside

    numbers, guided = ready(flights, section, commands_only)
    rows = read_starts(starts, flights)
    write_beside(predictions, as_json(predictions_of(flights, section, numbers, rows, guided)))
    warn(warnings)
    count = sum(len(one) for one in rows.values())
    say(f"{counted(count, 'prediction')} of {counted(len(rows), 'flight')} in {predictions}")


def controller_of(given: str) -> dict[str, object]:
    """The keys of a controller: a type, or a file with a table [controller] or its keys. Raises UserError."""
    from quadstep.control.registry import names
    from quadstep.interfaces.controller import Measured
    from quadstep.io.documents import read_toml
    from quadstep.io.doors import CONTROLLERS, own_place
    from quadstep.mission.own_thing import unknown_type

    if not given.endswith(".toml"):
        if given not in names(Measured) and own_place(given, CONTROLLERS) is None:
            raise UserError(f"--controller: {unknown_type(given, ('a TOML file', *names(Measured)), CONTROLLERS)}")
        return {"type": given}
    content = read_toml(Path(given))
    table = content.get("controller", content)
    if not isinstance(table, dict) or "type" not in table:
        raise UserError(f"{given}: should have a table [controller] with a type")
    return table

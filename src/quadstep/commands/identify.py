"""`quadstep identify`."""

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from quadstep.commands.deliver import show
from quadstep.commands.options import LogsArgument, MappingOption, ReplaceOption, read_logs, vehicle_of
from quadstep.io.errors import UserError
from quadstep.report.screen import complain, say, say_whole
from quadstep.report.units import counted

if TYPE_CHECKING:
    from quadstep.identify.logs.flight import FlightRecord
    from quadstep.mission.airframe import AirframeSection


def identify(
    logs: LogsArgument,
    vehicle: Annotated[
        str, typer.Option(help="Vehicle to start from: a preset's name, or a file (TOML).", show_default=False)
    ],
    out: Annotated[Path, typer.Option(metavar="FILE", help="Where to write the vehicle.")] = Path("vehicle.toml"),
    mass: Annotated[
        float | None, typer.Option(metavar="KG", help="Mass, if it differs from that of --vehicle.", show_default=False)
    ] = None,
    mapping: MappingOption = None,
    trust: Annotated[
        bool,
        typer.Option("--trust-mapping", help="Fit even if a log contradicts its mapping; the contradictions are printed."),
    ] = False,
    still_air: Annotated[
        bool, typer.Option("--still-air", help="No wind blew, as indoors: a lean then reveals the sensor's tilt.")
    ] = False,
    hold_out: Annotated[
        bool, typer.Option("--hold-out/--no-hold-out", help="Hold out one flight in four and test the first fit on it.")
    ] = True,
    residual: Annotated[
        bool,
        typer.Option("--residual", help="Train a small network on the residual; it is switched off in the vehicle file."),
    ] = False,
    report: Annotated[
        bool,
        typer.Option("--report/--no-report", help="Write an HTML page next to the vehicle file: fits, residuals, spectra."),
    ] = True,
    overwrite: ReplaceOption = False,
) -> None:
    """Fit a vehicle to logs of its flights: thrust, torque, lag, delay, inertia, drag, with an interval for each number.

    Logs cannot reveal the mass; it comes from --vehicle or --mass.
    """
    from quadstep.identify.run import evidence, run
    from quadstep.identify.vehicle_file import as_toml
    from quadstep.io.files import refuse_other, write_beside

    if out.suffix != ".toml":
        raise UserError(f"{out}: the name of a vehicle file should end in .toml")
    if mass is not None and not 1e-4 <= mass <= 1e4:
        raise UserError(f"--mass: should be 0.0001 to 10000 kg, not {mass:g}")
    refuse_other(out, None, overwrite)
    if report:
        refuse_other(out.with_suffix(".html"), None, overwrite)
    begun = time.monotonic()
    section = vehicle_of(vehicle)
    source = f"--mass {mass:g}; a flight cannot reveal it" if mass else f"that of {vehicle}; a flight cannot reveal it"
    if mass:
        section = section.model_copy(update={"mass": mass})
    flights = read_logs(logs, mapping)
    check_logs(flights, section, trust)
    result = run(flights, section, source, hold_out, lambda what: complain(f"fitting: {what}"), residual, still_air)
    write_beside(out, as_toml(result.vehicle))
    told = evidence(result, flights, section, source)
    if report:
        from quadstep.identify.pages import write_identification

        complain("drawing: the report")
        write_identification(out.with_suffix(".html"), told, result, flights, section)
    show(told, None)
    say(f"{counted(len(flights), 'flight')} in {time.monotonic() - begun:.0f} s")
    pages = f" and {out.with_suffix('.html')}" if report else ""
    say_whole(f"Wrote {out}{pages}")


def check_logs(flights: "list[FlightRecord]", vehicle: "AirframeSection", trust: bool) -> None:
    """Refuse what contradicts its mapping unless trusted, then say what is worth knowing of each log. Raises UserError."""
    from quadstep.identify.logs.judge import judge, refuse

    judged = [(flight, judge(flight, vehicle.geometry())) for flight in flights]
    for flight, findings in judged if not trust else ():
        refuse(flight, findings)
    for flight, findings in judged:
        for one in findings:
            say(f"{flight.name}: {one.text}")

"""`quadstep prove`."""

from pathlib import Path
from typing import Annotated

import typer

from quadstep.io.errors import UserError
from quadstep.report.terminal.screen import say, say_whole, show_table


def prove(
    mission: Annotated[Path | None, typer.Argument(help="Mission file (TOML).", show_default=False)] = None,
    force: Annotated[
        float | None,
        typer.Option(
            help="Bound of the unknown force on each axis [N]; default: 2.3e-4 on the paper's plant, else 0.",
            show_default=False,
        ),
    ] = None,
    torque: Annotated[
        float | None,
        typer.Option(
            help="Bound of the unknown torque on each axis [N m]; default: 2.3e-4 on the paper's plant, else 0.",
            show_default=False,
        ),
    ] = None,
    mass: Annotated[float, typer.Option(help="Relative uncertainty of the mass; 0.01 is 1 %.")] = 0.0,
    inertia: Annotated[float, typer.Option(help="Relative uncertainty of each moment of inertia.")] = 0.0,
    start: Annotated[float, typer.Option(help="Uncertainty of the start position on each axis [m].")] = 0.0,
    start_velocity: Annotated[float, typer.Option(help="Uncertainty of the velocity at the start [m/s].")] = 0.0,
    start_attitude: Annotated[
        float,
        typer.Option(help="Uncertainty of the attitude at the start, each angle, or about each axis [rad]."),
    ] = 0.0,
    start_rates: Annotated[float, typer.Option(help="Uncertainty of the angular rates at the start [rad/s].")] = 0.0,
    out: Annotated[
        Path | None,
        typer.Option(help="Certificate, beside its report; default: out/<mission's name>-proof.json.", show_default=False),
    ] = None,
    check: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Check this certificate instead, independently.", show_default=False)
    ] = None,
    controller: Annotated[
        list[str] | None,
        typer.Option(
            metavar="FILE",
            help="With --check: your own code, named by the mission, that may run; may be repeated. No other code runs.",
            show_default=False,
        ),
    ] = None,
) -> None:
    """Prove a bound on every flight's distance from its path, or disprove it, by interval enclosures.

    Exit code 0: proved. 1: undecided (the open cases are listed), or certificate not confirmed. 2: bad input. 3: disproved.
    """
    from quadstep.proofs.prove import report, run
    from quadstep.proofs.prove.certificate import check_target
    from quadstep.proofs.prove.unknown import Unknown

    if mission is not None and check is not None:
        raise UserError(f"name a mission or a certificate with --check, not both: {mission} and {check}")
    if mission is None and check is None:
        raise UserError("name a mission, or a certificate with --check")
    if controller and check is None:
        raise UserError("--controller is for --check; a mission of yours runs the code that it names")
    page = None
    if check is not None:
        verdict = run.check(check, controller or ())
    else:
        assert mission is not None
        file = out or Path("out") / f"{mission.stem}-proof.json"
        check_target(file)
        page = report.place_beside(file)
        others = Unknown(0.0, 0.0, mass, inertia, start, start_velocity, start_attitude, start_rates)
        verdict = run.prove_mission(mission, force, torque, others, file)
    show_table(verdict.name, verdict.columns, verdict.rows)
    for sentence in verdict.says:
        say(sentence)
    if verdict.written:
        say_whole(f"Certificate: {verdict.written}")
    if page:
        report.write_report(page, verdict)
        say_whole(f"Report: {page}")
    if verdict.kind:
        raise typer.Exit(int(verdict.kind))

"""`quadstep prove`, `quadstep certify`, and `quadstep verify`."""

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from quadstep.commands.options import FigureOptions, JsonOption, OverwriteOption, print_json, show
from quadstep.io.doors import needed_by
from quadstep.io.errors import DIVERGED, FAILED, UserError
from quadstep.report.bars import bar
from quadstep.report.screen import say, say_whole, show_table

if TYPE_CHECKING:
    from quadstep.proofs.verify.equation_row import JudgedRow


def prove(
    mission: Annotated[Path | None, typer.Argument(metavar="MISSION.toml", help="Mission file (TOML).")] = None,
    force: Annotated[
        float | None,
        typer.Option(help="Bound on the unknown force on each axis [N]; default: 2.3e-4 on the paper's plant, else 0."),
    ] = None,
    torque: Annotated[
        float | None,
        typer.Option(help="Bound on the unknown torque on each axis [N m]; default: 2.3e-4 on the paper's plant, else 0."),
    ] = None,
    mass: Annotated[float, typer.Option(help="Relative uncertainty of the mass; 0.01 is 1 %.")] = 0.0,
    inertia: Annotated[float, typer.Option(help="Relative uncertainty of each moment of inertia.")] = 0.0,
    start: Annotated[float, typer.Option(help="Uncertainty of the start position on each axis [m].")] = 0.0,
    start_velocity: Annotated[float, typer.Option(help="Uncertainty of the start velocity [m/s].")] = 0.0,
    start_attitude: Annotated[
        float, typer.Option(help="Uncertainty of the start attitude, in each angle or about each axis [rad].")
    ] = 0.0,
    start_rates: Annotated[float, typer.Option(help="Uncertainty of the start's angular rates [rad/s].")] = 0.0,
    out: Annotated[
        Path | None, typer.Option(help="Certificate (.json), beside its report; default: out/<mission's name>-proof.json.")
    ] = None,
    check: Annotated[Path | None, typer.Option(metavar="FILE", help="Check this certificate instead, independently.")] = None,
    controller: Annotated[
        list[str] | None,
        typer.Option(
            metavar="FILE",
            help="With --check: one of the mission's Python files, allowed to run; all others are refused. May be repeated.",
        ),
    ] = None,
) -> None:
    """Prove a bound on every flight's distance from its path, or disprove it, by interval enclosures.

    Exit code 0: proved. 1: undecided, or certificate not confirmed. 2: bad input. 3: hover is unstable, or the flight lost.
    """
    from quadstep.proofs.prove import report, run
    from quadstep.proofs.prove.certificate_file import check_target
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
        file = file if file.suffix or file.is_dir() else file.with_suffix(".json")
        check_target(file)
        page = report.place_beside(file)
        others = Unknown(0.0, 0.0, mass, inertia, start, start_velocity, start_attitude, start_rates)
        verdict = run.prove_mission(mission, force, torque, others, file)
    say(report.sentence(verdict.says[0]))
    say("")
    if verdict.rows:
        show_table(verdict.name, verdict.columns, verdict.rows)
    for said in verdict.says[1:]:
        say(report.sentence(said))
    if verdict.written:
        say_whole(f"Certificate: {verdict.written}")
    if page:
        report.write_report(page, verdict)
        say_whole(f"Report: {page}")
    if verdict.kind:
        raise typer.Exit(int(verdict.kind))


def certify(
    mission: Annotated[Path, typer.Argument(metavar="MISSION.toml", help="Mission file (TOML) with the paper's controller.")],
    out: Annotated[
        Path | None, typer.Option(help="Folder for the results; default: out/<mission's name>-certificate.")
    ] = None,
    overwrite: OverwriteOption = False,
    *,
    drawing: FigureOptions,
) -> None:
    """Measure on one flight what Theorem 5.1 requires and promises.

    Writes report.html, certificate.json, a figure and metrics.json.


    Exit code 0: a certificate was computed, whatever it says. 2: bad input, or nothing to certify. 3: the flight was lost; the
    certificate covers it up to then.
    """
    from quadstep.proofs.certify.run import certify_mission

    folder = out or Path("out") / f"{mission.stem}-certificate"
    found = certify_mission(mission, folder, overwrite, drawing.sheet())
    show(found, folder)
    if found.cases[0].failure:
        raise typer.Exit(DIVERGED)


def verify(
    only: Annotated[str | None, typer.Option(metavar="ROW", help="One row, by number (1 to 75) or name (T_eta).")] = None,
    every: Annotated[bool, typer.Option("--all", help="Print every row, not only the failing ones.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Check every equation of the paper against the code that flies; print a summary and the rows that fail.

    Exit code 0: all checks pass. 1: a check of some row fails. 2: bad input.
    """
    with needed_by("`quadstep verify`"):
        from quadstep.proofs.verify import registry

    rows, started = registry.chosen(only), time.perf_counter()
    with bar("verifying", "rows", len(rows)) as progress:
        results = registry.verify(rows, progress.to)
    seconds = time.perf_counter() - started
    if as_json:
        print_json(registry.document(results, seconds))
    else:
        show_rows(results, seconds, only, every)
    if not all(result.passed for result in results):
        raise typer.Exit(FAILED)


def show_rows(results: "list[JudgedRow]", seconds: float, only: str | None, every: bool) -> None:
    """Print a summary, and the rows that were asked for or fail."""
    from quadstep.proofs.verify import registry

    if not only:
        show_table("The paper against the code", *registry.summary(results))
    printed = [result for result in results if every or only or not result.passed]
    if printed:
        show_table(
            "" if only else "Every row" if every else "FAILED", registry.HEADER, [registry.cells(one) for one in printed]
        )
    say(registry.closing(results, seconds) + ("" if every or only else " Use --all to list every row."))

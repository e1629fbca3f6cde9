"""The command line."""

import os
import signal
import sys
import time
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from types import FrameType
from typing import Annotated, Any

import typer
from typer.core import TyperGroup
from typer.exceptions import TyperException

from quadstep import __version__
from quadstep.campaign.commands import add_campaign
from quadstep.envelope.commands import add_envelope
from quadstep.errors import InterruptedRun, UserError, one_line
from quadstep.exit_codes import BAD_INPUT, DIVERGED, FAILED, INTERRUPTED, OUTPUT_LOST
from quadstep.extras import missing_extra
from quadstep.flight.engine import Engine
from quadstep.judging.deliver import JsonOption, JunitOption, check_junit, deliver
from quadstep.judging.metrics import parsed
from quadstep.page.commands import add_commands
from quadstep.report.pool import start_server
from quadstep.report.sheet import ON_SCREEN, SCREEN, USUAL, sheet
from quadstep.report.sheet_options import FiguresOption, StyleOption, WidthOption
from quadstep.report.writable import provide_writable
from quadstep.terminal.bars import bar
from quadstep.terminal.screen import command, complain, say, say_whole, width
from quadstep.terminal.streams import OutputError, prepare_streams
from quadstep.terminal.tables import show_table
from quadstep.tuning.commands import add_tune


class Commands(TyperGroup):
    """Commands whose list in the help has the whole first sentence of each; without one of them the help is shown."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Takes nothing for a request for help."""
        return super().parse_args(ctx, args or ["--help"])

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Writes the list."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, self.commands[name].get_short_help_str(1000)) for name in self.list_commands(ctx)])


app = typer.Typer(
    name="quadstep",
    cls=Commands,
    help="How well, and how surely, will this controller hold my quadrotor on its path?",
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)
HELP_WIDTHS = 50, 100
"""Columns that help is given at least and at most."""

EngineOption = Annotated[
    Engine, typer.Option(help="lanes: compiled vector code. python: the same laws without a compiler, slower.")
]
OverwriteOption = Annotated[bool, typer.Option("--overwrite", help="Replace results of another mission in the folder.")]


def version(shown: bool) -> None:
    """Print the version and stop."""
    if shown:
        say(f"quadstep {__version__}")
        raise typer.Exit


@app.callback()
def options(
    shown: Annotated[bool, typer.Option("--version", callback=version, is_eager=True, help="Print the version.")] = False,
) -> None:
    """Options of every command."""


@app.command()
def reproduce(
    out: Annotated[Path, typer.Option(help="Folder for the results.")] = Path("out/paper"),
    engine: EngineOption = Engine.LANES,
    overwrite: OverwriteOption = False,
    figures: FiguresOption = USUAL,
    width: WidthOption = None,
    style: StyleOption = SCREEN,
) -> None:
    """Fly the paper's cases and the stress flights, judge its claims, write figures, CSV, JSON and report.html."""
    from quadstep.study.reproduce import reproduce as run  # noqa: PLC0415 (each command loads what it needs)

    claims = run(out, engine, overwrite, sheet(figures, width, style))
    rows = [(claim.name, claim.measured, claim.verdict) for claim in claims]
    show_table("Section 6 of the paper, claim by claim", ("claim", "measured", "verdict"), rows)
    say_whole(f"Report: {out / 'report.html'}")


@app.command()
def fly(
    mission: Annotated[Path, typer.Argument(help="Mission file (TOML); `quadstep new` writes one.", show_default=False)],
    out: Annotated[Path | None, typer.Option(help="Folder for the results; out/<mission's name> if left out.")] = None,
    engine: EngineOption = Engine.LANES,
    overwrite: OverwriteOption = False,
    flight: Annotated[
        int | None, typer.Option(help="Of a campaign file: the flight of this number.", show_default=False)
    ] = None,
    results: Annotated[
        Path | None,
        typer.Option(
            help="With --flight: where the campaign was flown; out/<campaign's name> if left out.", show_default=False
        ),
    ] = None,
    require: Annotated[
        list[str] | None,
        typer.Option(
            metavar="METRIC=MOST",
            help="A metric of metrics.json may be so large at most, as position_rmse=0.05; give it again for more.",
            show_default=False,
        ),
    ] = None,
    as_json: JsonOption = False,
    junit: JunitOption = None,
    figures: FiguresOption = ON_SCREEN,
    width: WidthOption = None,
    style: StyleOption = SCREEN,
) -> None:
    """Fly a mission: writes flight.csv, metrics.json, figures/ and, for backstepping, weights.json; prints a summary.

    Exit code 0: completed. 2: bad input. 3: the flight diverged; its log is kept up to then. 4: it completed, but a
    --require is not met.
    """
    started = time.perf_counter()
    required, drawn_on = [parsed(text) for text in require or []], sheet(figures, width, style)
    if junit:
        check_junit(junit)
    if os.path.isfile(mission):  # noqa: PTH113 (of a Path, names that no file can have are an error)
        start_server()
    folder = out or Path("out") / (mission.stem if flight is None else f"{mission.stem}-flight{flight}")
    with bar("loading") as shown:
        from quadstep.mission.fly import fly_mission  # noqa: PLC0415 (each command loads what it needs)

        def told(stage: str, done: int, total: int) -> None:
            shown.doing(stage)
            shown.to(done, total)

        result = fly_mission(mission, folder, engine, overwrite, told, flight, required, results, drawn_on)
    for warning in result.warnings:
        complain(f"warning: {mission}: {warning}")
    if not as_json:
        show_table(result.name, ("", *result.header), result.rows)
        if result.facts:
            show_table("", ("limits", "value"), result.facts)
        say(result.ending)
        for one in result.judged:
            say(one.case.sentence)
        say_whole(f"Results: {folder}")
    about = {"version": __version__, "mission": str(mission), "flight": flight, "engine": engine.value, "folder": str(folder)}
    deliver(result.verdict(about), as_json, junit, time.perf_counter() - started)


study = typer.Typer(help="Studies beyond the paper's.", rich_markup_mode=None, cls=Commands)
app.add_typer(study, name="study")
add_commands(app)
add_campaign(app)
add_envelope(app)
add_tune(app)


@study.command()
def completion(
    out: Annotated[Path, typer.Option(help="Folder for the results.")] = Path("out/completion"),
    samples: Annotated[int, typer.Option(min=1, help="Random closed loops to check the theorem on.")] = 1_000_000,
    overwrite: OverwriteOption = False,
) -> None:
    """Check the repaired theorem (docs/theory.md) on random states and fly the completed controller beside the paper's.

    Exit code 1 if an inequality is broken.
    """
    from quadstep.theory.completion import sentences, study_completion  # noqa: PLC0415

    found = study_completion(out, samples, overwrite)
    rows = [
        (margin.number, margin.statement, f"{margin.worst:.2g}", "holds" if margin.holds else "BROKEN")
        for margin in found.margins
    ]
    show_table("The theorem on random closed loops", ("number", "statement", "worst margin", "verdict"), rows)
    for sentence in sentences(found):
        say(sentence)
    say_whole(f"Report: {out / 'report.html'}")
    if not all(margin.holds for margin in found.margins):
        raise typer.Exit(1)


@study.command("vehicles")
def study_vehicles(
    out: Annotated[Path, typer.Option(help="Folder for the results.")] = Path("out/vehicles"),
    seeds: Annotated[int, typer.Option(min=1, max=1000, help="Flights of each scenario and controller.")] = 30,
    only: Annotated[list[str] | None, typer.Option(help="A vehicle; give it again for more.", show_default=False)] = None,
    overwrite: OverwriteOption = False,
) -> None:
    """Fly every preset vehicle through hover, figure eights, a step, wind, payload and a weak rotor under five controllers."""
    from quadstep.comparison import run  # noqa: PLC0415

    chosen = list(dict.fromkeys(only or run.VEHICLES))
    unknown = [name for name in chosen if name not in run.VEHICLES]
    if unknown:
        raise UserError(f"--only: {unknown[0]!r:.60} is not known; allowed: {', '.join(run.VEHICLES)}")
    with bar("flying", "flights") as shown:
        found = run.study_vehicles(out, seeds, chosen, overwrite, shown.to)
    for vehicle in chosen:
        show_table(f"{vehicle}: RMSE [cm], 95 % interval", ("", *run.CONTROLLERS), run.table_rows(found, vehicle))
    for sentence in run.sentences(found, chosen):
        say(sentence)
    say_whole(f"Report: {out / 'report.html'}")


@app.command()
def vehicles(
    vehicle: Annotated[
        str | None, typer.Argument(help="A preset's name, or your own vehicle file (TOML).", show_default=False)
    ] = None,
) -> None:
    """List the vehicles that come along, or every number of one, with unit and source."""
    from quadstep.mission.vehicle_list import load_preset, parameters, preset_names, read_vehicle  # noqa: PLC0415

    if vehicle is None:
        rows = []
        for name in preset_names():
            section = load_preset(name)
            built = section.build()
            lift = len(built.geometry.mounts) * built.allocation.most / (section.mass * section.gravity)
            rotors = str(len(built.geometry.mounts))
            rows.append((name, section.description, f"{section.mass:g}", rotors, f"{lift:.3g}"))
        show_table("", ("preset", "what", "mass [kg]", "rotors", "thrust over weight"), rows)
        return
    section = (
        load_preset(vehicle) if vehicle in preset_names() or not vehicle.endswith(".toml") else read_vehicle(Path(vehicle))
    )
    show_table(one_line(section.description or vehicle), ("key", "value", "unit", "meaning", "source"), parameters(section))


@app.command()
def certify(
    mission: Annotated[Path, typer.Argument(help="Mission file (TOML) with the paper's controller.", show_default=False)],
    out: Annotated[
        Path | None, typer.Option(help="Folder for the results; out/<mission's name>-certificate if left out.")
    ] = None,
    overwrite: OverwriteOption = False,
    figures: FiguresOption = USUAL,
    width: WidthOption = None,
    style: StyleOption = SCREEN,
) -> None:
    """Measure on one flight what Theorem 5.1 asks for and promises: writes certificate.json, a figure and metrics.json.

    Exit code 0: a certificate was computed, whatever it says. 2: bad input, or nothing to certify. 3: the flight diverged; the
    certificate holds up to then.
    """
    from quadstep.certify.run import certify_mission  # noqa: PLC0415

    folder = out or Path("out") / f"{mission.stem}-certificate"
    result = certify_mission(mission, folder, overwrite, sheet(figures, width, style))
    show_table(result.name, ("", "measured", "against"), result.rows)
    say(f"Verdict: {result.verdict}")
    say_whole(f"Results: {folder}")
    if not result.completed:
        raise typer.Exit(DIVERGED)


@app.command()
def new(
    mission: Annotated[Path, typer.Argument(help="File to write.", show_default=False)],
    vehicle: Annotated[
        str | None, typer.Option(help="A preset that `quadstep vehicles` lists; x500 if left out.", show_default=False)
    ] = None,
    paper: Annotated[bool, typer.Option("--paper", help="The paper's plant and controller, no real vehicle.")] = False,
    controller: Annotated[
        str | None,
        typer.Option(help="rotation-backstepping, or the paper's with --paper, if left out.", show_default=False),
    ] = None,
) -> None:
    """Write a commented mission file to start from."""
    from quadstep.mission.template import write_template  # noqa: PLC0415

    if paper and vehicle:
        raise UserError("--paper and --vehicle: choose one; the paper's plant is no vehicle of the list")
    write_template(mission, None if paper else vehicle or "x500", controller)
    say_whole(f"Wrote {mission}. Fly it: {command('fly', mission)}")


@app.command()
def verify(
    json: Annotated[Path | None, typer.Option(help="File for all rows, their checks and numbers.", show_default=False)] = None,
    only: Annotated[str | None, typer.Option(help="One row, by number (1 to 75) or name (T_eta).", show_default=False)] = None,
    every: Annotated[bool, typer.Option("--all", help="Print every row, not only those that fail.")] = False,
) -> None:
    """Hold every equation of the paper against the code that flies; print a summary and the rows that fail.

    Exit code 0: all evidence holds. 1: some row's evidence fails. 2: bad input.
    """
    try:
        from quadstep.verify import registry, report  # noqa: PLC0415
    except ModuleNotFoundError as error:
        raise missing_extra("`quadstep verify`", error) from None

    if json:
        report.check_target(json)
    rows, started = registry.chosen(only), time.perf_counter()
    with bar("verifying", "rows", len(rows)) as progress:
        results = registry.verify(rows, progress.to)
    seconds = time.perf_counter() - started
    if not only:
        show_table("The paper against the code", *report.summary(results))
    printed = [result for result in results if every or only or not result.passed]
    if printed:
        show_table("" if only else "Every row" if every else "FAILED", report.HEADER, [report.cells(one) for one in printed])
    say(report.closing(results, seconds) + ("" if every or only else "; --all prints every row"))
    if json:
        report.write_document(json, results, seconds)
        say_whole(f"Wrote {json}")
    if not all(result.passed for result in results):
        raise typer.Exit(FAILED)


def stop(_number: int, _frame: FrameType | None) -> None:
    """A request to end counts as Ctrl-C, so that nothing half-written stays."""
    raise KeyboardInterrupt


def main() -> None:
    """Run the command line; every error of the user is one line and exit code 2."""
    prepare_streams()
    for number in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, stop)
    provide_writable()
    try:
        code = run()
        sys.stdout.flush()
    except OutputError as error:
        complain(f"error: {error}")
        code = OUTPUT_LOST
    sys.exit(code)


def run() -> int | None:
    """The exit code of what the command line asks for; what is wrong is said."""
    try:
        code: int | None = app(
            standalone_mode=False,
            prog_name="quadstep",
            terminal_width=min(max(width(sys.stdout), HELP_WIDTHS[0]), HELP_WIDTHS[1]),
        )
        if code == INTERRUPTED:  # what typer makes of Ctrl-C
            complain("interrupted; nothing was written")
    except UserError as error:
        complain(f"error: {error}")
        return BAD_INPUT
    except TyperException as error:
        complain(f"error: {error.format_message()} (see quadstep --help)")
        return BAD_INPUT
    except InterruptedRun as stopped:
        complain(f"interrupted; {stopped}")
        return INTERRUPTED
    except BrokenProcessPool:
        complain("error: a process that draws figures was killed (out of memory?); nothing was written")
        return BAD_INPUT
    except (KeyboardInterrupt, typer.Abort):
        complain("interrupted; nothing was written")
        return INTERRUPTED
    return code


if __name__ == "__main__":
    main()

"""`quadstep linear` and `quadstep export`: a mission's law as a linear system, and as C."""

from pathlib import Path
from typing import Annotated

import typer

from quadstep.commands.options import FigureOptions, JsonOption, OverwriteOption, check_range, print_json, show
from quadstep.io.documents import read_toml
from quadstep.io.doors import needed_by
from quadstep.io.errors import UserError, unknown_name
from quadstep.report.bars import bar
from quadstep.report.screen import complain, say, say_whole

INSTANTS, MOST = 20, 10_000


def linear(
    file: Annotated[Path, typer.Argument(metavar="MISSION.toml", help="A mission, or a campaign.")],
    controllers: Annotated[
        str | None, typer.Option(metavar="NAMES", help="Linearise with each of these laws (comma-separated), or all.")
    ] = None,
    along: Annotated[bool, typer.Option("--along", help="Linearise at instants along the flight instead of at rest.")] = False,
    samples: Annotated[
        int | None, typer.Option(help="Instants of --along (20), or draws of a campaign (all, at most 100).")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Folder for the results; default: out/<file's name>-linear.")] = None,
    overwrite: OverwriteOption = False,
    as_json: JsonOption = False,
    *,
    drawing: FigureOptions,
) -> None:
    """Linearise the sampled closed loop where the path begins: poles, stability margins, Bode, Nyquist and step responses.

    Latency, rotor lag and the rate of every loop are exact; noise and turbulence are left out. Writes report.html,
    linear.json, margins.csv, poles.csv and figures/ (docs/linear.md).

    Exit code 0: linearised, stable or not. 2: bad input, no state of rest, or a law without a derivative there.
    """
    folder, drawn_on = out or Path("out") / f"{file.stem}-linear", drawing.sheet()
    drawn = "mission" in read_toml(file)
    check(controllers, along, samples, drawn)
    if not (drawn or along or controllers):
        from quadstep.linear.run import linear_mission

        found = linear_mission(file, folder, overwrite, drawn_on)
    else:
        from quadstep.linear.several import instants, laws

        with bar("linearising", "loops") as shown:
            if drawn:
                with needed_by("`quadstep linear` of a campaign"):
                    from quadstep.studies.campaign.single import draws

                    found = draws(file, samples, folder, overwrite, drawn_on, shown)
            elif along:
                found = instants(file, samples or INSTANTS, folder, overwrite, drawn_on, shown)
            else:
                found = laws(file, controllers or "", folder, overwrite, drawn_on, shown)
    if as_json:
        print_json(found.record)
    else:
        show(found, folder)


def check(controllers: str | None, along: bool, samples: int | None, drawn: bool) -> None:
    """Refuses options that do not go together. Raises UserError."""
    if controllers is not None and (along or drawn):
        raise UserError(f"--controllers: requires one mission at rest, not {'a campaign' if drawn else '--along'}")
    if along and drawn:
        raise UserError("--along: requires a mission, not a campaign")
    if samples is not None and not (along or drawn):
        raise UserError("--samples: requires --along or a campaign")
    check_range("--samples", samples, 1, MOST)


PRECISIONS = ("f32", "f64")


def export(
    mission: Annotated[Path, typer.Argument(metavar="MISSION.toml", help="Mission file (TOML) whose controller is exported.")],
    target: Annotated[str, typer.Option(help="c99, crazyflie, px4 or ardupilot.")] = "c99",
    out: Annotated[Path | None, typer.Option(help="Folder for the files; default: out/<mission's name>-<target>.")] = None,
    precision: Annotated[str, typer.Option(help="Floating-point type of the generated C: f32 or f64.")] = "f32",
    measure: Annotated[
        bool,
        typer.Option(
            "--measure",
            help="Measure flash, stack and instructions on Cortex-M4F and M7, MISRA deviations, and the f32 error.",
        ),
    ] = False,
    overwrite: OverwriteOption = False,
) -> None:
    """Write a mission's controller as C99 for the vehicle: source, parameters, a test with golden vectors, a data sheet.

    The generated code is yours.
    """
    from quadstep.export.run import TARGETS, ExportRequest, export_mission
    from quadstep.mission.read import read_mission

    if target not in TARGETS:
        raise UserError(f"--target: {unknown_name('value', target, TARGETS.names)}")
    if precision not in PRECISIONS:
        raise UserError(f"--precision: {unknown_name('value', precision, PRECISIONS)}")
    folder = out or Path("out") / f"{mission.stem}-{target}"
    with bar("loading") as shown:
        request = ExportRequest(target, precision == "f64", measure, overwrite)
        done = export_mission(mission, folder, request, shown.doing)
        from quadstep.linear.grade import FRAGILE, PATHS, UNSTABLE, in_firmware, quick_grade
        from quadstep.metrics.registry import UNGRADED, at_rest_sentences

        shown.doing("computing margins")
        if target in PATHS:
            margins, short = in_firmware(read_mission(mission), target)
        else:
            rest = quick_grade(read_mission(mission))
            margins, short = "".join(at_rest_sentences(rest)) or UNGRADED, rest.get("grade") in (FRAGILE, UNSTABLE)
    if short:
        complain(f"warning: {mission}: {margins}")
    for warning in done.warnings:
        complain(f"warning: {mission}: {warning}")
    for line in done.lines:
        say_whole(line)
    if margins and not short:
        say(margins)
    say_whole(f"Results: {folder}")

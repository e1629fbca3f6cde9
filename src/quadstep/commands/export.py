"""`quadstep export`."""

from pathlib import Path
from typing import Annotated

import typer

from quadstep.commands.options import OverwriteOption
from quadstep.io.errors import UserError, unknown_name
from quadstep.report.bars import bar
from quadstep.report.screen import complain, say, say_whole

PRECISIONS = ("f32", "f64")


def export(
    mission: Annotated[Path, typer.Argument(help="Mission file (TOML) whose controller is exported.", show_default=False)],
    target: Annotated[str, typer.Option(help="c99, crazyflie, px4 or ardupilot.")] = "c99",
    out: Annotated[
        Path | None, typer.Option(help="Folder for the files; default: out/<mission's name>-<target>.", show_default=False)
    ] = None,
    precision: Annotated[str, typer.Option(help="Numbers of the C code: f32 or f64.")] = "f32",
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

    The generated code is yours. Exit code 2: bad input.
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
        from quadstep.metrics.registry import at_rest_sentences

        shown.doing("computing margins")
        if target in PATHS:
            margins, short = in_firmware(read_mission(mission), target)
        else:
            rest = quick_grade(read_mission(mission))
            margins, short = "".join(at_rest_sentences(rest)), rest.get("grade") in (FRAGILE, UNSTABLE)
    if short:
        complain(f"warning: {mission}: {margins}")
    for warning in done.warnings:
        complain(f"warning: {mission}: {warning}")
    for line in done.said:
        say_whole(line)
    if margins and not short:
        say(margins)
    say_whole(f"Results: {folder}")

"""`quadstep compare`."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from quadstep.commands.deliver import show
from quadstep.commands.options import Drawing, OverwriteOption, check_range, engine_option
from quadstep.engines.engine import JOBS, Engine
from quadstep.io.doors import needed_by
from quadstep.io.errors import BAD_INPUT
from quadstep.report.bars import Bar, bar
from quadstep.report.screen import complain
from quadstep.report.sheet import Sheet

if TYPE_CHECKING:
    from quadstep.studies.comparison.run import FinishedComparison, How
    from quadstep.studies.comparison.study import ComparisonStudy

MOST_SEEDS, USUAL_SEEDS = 100_000, 100

EngineOption = Annotated[Engine, engine_option(JOBS)]
KeepGoingOption = Annotated[
    bool, typer.Option("--keep-going", help="Continue with the others if a controller fails; exit code 2 at the end.")
]
RetuneOption = Annotated[bool, typer.Option("--retune", help="Also tune controllers for which the study supplies gains.")]


def compare(
    files: Annotated[
        list[Path], typer.Argument(metavar="STUDY.toml", help="A study; or two or more missions.", show_default=False)
    ],
    seeds: Annotated[
        int | None,
        typer.Option(help="Flights per cell, instead of the study's (or, with missions, of 100).", show_default=False),
    ] = None,
    engine: EngineOption = Engine.LANES,
    retune: RetuneOption = False,
    keep_going: KeepGoingOption = False,
    out: Annotated[Path | None, typer.Option(help="Folder for the results; default: out/<study's name>.")] = None,
    overwrite: OverwriteOption = False,
    *,
    drawing: Drawing,
) -> None:
    """Compare controllers: tuned with equal budgets, flown through the same draws, judged with intervals (docs/compare.md).

    Writes report.html, page.html, cells.csv, pairs.csv, table.tex, gains.json, flights/*.parquet. Interrupted, the same
    command goes on.

    Exit code 0: compared. 2: bad input, or something could not be flown. 130: interrupted.
    """
    check_range("--seeds", seeds, 2, MOST_SEEDS)
    drawn_on = drawing.sheet()
    folder = out or Path("out") / (files[0].stem if len(files) == 1 else "compare")
    with needed_by("`quadstep compare`"):
        from quadstep.studies.comparison.missions import compare_missions
        from quadstep.studies.comparison.study import read_study

        if len(files) == 1:
            run_study(read_study(files[0]), folder, seeds, engine, retune, keep_going, overwrite, drawn_on)
            return
        with bar("flying", "flights") as shown:
            how = how_of(shown, engine, overwrite, keep_going, retune, drawn_on)
            done = compare_missions(files, folder, seeds or USUAL_SEEDS, how)
    said(done)


def run_study(
    study: "ComparisonStudy", folder: Path, seeds: int | None, engine: Engine, retune: bool, keep_going: bool, overwrite: bool,
    drawn_on: Sheet,
) -> None:  # fmt: skip
    """Work a study out, and say what was found."""
    from quadstep.studies.comparison.run import compare_study

    if seeds is not None:
        study = study._replace(file=study.file.model_copy(update={"seeds": seeds}))
    with bar("tuning", "flights") as shown:
        done = compare_study(study, folder, how_of(shown, engine, overwrite, keep_going, retune, drawn_on))
    said(done)


def how_of(shown: Bar, engine: Engine, overwrite: bool, keep_going: bool, retune: bool, drawn_on: Sheet) -> "How":
    """How it is worked out. shown: the progress bar."""
    from quadstep.studies.comparison.run import How

    return How(engine, overwrite, keep_going, retune, shown, drawn_on)


def said(done: "FinishedComparison") -> None:
    """Say what was found. Raises typer.Exit where something could not be flown."""
    show(done.evidence, done.folder)
    for one in done.found.problems:
        complain(f"error: {one.line}")
    if done.found.problems:
        raise typer.Exit(BAD_INPUT)

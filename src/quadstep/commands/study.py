"""`quadstep study`: studies that go beyond the paper."""

from pathlib import Path
from typing import Annotated

import typer

from quadstep.commands.compare import EngineOption, KeepGoingOption, RetuneOption, SeedsOption, check_seeds, run_study
from quadstep.commands.options import OverwriteOption
from quadstep.comparison.engine import CompareEngine
from quadstep.exit_codes import FAILED
from quadstep.extras import needed_by
from quadstep.report.sheet import SCREEN, USUAL, sheet
from quadstep.terminal.screen import say, say_whole
from quadstep.terminal.tables import show_table


def completion(
    out: Annotated[Path, typer.Option(help="Folder for the results.")] = Path("out/completion"),
    samples: Annotated[int, typer.Option(min=1, help="Number of random closed loops to check the theorem on.")] = 1_000_000,
    overwrite: OverwriteOption = False,
) -> None:
    """Check the repaired theorem (docs/theory.md) on random states and fly the completed controller beside the paper's.

    Exit code 1 if an inequality does not hold.
    """
    from quadstep.theory.completion import sentences, study_completion

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
        raise typer.Exit(FAILED)


def controllers(
    out: Annotated[Path, typer.Option(help="Folder for the results.")] = Path("out/controllers"),
    seeds: SeedsOption = None,
    engine: EngineOption = CompareEngine.LANES,
    retune: RetuneOption = False,
    keep_going: KeepGoingOption = False,
    overwrite: OverwriteOption = False,
) -> None:
    """Compare the controllers of the package on the 2.6 kg vehicle and the Crazyflie: wind, payload, faults, latency,
    estimator.

    The study that `quadstep compare` would read is in the package, with the gains that it found; --retune finds them anew.
    """
    check_seeds(seeds)
    with needed_by("`quadstep study controllers`"):
        from quadstep.comparison.shipped import shipped_study

        run_study(shipped_study(), out, seeds, engine, retune, keep_going, overwrite, sheet(USUAL, None, SCREEN))

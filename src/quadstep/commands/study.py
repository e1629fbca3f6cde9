"""`quadstep study`: studies that go beyond the paper."""

from pathlib import Path
from typing import Annotated

import typer

from quadstep.commands.options import OverwriteOption
from quadstep.errors import UserError
from quadstep.exit_codes import FAILED
from quadstep.terminal.bars import bar
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


def vehicles(
    out: Annotated[Path, typer.Option(help="Folder for the results.")] = Path("out/vehicles"),
    seeds: Annotated[int, typer.Option(min=1, max=1000, help="Flights per scenario and controller.")] = 30,
    only: Annotated[list[str] | None, typer.Option(help="Only this vehicle; may be repeated.", show_default=False)] = None,
    overwrite: OverwriteOption = False,
) -> None:
    """Fly every preset vehicle through hover, figure eights, a step, wind, payload and a weak rotor under five controllers."""
    from quadstep.comparison import run

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

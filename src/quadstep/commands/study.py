"""`quadstep study`: studies that go beyond the paper."""

from pathlib import Path
from typing import Annotated

import typer

from quadstep.commands.compare import MOST_SEEDS, EngineOption, KeepGoingOption, RetuneOption, run_study
from quadstep.commands.deliver import show
from quadstep.commands.options import OverwriteOption, check_range
from quadstep.engines.engine import Engine
from quadstep.io.doors import needed_by
from quadstep.io.errors import FAILED
from quadstep.report.screen import say, show_table
from quadstep.report.sheet import SCREEN, USUAL, sheet

LOOPS = 5_000
"""Closed loops that the lines of Theorem B are tried on."""


def completion(
    out: Annotated[Path, typer.Option(help="Folder for the results.")] = Path("out/completion"),
    samples: Annotated[int, typer.Option(min=1, help="Number of random closed loops to check the theorem on.")] = 1_000_000,
    overwrite: OverwriteOption = False,
) -> None:
    """Check the repaired theorem (docs/theory.md) on random states and fly the completed controller beside the paper's.

    Exit code 1 if a statement does not hold, or holds with 0.9 of a term of its bound as well.
    """
    from quadstep.proofs.theory.completion import study_completion

    found = study_completion(out, samples, overwrite)
    show(found, out)
    if found.cases[0].failure:
        raise typer.Exit(FAILED)


def region(
    force: Annotated[float, typer.Option(min=0.0, help="Bound of the unknown force [N].")] = 0.0,
    torque: Annotated[float, typer.Option(min=0.0, help="Bound of the unknown torque [N m].")] = 0.0,
    bias: Annotated[float, typer.Option(min=0.0, help="Bound of a constant unknown force [N], say from a wrong mass.")] = 0.0,
) -> None:
    """Certify the region of Theorem B (docs/theory.md) for the completed law's defaults in exact rationals; fly from its edge.

    Exit code 1 if it does not hold, if a flight without nets exceeds what it allows, or L_dot its bound.
    """
    from quadstep.proofs.theory.edge import default_region, edge_rows, fly_edge, least_frequency, line_rows, region_rows
    from quadstep.proofs.theory.flow import Flow, draw, shares_of_lines

    found = default_region(force, torque, bias)
    if found is None:
        say("No region is certified for these bounds of force and torque.")
        raise typer.Exit(FAILED)
    show_table("What L <= level implies, for ever", ("quantity", "at most"), region_rows(found, least_frequency(found)))
    flights = fly_edge(found)
    header = ("start off the path", "by", "|r1|", "|e1|", "|r2|", "with nets")
    show_table("Flights from the edge: largest norm over its bound", header, edge_rows(flights))
    flow = Flow(found, force, torque)
    slope, lines = draw(flow, 1, LOOPS), shares_of_lines(flow, 1, LOOPS)
    show_table("Lines of Q: share of the coefficient that closed loops use", ("between", "used"), line_rows(lines))
    say(f"On {LOOPS:,} closed loops inside L_dot + s^T Q s is at most {slope.used:.2f} of d . s.")
    inside = all(max(flight.returned) <= 1.0 for flight in flights)
    if not (inside and slope.used <= 1.0 and all(share <= 1.0 + 1e-6 for share in lines.values())):
        raise typer.Exit(FAILED)


def controllers(
    out: Annotated[Path, typer.Option(help="Folder for the results.")] = Path("out/controllers"),
    seeds: Annotated[int | None, typer.Option(help="Flights per cell, instead of the study's.", show_default=False)] = None,
    engine: EngineOption = Engine.LANES,
    retune: RetuneOption = False,
    keep_going: KeepGoingOption = False,
    overwrite: OverwriteOption = False,
) -> None:
    """Compare the controllers of the package on the 2.6 kg vehicle and the Crazyflie: wind, payload, faults, latency,
    estimator.

    The study that `quadstep compare` would read is in the package, with the gains that it found; --retune repeats the search.
    """
    check_range("--seeds", seeds, 2, MOST_SEEDS)
    with needed_by("`quadstep study controllers`"):
        from quadstep.studies.comparison.study import shipped_study

        run_study(shipped_study(), out, seeds, engine, retune, keep_going, overwrite, sheet(USUAL, None, SCREEN))


studies = typer.Typer(help="Studies beyond the paper's.", rich_markup_mode=None)
for one in (completion, region, controllers):
    studies.command()(one)

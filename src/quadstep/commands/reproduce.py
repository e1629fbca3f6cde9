"""`quadstep reproduce`."""

from pathlib import Path
from typing import Annotated

import typer

from quadstep.commands.options import Drawing, EngineOption, OverwriteOption
from quadstep.engines.engine import Engine
from quadstep.report.screen import say_whole, show_table, typeset


def reproduce(
    out: Annotated[Path, typer.Option(help="Folder for the results.")] = Path("out/paper"),
    engine: EngineOption = Engine.LANES,
    overwrite: OverwriteOption = False,
    *,
    drawing: Drawing,
) -> None:
    """Fly the paper's cases and the stress flights, judge its claims, write figures, CSV, JSON and report.html."""
    from quadstep.studies.paper.reproduce import reproduce as run

    claims = run(out, engine, overwrite, drawing.sheet())
    rows = [(typeset(claim.name), typeset(claim.measured), claim.verdict) for claim in claims]
    show_table("Section 6 of the paper, claim by claim", ("claim", "measured", "verdict"), rows)
    say_whole(f"Report: {out / 'report.html'}")

"""`quadstep new`."""

from pathlib import Path
from typing import Annotated

import typer

from quadstep.io.errors import UserError
from quadstep.report.terminal.screen import command, say_whole


def new(
    mission: Annotated[Path, typer.Argument(help="File to write.", show_default=False)],
    vehicle: Annotated[
        str | None,
        typer.Option(
            help="A preset listed by `quadstep vehicles`, planar, or your own FILE.py:NAME; default: x500.", show_default=False
        ),
    ] = None,
    paper: Annotated[bool, typer.Option("--paper", help="Use the paper's plant and controller instead of a vehicle.")] = False,
    controller: Annotated[
        str | None,
        typer.Option(help="Default: rotation-backstepping, or the paper's with --paper.", show_default=False),
    ] = None,
) -> None:
    """Write a commented mission file to start from."""
    from quadstep.mission.template import write_template

    if paper and vehicle:
        raise UserError("--paper and --vehicle: choose one; the paper's plant is not one of the vehicles")
    write_template(mission, None if paper else vehicle or "x500", controller)
    say_whole(f"Wrote {mission}. Fly it: {command('fly', mission)}")

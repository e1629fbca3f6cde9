"""`quadstep advise`."""

from pathlib import Path
from typing import Annotated

import typer

from quadstep.commands.deliver import Delivery
from quadstep.commands.options import Drawing, OverwriteOption
from quadstep.io.errors import UserError


def advise(
    log: Annotated[
        Path,
        typer.Argument(metavar="LOG", help="A log of a flight with an excitation, or with quick turns.", show_default=False),
    ],
    mission: Annotated[
        Path | None,
        typer.Option(
            metavar="MISSION.toml", help="A mission whose modelled margins are shown for comparison.", show_default=False
        ),
    ] = None,
    columns: Annotated[
        str | None,
        typer.Option(
            metavar="X,Y",
            help="Columns of the excitation and of the command that contains it; for logs of other autopilots.",
            show_default=False,
        ),
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Folder for the results; default: out/<log's name>-advise.")] = None,
    overwrite: OverwriteOption = False,
    *,
    delivery: Delivery,
    drawing: Drawing,
) -> None:
    """Measure a loop's margins in flight, and say which gains would repair them: log in, advice out (docs/advise.md).

    Exit code 2: the log has no excitation, or one that does not determine the margins; the reason is printed.
    """
    from quadstep.studies.advise import advise as advised

    folder = out or Path("out") / f"{log.stem}-advise"
    found = advised(log, pair(columns), mission, folder, overwrite, drawing.sheet())
    delivery.finish(found, "advise", folder)


def pair(text: str | None) -> tuple[str, str] | None:
    """The two columns. Raises UserError."""
    if text is None:
        return None
    names = [one.strip() for one in text.split(",")]
    if len(names) != 2 or not all(names) or names[0] == names[1]:
        raise UserError(f"--columns: should be two columns, EXCITATION,COMMAND, not {text!r:.80}")
    return names[0], names[1]

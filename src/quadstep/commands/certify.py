"""`quadstep certify`."""

from pathlib import Path
from typing import Annotated

import typer

from quadstep.commands.deliver import show
from quadstep.commands.options import Drawing, OverwriteOption
from quadstep.io.errors import DIVERGED


def certify(
    mission: Annotated[Path, typer.Argument(help="Mission file (TOML) with the paper's controller.", show_default=False)],
    out: Annotated[
        Path | None, typer.Option(help="Folder for the results; default: out/<mission's name>-certificate.")
    ] = None,
    overwrite: OverwriteOption = False,
    *,
    drawing: Drawing,
) -> None:
    """Measure on one flight what Theorem 5.1 requires and promises.

    Writes report.html, certificate.json, a figure and metrics.json.


    Exit code 0: a certificate was computed, whatever it says. 2: bad input, or nothing to certify. 3: the flight diverged; the
    certificate covers it up to then.
    """
    from quadstep.proofs.certify.run import certify_mission

    folder = out or Path("out") / f"{mission.stem}-certificate"
    found = certify_mission(mission, folder, overwrite, drawing.sheet())
    show(found, folder)
    if found.cases[0].failure:
        raise typer.Exit(DIVERGED)

"""`quadstep envelope`."""

from pathlib import Path
from typing import Annotated

import typer

from quadstep.commands.deliver import Delivery
from quadstep.commands.options import Drawing, OverwriteOption, engine_option
from quadstep.engines.engine import CAMPAIGNS, Engine
from quadstep.io.doors import needed_by
from quadstep.report.terminal.bars import bar


def envelope(
    file: Annotated[
        Path,
        typer.Argument(
            metavar="MISSION.toml", help="Mission file, or a campaign file that varies more keys.", show_default=False
        ),
    ],
    x: Annotated[str, typer.Option(metavar="KEY=a:b:n", help="Horizontal axis: n values from a to b; or KEY=v1,v2,...")],
    y: Annotated[str, typer.Option(metavar="KEY=a:b:n", help="Vertical axis, in the same form.")],
    by: Annotated[str | None, typer.Option(metavar="KEY=v1,v2", help="One panel per value.", show_default=False)] = None,
    flights: Annotated[
        int | None, typer.Option(help="Flights per cell; default: 1, or 20 if flights differ.", show_default=False)
    ] = None,
    failure: Annotated[
        list[str] | None,
        typer.Option(
            metavar="METRIC=MOST", help="Limit above which a flight counts as failed; may be repeated.", show_default=False
        ),
    ] = None,
    engine: Annotated[Engine, engine_option(CAMPAIGNS)] = Engine.LANES,
    out: Annotated[Path | None, typer.Option(help="Folder for the results; default: out/<mission's name>-envelope.")] = None,
    overwrite: OverwriteOption = False,
    *,
    delivery: Delivery,
    drawing: Drawing,
) -> None:
    """Map where a mission can be flown, and how well, over two of its keys.

    Writes report.html, envelope.png, envelope.svg, envelope.parquet (one row per cell), table.tex and metrics.json.
    """
    with needed_by("`quadstep envelope`"):
        from quadstep.linear.grade import quick_grade
        from quadstep.studies.envelope.request import request
        from quadstep.studies.envelope.run import Map
        from quadstep.studies.study import run

        folder, drawn_on = out or Path("out") / f"{file.stem}-envelope", drawing.sheet()
        asked = Map(request(file, x, y, by, failure or (), flights))
        with bar("flying", "flights", asked.flights) as shown:
            evidence = run(asked, folder, engine, overwrite, shown, drawn_on, quick_grade).evidence
    delivery.finish(evidence, "envelope", folder)

"""`quadstep envelope`."""

from pathlib import Path
from typing import Annotated

import typer

from quadstep.commands.options import FiguresOption, OverwriteOption, StyleOption, WidthOption, engine_option
from quadstep.engines.engine import CAMPAIGNS, Engine
from quadstep.io.extras import needed_by
from quadstep.report.sheet import SCREEN, USUAL, sheet
from quadstep.report.terminal.bars import bar
from quadstep.report.terminal.screen import say, say_whole


def envelope(
    file: Annotated[
        Path,
        typer.Argument(
            metavar="MISSION.toml", help="Mission file, or a campaign file that varies further keys.", show_default=False
        ),
    ],
    x: Annotated[str, typer.Option(metavar="KEY=a:b:n", help="Horizontal axis: n values from a to b; or KEY=v1,v2,...")],
    y: Annotated[str, typer.Option(metavar="KEY=a:b:n", help="Vertical axis, in the same form.")],
    by: Annotated[str | None, typer.Option(metavar="KEY=v1,v2", help="One panel per value.", show_default=False)] = None,
    flights: Annotated[
        int | None, typer.Option(help="Flights per cell; default: 1, or 20 where flights differ.", show_default=False)
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
    figures: FiguresOption = USUAL,
    width: WidthOption = None,
    style: StyleOption = SCREEN,
) -> None:
    """Map, over two keys of a mission, where it can be flown, and how well.

    Writes report.html, envelope.png, envelope.svg, envelope.parquet (one row per cell) and metrics.json.
    """
    with needed_by("`quadstep envelope`"):
        from quadstep.studies.envelope.request import request
        from quadstep.studies.envelope.run import fly_envelope, sentence

        folder, drawn_on = out or Path("out") / f"{file.stem}-envelope", sheet(figures, width, style)
        asked = request(file, x, y, by, failure or (), flights)
        with bar("flying", "flights", asked.cells * asked.flights) as shown:
            found = fly_envelope(asked, folder, engine, overwrite, shown, drawn_on)
    say(sentence(found))
    say_whole(f"Map: {folder / f'envelope.{drawn_on.formats[0]}'}")
    say_whole(f"Report: {folder / 'report.html'}")

"""The command `quadstep envelope`."""

from pathlib import Path
from typing import Annotated

import typer

from quadstep.envelope.engine import EnvelopeEngine
from quadstep.extras import missing_extra
from quadstep.report.sheet import SCREEN, USUAL, sheet
from quadstep.report.sheet_options import FiguresOption, StyleOption, WidthOption
from quadstep.terminal.bars import bar
from quadstep.terminal.screen import say, say_whole


def add_envelope(app: typer.Typer) -> None:
    """Register the command."""

    @app.command()
    def envelope(
        file: Annotated[
            Path, typer.Argument(metavar="MISSION.toml", help="Mission, or a campaign that varies more.", show_default=False)
        ],
        x: Annotated[str, typer.Option(metavar="KEY=a:b:n", help="To the right: n values from a to b; or KEY=v1,v2,...")],
        y: Annotated[str, typer.Option(metavar="KEY=a:b:n", help="Upwards, in the same way.")],
        by: Annotated[
            str | None, typer.Option(metavar="KEY=v1,v2", help="A panel for each of these values.", show_default=False)
        ] = None,
        flights: Annotated[
            int | None, typer.Option(help="Flights a cell; 1, or 20 if they differ, if left out.", show_default=False)
        ] = None,
        failure: Annotated[
            list[str] | None,
            typer.Option(
                metavar="METRIC=MOST", help="Above what a flight has failed; give it again for more.", show_default=False
            ),
        ] = None,
        engine: Annotated[
            EnvelopeEngine, typer.Option(help="lanes: all cores. gpu: an NVIDIA graphics processor.")
        ] = EnvelopeEngine.LANES,
        out: Annotated[
            Path | None, typer.Option(help="Folder for the results; out/<mission's name>-envelope if left out.")
        ] = None,
        overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace other results in the folder.")] = False,
        figures: FiguresOption = USUAL,
        width: WidthOption = None,
        style: StyleOption = SCREEN,
    ) -> None:
        """Map where over two keys of a mission it can be flown, and how well.

        Writes envelope.png, envelope.svg, envelope.parquet (a row a cell) and metrics.json.
        """
        try:
            from quadstep.envelope.request import request  # noqa: PLC0415 (each command loads what it needs)
            from quadstep.envelope.run import fly_envelope, sentence  # noqa: PLC0415

            folder, drawn_on = out or Path("out") / f"{file.stem}-envelope", sheet(figures, width, style)
            asked = request(file, x, y, by, failure or (), flights)
            with bar("flying", "flights", asked.cells * asked.flights) as shown:
                found = fly_envelope(asked, folder, engine, overwrite, shown.to, drawn_on)
        except ModuleNotFoundError as error:
            raise missing_extra("`quadstep envelope`", error) from None
        say(sentence(found))
        say_whole(f"Map: {folder / f'envelope.{drawn_on.formats[0]}'}")

"""What the commands that draw take on their command lines; apart, as drawing processes need none of it."""

from typing import Annotated

import typer

FiguresOption = Annotated[str, typer.Option("--figures", metavar="FORMATS", help="Of the figures: png, svg, pdf.")]
WidthOption = Annotated[
    float | None,
    typer.Option("--width", metavar="MM", help="Of a figure: 88 for one column, 180 for two.", show_default=False),
]
StyleOption = Annotated[
    str, typer.Option("--style", help="screen; paper: serif, no titles; or a Matplotlib style file (.mplstyle).")
]

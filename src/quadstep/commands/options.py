"""Options that several commands share."""

from pathlib import Path
from typing import Annotated

import typer

from quadstep.engines.engine import FLIGHTS, FLOWN_BY, WORDS, Engine
from quadstep.io.errors import UserError


def engine_option(work: str) -> object:
    """`--engine` of a command that does this kind of work."""
    allowed = FLOWN_BY[work]

    def engine(text: str) -> Engine:
        if text not in allowed:
            raise ValueError(f"{text!r} is not one of {', '.join(allowed.names)}.")
        return Engine(text)

    told = ". ".join(f"{name}: {WORDS[Engine(name)]}" for name in allowed.own)
    return typer.Option(
        parser=engine, metavar=f"<{'|'.join(allowed.own)}>", autocompletion=lambda: list(allowed.names), help=f"{told}."
    )


EngineOption = Annotated[Engine, engine_option(FLIGHTS)]
ReplaceOption = Annotated[bool, typer.Option("--overwrite", help="Replace an existing file.")]
OverwriteOption = Annotated[bool, typer.Option("--overwrite", help="Replace other results in the folder.")]
FiguresOption = Annotated[str, typer.Option("--figures", metavar="FORMATS", help="Figure formats: png, svg, pdf.")]


def millimetres(text: str) -> float:
    """88, 88mm or 88 mm."""
    try:
        return float(text.strip().removesuffix("mm"))
    except ValueError:
        raise UserError(f"--width: should be millimetres, like 88 or 88mm, not {text!r:.40}") from None


WidthOption = Annotated[
    float | None,
    typer.Option(
        "--width", metavar="MM", parser=millimetres, help="Figure width: 88 for one column, 180 for two.", show_default=False
    ),
]
StyleOption = Annotated[
    str, typer.Option("--style", help="screen; paper: serif, no titles; or a Matplotlib style file (.mplstyle).")
]
SignalsOption = Annotated[
    str | None,
    typer.Option(
        "--signals",
        metavar="NAMES",
        help="Draw only these: figures or panels, such as position or z,z_d-z,u; a wrong name lists them.",
        show_default=False,
    ),
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else; for machines.")]
JunitOption = Annotated[
    Path | None, typer.Option(metavar="FILE", help="Write the verdict as JUnit XML, for a CI service.", show_default=False)
]
OpenOption = Annotated[bool, typer.Option("--open", help="Open it in the browser.")]

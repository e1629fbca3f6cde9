"""`quadstep advise` and `quadstep what-if`: which parameters a log asks for, and what other parameters would do."""

from pathlib import Path
from typing import Annotated

import typer

from quadstep.commands.options import Delivery, FigureOptions, OverwriteOption, QuickFigureOptions, check_range, check_seed
from quadstep.io.errors import UserError
from quadstep.report.bars import bar
from quadstep.report.pool import start_server


def advise(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="Log of a flight with quick stick moves, autotune or a chirp.")],
    mission: Annotated[
        Path | None, typer.Option(metavar="MISSION.toml", help="A mission whose modelled margins are shown for comparison.")
    ] = None,
    columns: Annotated[
        str | None,
        typer.Option(
            metavar="EXCITATION,COMMAND",
            help="Columns of the excitation and of the command that contains it; for logs of other autopilots.",
        ),
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Folder for the results; default: out/<log's name>-advise.")] = None,
    overwrite: OverwriteOption = False,
    *,
    delivery: Delivery,
    drawing: FigureOptions,
) -> None:
    """Measure a loop's margins from a flight log, and advise gains that would make it sound (docs/advise.md).

    Exit code 0: measured, sound or not. 2: bad input, or a log that does not determine the margins.
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


MOST = 1_000_000

ParametersArgument = Annotated[
    str,
    typer.Argument(
        metavar="FILE", help="Parameter file saved from the autopilot, or a stock law such as px4-cascade for its defaults."
    ),
]
ChangesArgument = Annotated[
    list[str], typer.Argument(metavar="NAME=VALUE", help="The change, such as MC_ROLLRATE_P=0.2; or a second parameter file.")
]


def what_if(
    parameters: ParametersArgument,
    changes: ChangesArgument,
    vehicle: Annotated[str, typer.Option(metavar="VEHICLE", help="A preset's name, or a vehicle file (TOML).")],
    wind: Annotated[float, typer.Option(metavar="M/S", help="Largest mean wind per axis; also sets the turbulence.")] = 3.0,
    within: Annotated[float, typer.Option(metavar="M", help="A flight fails if it is ever farther from its target.")] = 1.0,
    flights: Annotated[int, typer.Option(help="Flights in gusts, before and after.")] = 1000,
    seed: Annotated[int, typer.Option(help="Seed of wind and noise.")] = 1,
    out: Annotated[Path | None, typer.Option(help="Folder for the results; default: out/<file's name>-what-if.")] = None,
    page: Annotated[bool, typer.Option("--page", help="Also write page.html, with sliders for the change.")] = False,
    overwrite: OverwriteOption = False,
    *,
    delivery: Delivery,
    drawing: QuickFigureOptions,
) -> None:  # fmt: skip
    """Compare a vehicle before and after a change of autopilot parameters: step, margins, noise, power, failures in gusts.

    Flies the same winds before and after. Writes report.html, a figure of the step and metrics.json (docs/stock.md).
    """
    check_range("--wind", wind, 0.0, 100.0)
    check_range("--within", within, 0.01, 100.0)
    check_range("--flights", flights, 2, MOST)
    check_seed(seed)
    start_server()
    from quadstep.studies.what_if import answer, changes_of
    from quadstep.studies.what_if_report import Question

    values, *more = changes_of(changes, parameters)
    asked = Question(parameters, values, vehicle, wind, flights, seed, within, *more)
    folder, drawn_on = out or Path("out") / f"{Path(parameters).stem}-what-if", drawing.sheet()
    with bar("flying", "flights", 2 * flights) as shown:
        evidence = answer(asked, folder, overwrite, shown, drawn_on, page)
    delivery.finish(evidence, "what-if", folder)

"""`quadstep linear`."""

import json
import sys
from pathlib import Path
from typing import Annotated

import typer

from quadstep.commands.options import FiguresOption, JsonOption, OverwriteOption, StyleOption, WidthOption
from quadstep.report.sheet import SCREEN, USUAL, sheet
from quadstep.terminal.screen import say, say_whole
from quadstep.terminal.tables import show_table


def linear(
    mission: Annotated[Path, typer.Argument(metavar="MISSION.toml", help="Mission file.", show_default=False)],
    out: Annotated[Path | None, typer.Option(help="Folder for the results; default: out/<mission's name>-linear.")] = None,
    overwrite: OverwriteOption = False,
    as_json: JsonOption = False,
    figures: FiguresOption = USUAL,
    width: WidthOption = None,
    style: StyleOption = SCREEN,
) -> None:
    """Linearise the sampled closed loop where the path begins: poles, stability margins, Bode, Nyquist and step responses.

    Latency, rotor lag and the rate of every loop are exact; noise and turbulence are left out. Writes report.html,
    linear.json, margins.csv, poles.csv and figures/ (docs/linear.md).

    Exit code 0: linearised, stable or not. 2: bad input, or no state of rest, or a law without slopes there.
    """
    from quadstep.linear import tables
    from quadstep.linear.run import REPORT, linear_mission

    folder = out or Path("out") / f"{mission.stem}-linear"
    done = linear_mission(mission, folder, overwrite, sheet(figures, width, style))
    found = done.studied.analysis
    if as_json:
        sys.stdout.write(json.dumps(done.record, indent=2, allow_nan=False) + "\n")
        return
    if found.stable:
        show_table(f"{done.name}: margins, one loop opened at a time", tables.MARGIN_HEADER, tables.margin_rows(found))
    show_table("The slowest poles", tables.POLE_HEADER, tables.pole_rows(found.poles))
    for sentence in tables.sentences(found):
        say(sentence)
    say_whole(f"Report: {folder / REPORT}")

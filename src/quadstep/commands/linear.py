"""`quadstep linear`."""

import json
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from quadstep.commands.options import FiguresOption, JsonOption, OverwriteOption, StyleOption, WidthOption
from quadstep.io.documents import read_toml
from quadstep.io.errors import UserError
from quadstep.io.extras import needed_by
from quadstep.report.sheet import SCREEN, USUAL, sheet
from quadstep.report.terminal.bars import bar
from quadstep.report.terminal.screen import command, say, say_whole
from quadstep.report.terminal.tables import show_table

if TYPE_CHECKING:
    from quadstep.linear.run import Done
    from quadstep.linear.several import Several

INSTANTS, MOST = 20, 10_000


def linear(
    file: Annotated[Path, typer.Argument(metavar="MISSION.toml", help="A mission, or a campaign.", show_default=False)],
    controllers: Annotated[
        str | None,
        typer.Option(
            metavar="NAMES", help="Linearise under each of these laws, separated by commas; or all.", show_default=False
        ),
    ] = None,
    along: Annotated[bool, typer.Option("--along", help="Linearise at instants along the flight instead of at rest.")] = False,
    samples: Annotated[
        int | None,
        typer.Option(help="Instants of --along (20), or draws of a campaign (all, at most 100).", show_default=False),
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Folder for the results; default: out/<file's name>-linear.")] = None,
    overwrite: OverwriteOption = False,
    as_json: JsonOption = False,
    figures: FiguresOption = USUAL,
    width: WidthOption = None,
    style: StyleOption = SCREEN,
) -> None:
    """Linearise the sampled closed loop where the path begins: poles, stability margins, Bode, Nyquist and step responses.

    Latency, rotor lag and the rate of every loop are exact; noise and turbulence are left out. Writes report.html,
    linear.json, margins.csv, poles.csv and figures/ (docs/linear.md).

    Exit code 0: linearised, stable or not. 2: bad input, no state of rest, or a law that has no slope there.
    """
    folder, drawn_on = out or Path("out") / f"{file.stem}-linear", sheet(figures, width, style)
    drawn = "mission" in read_toml(file)
    check(controllers, along, samples, drawn)
    if not (drawn or along or controllers):
        from quadstep.linear.run import linear_mission

        one = linear_mission(file, folder, overwrite, drawn_on)
        deliver(one.record, as_json, partial(show, one, folder))
        return
    from quadstep.linear.several import about, instants, laws

    with bar("linearising", "loops") as shown:
        if drawn:
            with needed_by("`quadstep linear` of a campaign"):
                from quadstep.studies.linear_draws import draws

                found = draws(file, samples, folder, overwrite, drawn_on, shown)
        elif along:
            found = instants(file, samples or INSTANTS, folder, overwrite, drawn_on, shown)
        else:
            found = laws(file, controllers or "", folder, overwrite, drawn_on, shown)
    deliver(about(found, file), as_json, partial(show_several, found, folder, file))


def check(controllers: str | None, along: bool, samples: int | None, drawn: bool) -> None:
    """Refuses options that do not go together. Raises UserError."""
    if controllers is not None and (along or drawn):
        raise UserError(f"--controllers: requires one mission at rest, not {'a campaign' if drawn else '--along'}")
    if along and drawn:
        raise UserError("--along: requires a mission, not a campaign")
    if samples is not None and not (along or drawn):
        raise UserError("--samples: requires --along or a campaign")
    if samples is not None and not 1 <= samples <= MOST:
        raise UserError(f"--samples: should be from 1 to {MOST}, not {samples}")


def deliver(record: dict[str, object], as_json: bool, otherwise: Callable[[], None]) -> None:
    """Print one JSON object, or show it."""
    if as_json:
        sys.stdout.write(json.dumps(record, indent=2, allow_nan=False) + "\n")
    else:
        otherwise()


def show(done: "Done", folder: Path) -> None:
    """Print one loop."""
    from quadstep.linear import tables
    from quadstep.linear.run import REPORT

    found = done.studied.analysis
    if found.stable:
        show_table(f"{done.name}: margins, one loop opened at a time", tables.MARGIN_HEADER, tables.margin_rows(found))
    show_table("The slowest poles", tables.POLE_HEADER, tables.pole_rows(found.poles))
    for sentence in done.sentences:
        say(sentence)
    say_whole(f"Report: {folder / REPORT}")


def show_several(done: "Several", folder: Path, file: Path) -> None:
    """Print several loops: of laws each, of others the worst."""
    from quadstep.linear import worst
    from quadstep.linear.several import REPORT

    least = worst.worst(done.found)
    if done.kind == "laws":
        show_table(f"{done.name}: smallest margins over all channels", worst.ROW_HEADER, worst.rows(done.found))
    else:
        show_table(f"{done.name}: worst margins of {len(done.found)} loops", worst.WORST_HEADER, least)
        linearised = [(name, one) for name, one in done.found if not isinstance(one, str)]
        unstable = [name for name, one in linearised if not one.stable]
        if unstable:
            say(f"Unstable: {len(unstable)} of {len(done.found)}, first {unstable[0]}.")
        loose = [(name, ", ".join(one.not_held)) for name, one in linearised if one.stable and one.not_held]
        if loose:
            first, what = loose[0]
            say(f"Not held: in {len(loose)} of {len(done.found)}; {first} does not hold {what}.")
    say(worst.grades(done.found))
    for line in done.refused:
        say(f"Not linearised: {line}")
    if done.kind == "draws" and least:
        say_whole(
            f"To fly the draw with the smallest phase margin: {command('fly', file, '--flight', least[2].where.split()[1])}"
        )
    say_whole(f"Report: {folder / REPORT}")

"""`quadstep prove`."""

from pathlib import Path
from typing import Annotated

import typer

from quadstep.terminal.screen import say
from quadstep.terminal.tables import show_table


def prove(
    mission: Annotated[Path, typer.Argument(help="Mission file (TOML).", show_default=False)],
) -> None:
    """Prove how far a flight stays from its path, or that it cannot: by enclosures of the laws that fly, rounding included.

    Exit code 0: proved. 1: open; what was not closed is said. 2: bad input. 3: disproved.
    """
    from quadstep.prove.run import prove_mission

    verdict = prove_mission(mission)
    show_table(verdict.name, ("axis", "verdict", "distance"), verdict.rows)
    for sentence in verdict.says:
        say(sentence)
    if verdict.kind:
        raise typer.Exit(int(verdict.kind))

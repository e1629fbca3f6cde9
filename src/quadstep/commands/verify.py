"""`quadstep verify`."""

import time
from pathlib import Path
from typing import Annotated

import typer

from quadstep.io.doors import needed_by
from quadstep.io.errors import FAILED
from quadstep.report.terminal.bars import bar
from quadstep.report.terminal.screen import say, say_whole, show_table


def verify(
    json: Annotated[
        Path | None, typer.Option(help="Write all rows, their checks and numbers to this file.", show_default=False)
    ] = None,
    only: Annotated[str | None, typer.Option(help="One row, by number (1 to 75) or name (T_eta).", show_default=False)] = None,
    every: Annotated[bool, typer.Option("--all", help="Print every row, not only those that fail.")] = False,
) -> None:
    """Check every equation of the paper against the code that flies; print a summary and the rows that fail.

    Exit code 0: all evidence holds. 1: the evidence of some row fails. 2: bad input.
    """
    with needed_by("`quadstep verify`"):
        from quadstep.proofs.verify import registry

    if json:
        registry.check_target(json)
    rows, started = registry.chosen(only), time.perf_counter()
    with bar("verifying", "rows", len(rows)) as progress:
        results = registry.verify(rows, progress.to)
    seconds = time.perf_counter() - started
    if not only:
        show_table("The paper against the code", *registry.summary(results))
    printed = [result for result in results if every or only or not result.passed]
    if printed:
        show_table(
            "" if only else "Every row" if every else "FAILED", registry.HEADER, [registry.cells(one) for one in printed]
        )
    say(registry.closing(results, seconds) + ("" if every or only else "; --all prints every row"))
    if json:
        registry.write_document(json, results, seconds)
        say_whole(f"Wrote {json}")
    if not all(result.passed for result in results):
        raise typer.Exit(FAILED)

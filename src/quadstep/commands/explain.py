"""`quadstep explain`."""

from pathlib import Path
from typing import Annotated

import typer

from quadstep.commands.options import OpenOption
from quadstep.commands.page import check_target, open_in_browser
from quadstep.io.atomic import write_beside
from quadstep.report.terminal.screen import say_whole


def explain(
    out: Annotated[Path, typer.Option(help="HTML file to write.")] = Path("out/article.html"),
    show: OpenOption = False,
) -> None:
    """Write the paper as an article: five figures that fly its laws as you drag.

    One HTML file: no network, no installation. Replaces an existing page of quadstep, but never any other file.
    """
    from quadstep.proofs.article.build import article

    check_target(out)
    text = article()
    write_beside(out, text, parents=True)
    say_whole(f"Article: {out} ({len(text.encode()) / 1e6:.2f} MB). Double-click it to open it.")
    if show:
        open_in_browser(out.resolve().as_uri())

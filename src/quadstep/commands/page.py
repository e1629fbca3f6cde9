"""`quadstep page`."""

import webbrowser
from pathlib import Path
from typing import Annotated

import typer

from quadstep.atomic import write_beside
from quadstep.commands.options import OpenOption
from quadstep.errors import UserError
from quadstep.files import PAGE, read_bytes
from quadstep.flight.engine import Engine
from quadstep.terminal.screen import complain, say_whole

OWN_MARK = 'id="quadstep-data"'
"""Identifies a page that this command has written."""


def page(
    missions: Annotated[
        list[Path] | None,
        typer.Argument(help="Mission files; default: the paper's cases and stress flights.", show_default=False),
    ] = None,
    out: Annotated[Path | None, typer.Option(help="HTML file; default: out/page.html, or out/<mission>.html for one.")] = None,
    show: OpenOption = False,
    engine: Annotated[Engine, typer.Option(help="Engine that flies the missions before the page does.")] = Engine.LANES,
) -> None:
    """Write one HTML file in which missions fly: no network, no installation, every gain a slider.

    Replaces an existing page, but never any other file.
    """
    files = missions or []
    target = out or Path("out") / (f"{files[0].stem}.html" if len(files) == 1 else "page.html")
    check_target(target)
    text = page_of(files, engine)
    write_beside(target, text, parents=True)
    say_whole(f"Page: {target} ({len(text.encode()) / 1e6:.2f} MB). Double-click it to open it.")
    if show:
        open_in_browser(target.resolve().as_uri())


def page_of(missions: list[Path], engine: Engine) -> str:
    """The page's HTML. Raises UserError."""
    if missions:
        from quadstep.page.missions import fly_missions

        return fly_missions(missions, engine)
    from quadstep.page.paper import fly_paper

    return fly_paper(engine)


def check_target(path: Path) -> None:
    """Refuses an existing file that is not a page. Raises UserError."""
    try:
        if path.is_dir():
            raise UserError(f"{path}: is a folder; --out needs a file")
        if path.exists() and OWN_MARK.encode() not in read_bytes(path, PAGE):
            raise UserError(f"{path}: exists and is not a page of quadstep; choose another --out")
    except OSError as error:
        raise UserError(f"{path}: cannot be written: {error.strerror}") from None


def open_in_browser(address: str) -> None:
    """Open an address; where no browser can be found, say so."""
    if not webbrowser.open(address):
        complain(f"warning: no browser found; open {address}")

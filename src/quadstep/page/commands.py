"""The commands `quadstep page` and `quadstep serve`."""

import webbrowser
from pathlib import Path
from typing import Annotated

import typer

from quadstep.errors import UserError
from quadstep.files import PAGE, read_bytes
from quadstep.flight.engine import Engine
from quadstep.terminal.screen import complain, say, say_whole

PORT = 8765
OWN_MARK = 'id="quadstep-data"'
"""What tells a page that this command has written."""

OpenOption = Annotated[bool, typer.Option("--open", help="Open it in the browser.")]


def add_commands(app: typer.Typer) -> None:
    """Register `page` and `serve`."""

    @app.command()
    def page(
        missions: Annotated[
            list[Path] | None,
            typer.Argument(help="Mission files; the paper's cases and stress flights if left out.", show_default=False),
        ] = None,
        out: Annotated[Path | None, typer.Option(help="HTML file; out/page.html, or out/<mission>.html, if left out.")] = None,
        show: OpenOption = False,
        engine: Annotated[Engine, typer.Option(help="Which engine flies them first, in Python.")] = Engine.LANES,
    ) -> None:
        """Write one HTML file in which missions fly: no network, no installation, every gain a slider.

        A page is replaced, any other file never.
        """
        files = missions or []
        target = out or Path("out") / (f"{files[0].stem}.html" if len(files) == 1 else "page.html")
        check_target(target)
        text = page_of(files, engine)
        write(target, text)
        say_whole(f"Page: {target} ({len(text.encode()) / 1e6:.2f} MB). Open it by a double click.")
        if show:
            open_in_browser(target.resolve().as_uri())

    @app.command()
    def serve(
        folder: Annotated[Path, typer.Argument(help="Folder with results.")] = Path("out"),
        port: Annotated[int, typer.Option(min=0, max=65535, help="Port on 127.0.0.1; 0 takes a free one.")] = PORT,
        show: OpenOption = False,
    ) -> None:
        """Show results under a folder in the browser, for this machine only. Ctrl-C ends it, with exit code 0."""
        from quadstep.page.serve import serve as run  # noqa: PLC0415 (each command loads what it needs)

        def ready(address: str) -> None:
            say_whole(f"Results in {folder}: {address} (Ctrl-C ends)")
            if show:
                open_in_browser(address)

        try:
            run(folder, port, ready)
        except KeyboardInterrupt:
            say("Stopped.")


def page_of(missions: list[Path], engine: Engine) -> str:
    """The page's HTML. Raises UserError."""
    if missions:
        from quadstep.page.missions import fly_missions  # noqa: PLC0415

        return fly_missions(missions, engine)
    from quadstep.page.paper import fly_paper  # noqa: PLC0415

    return fly_paper(engine)


def check_target(path: Path) -> None:
    """Refuses a file that is there and is not a page. Raises UserError."""
    try:
        if path.is_dir():
            raise UserError(f"{path}: is a folder; --out needs a file")
        if path.exists() and OWN_MARK.encode() not in read_bytes(path, PAGE):
            raise UserError(f"{path}: exists and is not a page of quadstep; choose another --out")
    except OSError as error:
        raise UserError(f"{path}: cannot be written: {error.strerror}") from None


def write(path: Path, text: str) -> None:
    """Write the page beside its place and move it there. Raises UserError."""
    from quadstep.report.publish import write_beside  # noqa: PLC0415

    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UserError(f"{path}: cannot be written: {error.strerror}") from None
    write_beside(path, text)


def open_in_browser(address: str) -> None:
    """Open an address; where there is no browser to be found, say so."""
    if not webbrowser.open(address):
        complain(f"warning: no browser found; open {address}")

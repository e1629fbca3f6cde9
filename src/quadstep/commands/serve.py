"""`quadstep serve`."""

from pathlib import Path
from typing import Annotated

import typer

from quadstep.commands.options import OpenOption
from quadstep.commands.page import open_in_browser
from quadstep.terminal.screen import say, say_whole
from quadstep.user_code.loading import refuse

PORT = 8765


def serve(
    folder: Annotated[Path, typer.Argument(help="Folder with results.")] = Path("out"),
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port on 127.0.0.1; 0 picks a free one.")] = PORT,
    show: OpenOption = False,
) -> None:
    """Show results under a folder in the browser, for this machine only. Ctrl-C ends it, with exit code 0."""
    from quadstep.page.serve import serve as run

    refuse("`quadstep serve` only shows results")

    def ready(address: str) -> None:
        say_whole(f"Results in {folder}: {address} (Ctrl-C ends)")
        if show:
            open_in_browser(address)

    try:
        run(folder, port, ready)
    except KeyboardInterrupt:
        say("Stopped.")

"""`quadstep serve`."""

from pathlib import Path
from typing import Annotated

import typer

from quadstep.commands.options import OpenOption
from quadstep.commands.page import open_in_browser
from quadstep.io.errors import UserError
from quadstep.io.user_code.loading import refuse
from quadstep.report.terminal.screen import complain, say, say_whole

PORT = 8765


def serve(
    folder: Annotated[Path, typer.Argument(help="Folder with results.")] = Path("out"),
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port; 0 picks a free one.")] = PORT,
    host: Annotated[
        str, typer.Option(help="Address to listen on for others on the network, who need the token in the link; 0.0.0.0: all.")
    ] = "127.0.0.1",
    show: OpenOption = False,
    of: Annotated[
        Path | None,
        typer.Option(
            "--class",
            metavar="FILE",
            help="Fly the controllers that students submit, and rank them (docs/class.md).",
            show_default=False,
        ),
    ] = None,
) -> None:
    """Show results under a folder in the browser: sort, filter, compare two. Ctrl-C ends it, with exit code 0.

    Only this machine can see them, unless --host says otherwise. With --class the folder is not shown: it is where the flights
    of the class are kept.
    """
    from quadstep.page.serve import serve as run
    from quadstep.page.sharing import access, qr_text

    refuse("`quadstep serve` runs no code of users")
    allowed = access(host)

    def open_class(links: dict[str, str]) -> None:
        for name, link in links.items():
            say_whole(f"{name}: {link}")
        say("Give each of them one link. Ctrl-C ends.")

    def ready(link: str) -> None:
        say_whole(f"Results in {folder}: {link} (Ctrl-C ends)")
        if allowed.shared:
            complain("warning: anyone who has this link and can reach this machine can read the folder, unencrypted")
            try:
                say_whole(qr_text(link))
            except UserError as error:
                say(f"{error}.")
        if show:
            open_in_browser(link)

    try:
        if of is None:
            from quadstep.studies.advise import advise_dropped

            run(folder, port, allowed, ready, advise_dropped)
        else:
            from quadstep.studies.class_server import serve_class

            serve_class(of, folder, port, allowed, open_class)
    except KeyboardInterrupt:
        say("Stopped.")

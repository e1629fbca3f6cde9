"""`quadstep serve`, and `quadstep serve-setpoints`."""

from pathlib import Path
from typing import Annotated

import typer

from quadstep.commands.options import OpenOption
from quadstep.commands.page import open_in_browser
from quadstep.io.errors import UserError, unknown_name
from quadstep.io.user_code import refuse
from quadstep.report.bars import bar
from quadstep.report.screen import complain, say, say_whole

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


ENDED = (
    "No more setpoints follow: unless its mode was changed, PX4 now leaves offboard by its failsafe (COM_OBL_RC_ACT), and "
    "ArduPilot stops where it is (GUID_TIMEOUT)."
)


def serve_setpoints(
    mission: Annotated[
        Path, typer.Argument(help="Mission file (TOML) for a real vehicle; its path is sent.", show_default=False)
    ],
    connect: Annotated[
        str,
        typer.Option(metavar="ADDRESS", help="Vehicle address, in pymavlink's form, such as udpin:127.0.0.1:14540."),
    ] = "udpin:127.0.0.1:14540",
    kind: Annotated[str, typer.Option(help="What each setpoint contains: position, attitude or rates.")] = "position",
    rate: Annotated[float, typer.Option(help="Setpoints per second, 2 to 200.")] = 50.0,
    hold: Annotated[float, typer.Option(help="After the path, seconds for which its last point is sent, at rest.")] = 10.0,
) -> None:
    """Send a mission's path to a vehicle as MAVLink setpoints, in real time; never arms or changes the mode.

    Exit code 2: bad input, or no vehicle responded.
    """
    from quadstep.bridges.autopilot.setpoints import SetpointKind, check_hold, check_rate, serve
    from quadstep.mission.read import plan_mission, read_mission

    if kind not in list(SetpointKind):
        raise UserError(f"--kind: {unknown_name('value', kind, SetpointKind)}")
    check_rate(rate)
    check_hold(hold)
    plan = plan_mission(read_mission(mission), mission)
    duration = plan.ticks.last * plan.ticks.step
    with bar("waiting for the vehicle", "s", duration) as shown:

        def told(at: float) -> None:
            shown.doing("sending setpoints" if at <= duration else "holding the last point: take over, or change the mode")
            shown.to(round(min(at, duration)), round(duration))

        def heard() -> None:
            complain("This sends setpoints and nothing else: arming and switching to offboard or guided mode are up to you.")

        count = serve(plan, connect, SetpointKind(kind), rate, hold, told, heard)
    say(f"Sent {count} setpoints over {duration:g} s, and the path's last point for {hold:g} s. {ENDED}")

"""`quadstep serve-setpoints`."""

from pathlib import Path
from typing import Annotated

import typer

from quadstep.io.errors import UserError, unknown_name
from quadstep.report.terminal.bars import bar
from quadstep.report.terminal.screen import complain, say

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

"""`quadstep fly`."""

import math
import os
from pathlib import Path
from typing import Annotated

import typer

from quadstep.commands.options import Delivery, EngineOption, OverwriteOption, QuickFigureOptions, SignalsOption
from quadstep.engines.engine import Engine
from quadstep.io import __version__
from quadstep.io.errors import UserError
from quadstep.metrics.requirements import parsed
from quadstep.report.bars import bar
from quadstep.report.pool import start_server
from quadstep.report.screen import complain, say, say_whole, show_table


def fly(
    mission: Annotated[Path, typer.Argument(metavar="MISSION.toml", help="Mission file (TOML); `quadstep new` writes one.")],
    out: Annotated[Path | None, typer.Option(help="Folder for the results; default: out/<mission's name>.")] = None,
    engine: EngineOption = Engine.LANES,
    overwrite: OverwriteOption = False,
    flight: Annotated[int | None, typer.Option(help="With a campaign file: number of the flight to fly.")] = None,
    results: Annotated[
        Path | None, typer.Option(help="With --flight: the campaign's results; default: out/<campaign's name>.")
    ] = None,
    require: Annotated[
        list[str] | None,
        typer.Option(
            metavar="METRIC=LIMIT",
            help="Upper limit for a metric of metrics.json, such as position_rmse=0.05; may be repeated.",
        ),
    ] = None,
    autopilot: Annotated[
        str | None,
        typer.Option(
            help="Let an autopilot fly it, in lockstep through its simulator interface: px4, ardupilot or betaflight."
        ),
    ] = None,
    connect: Annotated[
        str | None,
        typer.Option(
            metavar="HOST:PORT", help="With --autopilot: where to listen; 127.0.0.1:4560 (px4), :9002 (ardupilot, betaflight)."
        ),
    ] = None,
    connect_timeout: Annotated[
        float, typer.Option(metavar="SECONDS", help="With --autopilot: how long to wait for the connection.")
    ] = 60.0,
    pilot: Annotated[
        bool,
        typer.Option("--pilot", help="With --autopilot: also arm, take off and send the mission's path; without it, you do."),
    ] = False,
    pilot_connect: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS",
            help="With --pilot: the autopilot's MAVLink address in pymavlink's form, or Betaflight's MSP address; default: "
            "udpin:127.0.0.1:14540 (px4), tcp:127.0.0.1:5760 (ardupilot), tcp:127.0.0.1:5761 (betaflight).",
        ),
    ] = None,
    *,
    delivery: Delivery,
    drawing: QuickFigureOptions,
    signals: SignalsOption = None,
) -> None:
    """Fly a mission and print a summary.

    Writes report.html, page.html, flight.csv, metrics.json, figures/ and, for backstepping, weights.json.

    Exit code 0: completed. 2: bad input. 3: the flight was lost; its log up to then is kept. 4: it completed, but a
    --require is not met.
    """
    check_autopilot(autopilot, connect, connect_timeout, pilot, pilot_connect)
    required, drawn_on = [parsed(text) for text in require or []], drawing.sheet(signals)
    if os.path.isfile(mission):  # noqa: PTH113 (of a Path, names that no file can have are an error)
        start_server()
    folder = out or Path("out") / (mission.stem if flight is None else f"{mission.stem}-flight{flight}")
    with bar("loading") as shown:
        from quadstep.linear.grade import quick_grade
        from quadstep.metrics.registry import UNGRADED, at_rest_sentences, rest_of
        from quadstep.studies.fly import Piloting, fly_mission

        def show_stage(stage: str, done: int, total: int) -> None:
            shown.doing(stage)
            shown.to(done, total)

        piloting = None
        if autopilot is not None:
            piloting = Piloting(autopilot, connect or "", connect_timeout, complain, pilot, pilot_connect or "")
        result = fly_mission(
            mission, folder, engine, overwrite, show_stage, flight, required, results, drawn_on, piloting, quick_grade
        )
    for warning in result.warnings:
        complain(f"warning: {mission}: {warning}")
    if not delivery.as_json:
        if result.rows:
            show_table(result.name, ("", *result.header), result.rows)
        if result.facts:
            show_table("", ("", "value"), result.facts)
        say(result.ending)
        for sentence in at_rest_sentences(rest_of(result.metrics)) or [UNGRADED] * (autopilot is None):
            say(sentence)
        for one in result.judged:
            say(one.case.sentence)
        say_whole(f"Results: {folder}")
    about: dict[str, object] = {
        "version": __version__,
        "mission": str(mission),
        "flight": flight,
        "engine": engine.value,
        "folder": str(folder),
    }
    delivery.deliver(result.verdict(about))


def check_autopilot(
    autopilot: str | None, connect: str | None, connect_timeout: float, pilot: bool, pilot_connect: str | None
) -> None:
    """Refuses options of an autopilot that do not go together. Raises UserError."""
    for option, given in (("--connect", connect is not None), ("--pilot", pilot)):
        if given and autopilot is None:
            raise UserError(f"{option}: requires --autopilot")
    if pilot_connect is not None and not pilot:
        raise UserError("--pilot-connect: requires --pilot")
    if not 0.0 < connect_timeout < math.inf:
        raise UserError(f"--connect-timeout {connect_timeout:g}: should be a finite time above 0 s")
    if pilot:
        from quadstep.bridges.autopilots import KINDS
        from quadstep.bridges.setpoints import check_place
        from quadstep.io.doors import optional

        if autopilot in KINDS and (needs := KINDS[autopilot].needs):
            optional("`quadstep fly --pilot`", needs)
        if pilot_connect is not None:
            check_place(pilot_connect, "--pilot-connect")

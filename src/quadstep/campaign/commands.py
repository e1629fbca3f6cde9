"""The command `quadstep campaign`."""

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from quadstep.campaign.engine import MOST_FLIGHTS, CampaignEngine
from quadstep.errors import UserError
from quadstep.extras import missing_extra
from quadstep.judging.deliver import JsonOption, JunitOption, check_junit, deliver
from quadstep.report.sheet import SCREEN, USUAL, sheet
from quadstep.report.sheet_options import FiguresOption, StyleOption, WidthOption
from quadstep.terminal.bars import bar
from quadstep.terminal.screen import command, say, say_whole
from quadstep.terminal.tables import show_table

if TYPE_CHECKING:
    from quadstep.campaign.summary import Summary


def replay_command(file: Path, flight: int, folder: Path) -> str:
    """What to type to fly one flight of the campaign in `folder` again."""
    elsewhere = [] if folder == Path("out") / file.stem else ["--results", folder]
    return command("fly", file, "--flight", flight, *elsewhere)


def add_campaign(app: typer.Typer) -> None:
    """Register the command."""

    @app.command()
    def campaign(
        file: Annotated[Path, typer.Argument(metavar="CAMPAIGN.toml", help="Campaign file.", show_default=False)],
        flights: Annotated[int | None, typer.Option(help="Instead of the file's number.", show_default=False)] = None,
        engine: Annotated[
            CampaignEngine, typer.Option(help="lanes: all cores. gpu: an NVIDIA graphics processor. ray: a cluster.")
        ] = CampaignEngine.LANES,
        resume: Annotated[bool, typer.Option("--resume", help="Go on with the campaign in the folder.")] = False,
        out: Annotated[Path | None, typer.Option(help="Folder for the results; out/<campaign's name> if left out.")] = None,
        overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace the campaign in the folder.")] = False,
        require: Annotated[
            str | None,
            typer.Option(
                metavar="SHARE",
                help="So large a share of flights must succeed, by the lower end of the exact interval.",
                show_default=False,
            ),
        ] = None,
        as_json: JsonOption = False,
        junit: JunitOption = None,
        figures: FiguresOption = USUAL,
        width: WidthOption = None,
        style: StyleOption = SCREEN,
    ) -> None:
        """Fly a mission very many times with what the file says varying; how often, and how well, does it succeed?

        Writes flights/*.parquet as they finish, campaign.json and report.html.

        Exit code 0: flown. 2: bad input. 4: flown, but --require is not met. 130: interrupted; go on with --resume.
        """
        started = time.perf_counter()
        try:
            from quadstep.campaign.run import fly_campaign  # noqa: PLC0415 (each command loads what it needs)
            from quadstep.campaign.verdict import verdict  # noqa: PLC0415
            from quadstep.judging import share  # noqa: PLC0415
        except ModuleNotFoundError as error:
            raise missing_extra("`quadstep campaign`", error) from None

        if flights is not None and not 1 <= flights <= MOST_FLIGHTS:
            raise UserError(f"--flights: should be from 1 to {MOST_FLIGHTS}, not {flights}")
        least = None if require is None else share.parsed(require)
        if junit:
            check_junit(junit)
        folder = out or Path("out") / file.stem
        drawn_on = sheet(figures, width, style)
        with bar("flying", "flights", flights) as shown:
            try:
                done = fly_campaign(file, folder, flights, engine, resume, overwrite, shown.to, drawn_on)
            except ModuleNotFoundError as error:
                raise missing_extra("`quadstep campaign`", error) from None
        judged = verdict(done, file, engine, least)
        if not as_json:
            show(done.summary, file, folder)
            if least is not None:
                say(judged.cases[-1].sentence)
        deliver(judged, as_json, junit, time.perf_counter() - started)

    def show(summary: "Summary", file: Path, folder: Path) -> None:
        """What a person is told."""
        from quadstep.campaign.summary import sentences  # noqa: PLC0415

        for sentence in sentences(summary):
            say(sentence)
        rows = [
            (str(one.flight), one.outcome, *("-" if x is None else f"{x:.4g}" for x in (one.time, one.rmse, one.largest)))
            for one in summary.worst
        ]
        show_table("The worst", ("flight", "outcome", "ended [s]", "RMSE [m]", "largest error [m]"), rows)
        say("Each of them again, with its full log:")
        for one in summary.worst:
            say_whole(f"  {replay_command(file, one.flight, folder)}")
        say_whole(f"Report: {folder / 'report.html'}")

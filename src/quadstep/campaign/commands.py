"""The command `quadstep campaign`."""

import shlex
import sys
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, ProgressColumn, Task, TextColumn, TimeRemainingColumn
from rich.table import Table
from rich.text import Text

from quadstep.campaign.engine import MOST_FLIGHTS, CampaignEngine
from quadstep.errors import UserError

EXTRA = {"pyarrow": "campaign", "scipy": "campaign", "cma": "campaign", "ray": "cluster"}
"""Which extra brings a package."""


class Count(ProgressColumn):
    """Flights over, and of how many once that is known."""

    def render(self, task: Task) -> Text:
        """As text."""
        return Text(f"{task.completed:,.0f}" + ("" if task.total is None else f"/{task.total:,.0f}"))


class Rate(ProgressColumn):
    """Flights a second."""

    def render(self, task: Task) -> Text:
        """As text."""
        return Text(f"{task.finished_speed or task.speed or 0.0:,.0f} flights/s")


def flights_bar() -> Progress:
    """A progress bar with rate and time left, on the error stream of a terminal."""
    return Progress(
        TextColumn("flying"), BarColumn(), Count(), Rate(), TimeRemainingColumn(),
        console=Console(stderr=True), transient=True, disable=not sys.stderr.isatty(),
    )  # fmt: skip


def missing_extra(command: str, error: ModuleNotFoundError) -> UserError:
    """What to say where an extra is not installed; raises the error itself where it is about something else."""
    extra = EXTRA.get((error.name or "").partition(".")[0])
    if extra is None:
        raise error
    return UserError(f"`quadstep {command}` needs {error.name}; install it: pip install quadstep[{extra}]")


def replay_command(file: Path, flight: int) -> str:
    """What to type to fly one flight of a campaign again."""
    return shlex.join(["quadstep", "fly", str(file), "--flight", str(flight)])


def add_campaign(app: typer.Typer, screen: Console) -> None:
    """Register the command. screen: where it writes to."""

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
    ) -> None:
        """Fly a mission very many times with what the file says varying; how often, and how well, does it succeed?

        Writes flights/*.parquet as they finish, campaign.json and report.html.
        """
        try:
            from quadstep.campaign.run import fly_campaign  # noqa: PLC0415 (each command loads what it needs)
        except ModuleNotFoundError as error:
            raise missing_extra("campaign", error) from None

        if flights is not None and not 1 <= flights <= MOST_FLIGHTS:
            raise UserError(f"--flights: should be from 1 to {MOST_FLIGHTS}, not {flights}")
        folder = out or Path("out") / file.stem
        with flights_bar() as bar:
            task = bar.add_task("flying", total=flights)
            try:
                done = fly_campaign(
                    file, folder, flights, engine, resume, overwrite,
                    lambda over, total: bar.update(task, completed=over, total=total),
                )  # fmt: skip
            except ModuleNotFoundError as error:
                raise missing_extra("campaign", error) from None
        from quadstep.campaign.summary import sentences  # noqa: PLC0415

        for sentence in sentences(done.summary):
            screen.print(sentence, soft_wrap=True)
        table = Table("flight", "outcome", "ended [s]", "RMSE [m]", "largest error [m]", title="The worst")
        for one in done.summary.worst:
            numbers = ["-" if x is None else f"{x:.4g}" for x in (one.time, one.rmse, one.largest)]
            table.add_row(str(one.flight), one.outcome, *numbers)
        screen.print(table)
        screen.print("Each of them again, with its full log:")
        for one in done.summary.worst:
            screen.print(f"  {replay_command(file, one.flight)}", soft_wrap=True)
        screen.print(f"Report: {folder / 'report.html'}", soft_wrap=True)

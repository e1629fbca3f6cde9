"""Questions asked of many flights: `quadstep campaign`, `quadstep envelope` and `quadstep tune`."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from quadstep.commands.options import Delivery, FigureOptions, OverwriteOption, check_range, check_seed, engine_option
from quadstep.engines.engine import CAMPAIGNS, Engine
from quadstep.io.doors import needed_by
from quadstep.io.errors import UserError
from quadstep.report.bars import bar
from quadstep.report.screen import command, say, say_whole, show_table, typeset
from quadstep.studies.campaign import MOST_FLIGHTS

if TYPE_CHECKING:
    from quadstep.studies.tuning.run import Tuned


def campaign(
    file: Annotated[Path, typer.Argument(metavar="CAMPAIGN.toml", help="Campaign file.")],
    flights: Annotated[int | None, typer.Option(help="Number of flights; overrides the file's.")] = None,
    engine: Annotated[Engine, engine_option(CAMPAIGNS)] = Engine.LANES,
    resume: Annotated[bool, typer.Option("--resume", help="Resume the campaign in the folder.")] = False,
    out: Annotated[Path | None, typer.Option(help="Folder for the results; default: out/<campaign's name>.")] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace the campaign in the folder.")] = False,
    rare: Annotated[
        bool, typer.Option("--rare", help="Estimate a small failure probability by steering flights towards failure.")
    ] = False,
    until: Annotated[
        str | None,
        typer.Option(metavar="P", help="Fly until the failure rate is shown to be below P, or above it; at most --flights."),
    ] = None,
    require: Annotated[
        str | None,
        typer.Option(metavar="SHARE", help="Required success rate: the lower end of its exact 95 % interval must reach it."),
    ] = None,
    *,
    delivery: Delivery,
    drawing: FigureOptions,
) -> None:
    """Fly a mission many times with random variations (Monte Carlo), and report how often, and how well, it succeeds.

    Writes flights/*.parquet as they finish, campaign.json and report.html; --rare writes rare.json and report.html.

    Exit code 0: flown. 2: bad input. 4: flown, but --require or --until is not met. 130: interrupted; continue with --resume.
    """
    with needed_by("`quadstep campaign`"):
        from quadstep.linear.grade import quick_grade
        from quadstep.metrics.requirements import parsed_share
        from quadstep.studies.campaign import run as limit
        from quadstep.studies.campaign.evidence import evidence, refuse_certain
        from quadstep.studies.campaign.run import CampaignRequest, fly_campaign

    check_range("--flights", flights, 1, MOST_FLIGHTS)
    if resume and overwrite:
        raise UserError("--resume and --overwrite: choose one: go on with the campaign in the folder, or replace it")
    least = None if require is None else parsed_share(require)
    drawn_on = drawing.sheet()
    if rare:
        given = {"--until": until is not None, "--flights": flights is not None, "--engine": engine is not Engine.LANES}
        if refused := [name for name, was in given.items() if was]:
            raise UserError(f"{refused[0]}: cannot be used with --rare, whose settings are in [rare] of the campaign file")
    folder = out or Path("out") / (f"{file.stem}-rare" if rare else file.stem)
    target = None if until is None else limit.parsed(until)
    if not rare and (target is not None or least is not None):
        refuse_certain(file, "--require" if target is None else "--until", flights)
    with bar("flying", "flights", flights) as shown, needed_by("`quadstep campaign`"):
        asked = CampaignRequest(file, folder, flights, engine, resume, overwrite, shown, drawn_on, quick_grade)
        if rare:
            from quadstep.studies.rare.run import estimate

            found = estimate(asked).judged(least)
        else:
            decided = None if target is None else limit.fly_until(asked, target)
            done = decided.done if decided else fly_campaign(asked)
            found = evidence(done, file, engine, least, decided)
    delivery.finish(found, "campaign --rare" if rare else "campaign", folder)


def envelope(
    file: Annotated[
        Path, typer.Argument(metavar="MISSION.toml", help="Mission file, or a campaign file that varies more keys.")
    ],
    x: Annotated[str, typer.Option(metavar="KEY=a:b:n", help="Horizontal axis: n values from a to b; or KEY=v1,v2,...")],
    y: Annotated[str, typer.Option(metavar="KEY=a:b:n", help="Vertical axis, in the same form.")],
    by: Annotated[str | None, typer.Option(metavar="KEY=v1,v2", help="One panel per value.")] = None,
    flights: Annotated[
        int | None, typer.Option(help="Flights per cell; default: 1, or 20 if the mission has random elements.")
    ] = None,
    failure: Annotated[
        list[str] | None,
        typer.Option(metavar="METRIC=LIMIT", help="Limit above which a flight counts as failed; may be repeated."),
    ] = None,
    engine: Annotated[Engine, engine_option(CAMPAIGNS)] = Engine.LANES,
    out: Annotated[Path | None, typer.Option(help="Folder for the results; default: out/<mission's name>-envelope.")] = None,
    overwrite: OverwriteOption = False,
    *,
    delivery: Delivery,
    drawing: FigureOptions,
) -> None:
    """Map where a mission can be flown, and how well, over two of its keys.

    Writes report.html, flights.html, envelope and slices as .png and .svg, envelope.parquet (one row per cell), table.tex and
    metrics.json.
    """
    with needed_by("`quadstep envelope`"):
        from quadstep.linear.grade import quick_grade
        from quadstep.studies.envelope import Map
        from quadstep.studies.envelope_request import request
        from quadstep.studies.study import run

        folder, drawn_on = out or Path("out") / f"{file.stem}-envelope", drawing.sheet()
        asked = Map(request(file, x, y, by, failure or (), flights))
        with bar("flying", "flights", asked.flights) as shown:
            evidence = run(asked, folder, engine, overwrite, shown, drawn_on, quick_grade).evidence
    delivery.finish(evidence, "envelope", folder)


def tune(
    mission: Annotated[Path, typer.Argument(metavar="MISSION.toml", help="Mission file with a table [tune].")],
    budget: Annotated[int, typer.Option(help="Maximum number of flights in total.")],
    out: Annotated[Path | None, typer.Option(help="Folder for the results; default: out/<mission's name>-tuned.")] = None,
    seed: Annotated[int, typer.Option(help="Seed for the search and all random variation.")] = 1,
    overwrite: OverwriteOption = False,
    *,
    delivery: Delivery,
    drawing: FigureOptions,
) -> None:
    """Find better gains by flying: CMA-ES over many flights at once, compared at the end on flights not used for tuning.

    Writes tuned.toml, report.html, history.csv, a figure, table.tex and metrics.json. The mission's table
    [tune] says what may change, and what is better (docs/tuning.md).
    """
    check_seed(seed)
    folder, drawn_on = out or Path("out") / f"{mission.stem}-tuned", drawing.sheet()
    with bar("tuning", "flights", budget) as progress, needed_by("`quadstep tune`"):
        from quadstep.linear.grade import quick_grade
        from quadstep.studies.tuning.run import tune as run

        done = run(mission, budget, folder, seed, overwrite, progress, drawn_on, quick_grade)
    if not delivery.as_json:
        show(done, folder)
    delivery.deliver(done.evidence.verdict("tune", folder))


def show(done: "Tuned", folder: Path) -> None:
    """Print what is to be read first, the gains, the comparison and its verdict."""
    from quadstep.studies.tuning.report import GAINS, HEADER, gain_rows, measured_rows, near_ends, objective

    found, compared = done.found, done.compared
    for sentence in done.evidence.sentences:
        say(sentence)
    gains = gain_rows(done.asked, found)
    show_table(done.asked.mission.name, GAINS[:4], [one[:4] for one in gains])
    many = compared.flights > 1
    said = f"{compared.flights} unseen flights each, 95 % intervals" if many else "one flight each: all flights are identical"
    show_table(said[0].upper() + said[1:], HEADER[:3], [one[:3] for one in measured_rows(compared)])
    for sentence in filter(None, (objective(done.asked), compared.from_the_start, *done.evidence.graded)):
        say(typeset(sentence))
    for key, where in near_ends(done.asked, done.values).items():
        say(f"{key} is {where}{'; a wider range may give more' * ('bound' in where)}.")
    for name in done.elsewhere:
        say(f"tuned.toml names {name}, which is not in the mission's folder: copy both there.")
    say_whole(f"Results: {folder}; fly it: {command('fly', folder / 'tuned.toml')}")

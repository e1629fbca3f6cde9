"""`quadstep campaign`, and `quadstep envelope`."""

from pathlib import Path
from typing import Annotated

import typer

from quadstep.commands.deliver import Delivery
from quadstep.commands.options import Drawing, OverwriteOption, check_range, engine_option
from quadstep.engines.engine import CAMPAIGNS, Engine
from quadstep.io.doors import needed_by
from quadstep.io.errors import UserError
from quadstep.report.bars import bar
from quadstep.studies.campaign import MOST_FLIGHTS


def campaign(
    file: Annotated[Path, typer.Argument(metavar="CAMPAIGN.toml", help="Campaign file.", show_default=False)],
    flights: Annotated[int | None, typer.Option(help="Number of flights, instead of the file's.", show_default=False)] = None,
    engine: Annotated[Engine, engine_option(CAMPAIGNS)] = Engine.LANES,
    resume: Annotated[bool, typer.Option("--resume", help="Resume the campaign in the folder.")] = False,
    out: Annotated[Path | None, typer.Option(help="Folder for the results; default: out/<campaign's name>.")] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace the campaign in the folder.")] = False,
    rare: Annotated[
        bool, typer.Option("--rare", help="Estimate a small probability of failure instead of flying flights one by one.")
    ] = False,
    until: Annotated[
        str | None,
        typer.Option(
            metavar="P",
            help="Fly until the failure rate is shown to be below P, or above it; --flights: at most this many.",
            show_default=False,
        ),
    ] = None,
    require: Annotated[
        str | None,
        typer.Option(
            metavar="SHARE",
            help="Success rate that the lower end of its exact 95 % interval must reach.",
            show_default=False,
        ),
    ] = None,
    *,
    delivery: Delivery,
    drawing: Drawing,
) -> None:
    """Monte Carlo: fly a mission many times with random variations; how often, and how well, does it succeed?

    Writes flights/*.parquet as they finish, campaign.json and report.html; --rare writes rare.json and report.html.

    Exit code 0: flown. 2: bad input. 4: flown, but --require or --until is not met. 130: interrupted; continue with --resume.
    """
    with needed_by("`quadstep campaign`"):
        from quadstep.linear.grade import quick_grade
        from quadstep.metrics.requirements import parsed_share
        from quadstep.studies.campaign import run as limit
        from quadstep.studies.campaign.evidence import evidence, refuse_known
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
        refuse_known(file, "--require" if target is None else "--until", flights)
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
        Path,
        typer.Argument(
            metavar="MISSION.toml", help="Mission file, or a campaign file that varies more keys.", show_default=False
        ),
    ],
    x: Annotated[str, typer.Option(metavar="KEY=a:b:n", help="Horizontal axis: n values from a to b; or KEY=v1,v2,...")],
    y: Annotated[str, typer.Option(metavar="KEY=a:b:n", help="Vertical axis, in the same form.")],
    by: Annotated[str | None, typer.Option(metavar="KEY=v1,v2", help="One panel per value.", show_default=False)] = None,
    flights: Annotated[
        int | None, typer.Option(help="Flights per cell; default: 1, or 20 if flights differ.", show_default=False)
    ] = None,
    failure: Annotated[
        list[str] | None,
        typer.Option(
            metavar="METRIC=MOST", help="Limit above which a flight counts as failed; may be repeated.", show_default=False
        ),
    ] = None,
    engine: Annotated[Engine, engine_option(CAMPAIGNS)] = Engine.LANES,
    out: Annotated[Path | None, typer.Option(help="Folder for the results; default: out/<mission's name>-envelope.")] = None,
    overwrite: OverwriteOption = False,
    *,
    delivery: Delivery,
    drawing: Drawing,
) -> None:
    """Map where a mission can be flown, and how well, over two of its keys.

    Writes report.html, envelope.png, envelope.svg, envelope.parquet (one row per cell), table.tex and metrics.json.
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

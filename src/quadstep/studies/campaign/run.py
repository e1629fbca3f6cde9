"""`quadstep campaign`: from file to folder."""

from pathlib import Path
from typing import NamedTuple

from quadstep.engines.engine import CAMPAIGNS, Engine, loaded
from quadstep.mission.schema import Grading, ungraded
from quadstep.report.progress import SILENT, Count, Progress
from quadstep.report.sheet import Sheet
from quadstep.studies.campaign.flyer import Fly
from quadstep.studies.campaign.planner import is_random
from quadstep.studies.campaign.schema import Campaign, read_campaign
from quadstep.studies.campaign.store import Chunk, Store, opened
from quadstep.studies.campaign.summary import CampaignSummary, as_json, summarise


class CampaignRequest(NamedTuple):
    """What is asked of a campaign. path: of its file; folder: of its results, where `resume` goes on with what is there, and
    `overwrite` replaces it. flights: instead of the file's. sheet: what figures are drawn on. grading: of the loop at rest.
    """

    path: Path
    folder: Path
    flights: int | None = None
    engine: Engine = Engine.LANES
    resume: bool = False
    overwrite: bool = False
    progress: Progress = SILENT
    sheet: Sheet = Sheet()
    grading: Grading = ungraded


class FinishedCampaign(NamedTuple):
    """A finished campaign."""

    campaign: Campaign
    summary: CampaignSummary
    folder: Path


def fly_campaign(asked: CampaignRequest) -> FinishedCampaign:
    """Fly a campaign. Raises UserError, and InterruptedRun on Ctrl-C; in both cases what was flown so far is kept."""
    campaign = read_campaign(asked.path)
    count = asked.flights or campaign.flights
    campaign.check_count(count)
    fly: Fly[Chunk] = loaded(CAMPAIGNS, asked.engine)(campaign)
    with opened(asked.folder, campaign, count, asked.engine, asked.resume, asked.overwrite) as store:
        fly_missing(store, fly, store.flights, asked.progress)
        return finish(store, campaign, asked)


def fly_missing(store: Store, fly: Fly[Chunk], flights: int, progress: Progress) -> None:
    """Fly what the store lacks of its first flights."""
    missing = [chunk for chunk in store.missing if chunk.first < flights]
    counted = Count(progress, flights, flights - sum(min(chunk.past, flights) - chunk.first for chunk in missing))
    for chunk, table in fly(missing, counted.add):
        store.write(chunk, table)


def finish(store: Store, campaign: Campaign, asked: CampaignRequest) -> FinishedCampaign:
    """Summarise what was flown; write the report and the final manifest."""
    from quadstep.studies.campaign.report import write_report  # noqa: PLC0415 (figures are drawn only here)

    grading, grid = asked.grading(campaign.mission), campaign.file.combinations
    summary = summarise(store, campaign.varies, grading, campaign.singly, grid, is_random(campaign))
    summary = summary._replace(limited=bool(campaign.file.failure), since=campaign.mission.scored_from)
    write_report(store, campaign, summary, asked.path, asked.sheet)
    store.save(complete=True, summary=as_json(summary))
    return FinishedCampaign(campaign, summary, store.folder)

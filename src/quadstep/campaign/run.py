"""`quadstep campaign`: from file to folder."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import pyarrow as pa

from quadstep.campaign.engine import CampaignEngine
from quadstep.campaign.flown import Flyer, Progress
from quadstep.campaign.schema import Campaign, read_campaign
from quadstep.campaign.store import Chunk, Store, opened
from quadstep.campaign.summary import Summary, as_json, summarise
from quadstep.errors import InterruptedRun

REPORT = "report.html"


class Finished(NamedTuple):
    """A campaign that is over."""

    campaign: Campaign
    summary: Summary
    folder: Path


def fly_campaign(
    path: Path,
    folder: Path,
    flights: int | None = None,
    engine: CampaignEngine = CampaignEngine.LANES,
    resume: bool = False,
    overwrite: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> Finished:
    """Fly the campaign in `path` into `folder`. progress: told flights over and flights in all.

    Raises UserError, and InterruptedRun on Ctrl-C; in both cases what was flown so far is kept.
    """
    campaign = read_campaign(path)
    with opened(folder, campaign, flights or campaign.flights, engine, resume, overwrite) as store:
        missing = store.missing
        over = store.flights - sum(chunk.past - chunk.first for chunk in missing)

        def told(more: int) -> None:
            nonlocal over
            over += more
            if progress:
                progress(over, store.flights)

        told(0)
        try:
            for chunk, table in flown(campaign, missing, engine, told):
                store.write(chunk, table)
            summary = summarise(store)
            finish(store, campaign, summary, path)
        except KeyboardInterrupt:
            kept, count = len(store.chunks) - len(store.missing), len(store.chunks)
            raise InterruptedRun(f"{kept} of {count} files of flights are kept in {folder}; go on with --resume") from None
    return Finished(campaign, summary, folder)


def flown(
    campaign: Campaign, chunks: Sequence[Chunk], engine: CampaignEngine, progress: Progress
) -> Iterator[tuple[Chunk, pa.Table]]:
    """The flights of each chunk, as they come."""
    if engine is CampaignEngine.RAY:
        from quadstep.campaign.cluster import flown_on_cluster  # noqa: PLC0415 (an extra, loaded where it is used)

        yield from flown_on_cluster(campaign, chunks, progress)
        return
    if engine is CampaignEngine.GPU:
        from quadstep.campaign.device import device_flyer  # noqa: PLC0415

        flyer = device_flyer(campaign)
    else:
        flyer = Flyer(campaign)
    for chunk in chunks:
        yield chunk, flyer.fly(chunk.first, chunk.past, progress)


def finish(store: Store, campaign: Campaign, summary: Summary, path: Path) -> None:
    """The report, and the manifest's last word."""
    from quadstep.campaign.report import write_report  # noqa: PLC0415 (figures are drawn only here)

    files = write_report(store, campaign, summary, path)
    store.save(complete=True, summary=as_json(summary), files=files)

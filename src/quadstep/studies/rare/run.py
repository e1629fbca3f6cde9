"""`quadstep campaign --rare`: from file to folder."""

from pathlib import Path
from typing import NamedTuple

from quadstep.mission.schema import Grading, ungraded
from quadstep.report.sheet import Sheet
from quadstep.report.terminal.progress import SILENT, Count, Progress
from quadstep.studies.campaign.schema import Campaign, read_campaign
from quadstep.studies.rare.flights import Flights
from quadstep.studies.rare.kept import opened
from quadstep.studies.rare.pieces import fly_piece, pieces
from quadstep.studies.rare.report import write_report
from quadstep.studies.rare.space import check_space
from quadstep.studies.rare.summary import Summary, as_json, summarise


class Found(NamedTuple):
    """A finished run."""

    campaign: Campaign
    summary: Summary
    folder: Path


def estimate(
    path: Path,
    folder: Path,
    resume: bool = False,
    overwrite: bool = False,
    progress: Progress = SILENT,
    sheet: Sheet | None = None,
    grading: Grading = ungraded,
) -> Found:
    """Estimate the probability that a flight of the campaign in `path` fails, and write rare.json and a report into `folder`.

    sheet: what the figures are drawn on. grading: of the loop at rest. Raises UserError, and InterruptedRun on Ctrl-C; in both
    cases finished replicates are kept.
    """
    campaign = read_campaign(path)
    check_space(campaign.file, path)
    flights = Flights(campaign)
    with opened(folder, campaign, resume, overwrite) as kept:
        all_of = list(pieces(campaign))
        for piece in all_of[len(kept.pieces) :]:
            over = sum(one.flights for one in kept.pieces)
            count = Count(progress, done=over, note=f"{piece.place + 1} of {len(all_of)}")
            kept.add(fly_piece(flights, piece, count.add))
        summary = summarise(kept.pieces)._replace(rest=grading(campaign.mission))
        write_report(kept, campaign, summary, path, sheet or Sheet())
        kept.save(complete=True, summary=as_json(summary))
    return Found(campaign, summary, folder)

"""`quadstep campaign --rare`: from file to folder."""

from pathlib import Path
from typing import NamedTuple

from quadstep.metrics.judging.share import JudgedShare
from quadstep.metrics.statistics import Estimate
from quadstep.mission.schema import Grading, ungraded
from quadstep.report.evidence import Evidence
from quadstep.report.sheet import Sheet
from quadstep.report.terminal.progress import SILENT, Count, Progress
from quadstep.studies.campaign.schema import read_campaign
from quadstep.studies.rare.flights import Flights, check_space
from quadstep.studies.rare.kept import opened
from quadstep.studies.rare.pieces import fly_piece, pieces
from quadstep.studies.rare.report import write_report
from quadstep.studies.rare.summary import Summary, as_json, summarise


class Found(NamedTuple):
    """A finished run."""

    summary: Summary
    evidence: Evidence

    def judged(self, least: float | None) -> Evidence:
        """With the verdict on the share of flights that must succeed; None if nothing is required.

        It is met if the lower end of the interval reaches it and there is no warning against the estimate.
        """
        if least is None:
            return self.evidence.required(None)
        value, low, high = self.summary.probability
        doubt = next(iter(self.summary.warnings), "")
        return self.evidence.required(JudgedShare(least, Estimate(1.0 - value, 1.0 - high, 1.0 - low), doubt=doubt))


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
        evidence = write_report(kept, campaign, summary, path, sheet or Sheet())
        kept.save(complete=True, summary=as_json(summary))
    return Found(summary, evidence)

"""`quadstep campaign --rare`: from file to folder."""

from typing import NamedTuple

from quadstep.metrics.judging.metrics import JudgedShare
from quadstep.metrics.statistics import Estimate
from quadstep.report.evidence import Evidence
from quadstep.report.terminal.progress import Count
from quadstep.studies.campaign.run import CampaignRequest
from quadstep.studies.campaign.schema import read_campaign
from quadstep.studies.rare.flights import PointFlyer, check_space
from quadstep.studies.rare.pieces import fly_piece, pieces
from quadstep.studies.rare.record import opened
from quadstep.studies.rare.report import write_report
from quadstep.studies.rare.summary import RareSummary, as_json, summarise


class RareResult(NamedTuple):
    """A finished run."""

    summary: RareSummary
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


def estimate(asked: CampaignRequest) -> RareResult:
    """Estimate the probability that a flight of a campaign fails, and write rare.json and a report.

    Raises UserError, and InterruptedRun on Ctrl-C; in both cases finished replicates are kept.
    """
    campaign = read_campaign(asked.path)
    check_space(campaign.file, asked.path)
    flights = PointFlyer(campaign)
    with opened(asked.folder, campaign, asked.resume, asked.overwrite) as kept:
        all_of = list(pieces(campaign))
        for piece in all_of[len(kept.pieces) :]:
            over = sum(one.flights for one in kept.pieces)
            count = Count(asked.progress, done=over, note=f"{piece.place + 1} of {len(all_of)}")
            kept.add(fly_piece(flights, piece, count.add))
        summary = summarise(kept.pieces)._replace(rest=asked.grading(campaign.mission))
        evidence = write_report(kept, campaign, summary, asked.path, asked.sheet)
        kept.save(complete=True, summary=as_json(summary))
    return RareResult(summary, evidence)

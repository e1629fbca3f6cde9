"""report.html of a campaign."""

from pathlib import Path

from quadstep.campaign.schema import Campaign
from quadstep.campaign.store import Store
from quadstep.campaign.summary import Summary


def write_report(store: Store, campaign: Campaign, summary: Summary, path: Path) -> list[str]:
    """Write it; the names of the files in the folder."""
    return []

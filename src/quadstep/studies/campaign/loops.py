"""The loop of each draw of a campaign, at rest where its path begins."""

from collections.abc import Iterator
from pathlib import Path

from quadstep.io.errors import UserError
from quadstep.linear.analysis import Analysis, studied
from quadstep.linear.several import Several, collected, write
from quadstep.report.evidence import Evidence
from quadstep.report.progress import Progress
from quadstep.report.publish import publishing
from quadstep.report.sheet import Sheet
from quadstep.studies.campaign.replay import replay
from quadstep.studies.campaign.schema import Campaign, read_campaign

USUAL = 100
"""Default number of draws."""


def draws(path: Path, count: int | None, folder: Path, overwrite: bool, sheet: Sheet, progress: Progress) -> Evidence:
    """The loops of a campaign's first draws. Raises UserError."""
    campaign = read_campaign(path)
    count = min(campaign.flights, USUAL) if count is None else count
    with publishing(folder, f"linear-draws-{count}-{campaign.fingerprint}", overwrite) as out:
        found = collected(((f"flight {flight}", one) for flight, one in of_draws(campaign, count)), progress)
        done = Several(campaign.file.name, "draws", found, [float(flight) for flight in range(count)])
        return write(out, done, path, sheet)


def of_draws(campaign: Campaign, count: int) -> Iterator[tuple[int, Analysis | str]]:
    """The first draws by the numbers of their flights, and the loop of each, or why there is none."""
    for flight in range(count):
        try:
            found: Analysis | str = studied(replay(campaign, flight).mission).analysis
        except UserError as error:
            found = str(error)
        yield flight, found

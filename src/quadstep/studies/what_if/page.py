"""The question as a page: its flights in gusts, whose failures are counted anew wherever the parameters' sliders are moved."""

from collections.abc import Mapping
from urllib.parse import quote

from quadstep.interfaces.controller import Controller
from quadstep.page.build import build_page
from quadstep.page.model import Link
from quadstep.report.evidence import Evidence
from quadstep.studies.campaign.page import MOST_FLIGHTS, shown_campaign
from quadstep.studies.campaign.schema import campaign_of
from quadstep.studies.tuning.ground import TuningRequest

ENDS = (
    "The marks on the sliders are the values before. The page does not compute margins or the step: the report has them for "
    "the values before and after."
)


def what_if_page(gusts: TuningRequest, seed: int, law: type[Controller], changes: Mapping[str, float], found: Evidence) -> str:
    """The HTML. gusts, seed: the flights in gusts, with the values before. changes: of the parameters. Raises UserError."""
    content = {key: value for key, value in gusts.content.items() if key != "tune"}
    file = gusts.campaign(gusts.section.vary, seed=seed, flights=min(gusts.unseen, MOST_FLIGHTS))
    campaign = campaign_of(file, "", content, str(gusts.path), gusts.path.parent)
    shown = shown_campaign(campaign, str(gusts.path))
    after = [f"set={quote(f'{law.name}.{name}', safe='')}:{value!r}" for name, value in changes.items()]
    flight = f"#flight={quote(shown.id, safe='')}"
    links = [Link("before", flight), Link("after", "&".join([flight, *after])), Link("report", "report.html")]
    return build_page(found.name, f"{found.answer} {ENDS}", [shown._replace(moved=changes)], links=links)

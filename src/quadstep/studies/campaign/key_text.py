"""What a campaign's report says of its keys: how much each explains, and how flights do over it."""

from collections.abc import Mapping, Sequence
from html import escape

from quadstep.metrics.statistics import Estimate
from quadstep.mission.fields import label, words
from quadstep.report import units
from quadstep.report.evidence import TableSection
from quadstep.studies.campaign.report_text import percent
from quadstep.studies.campaign.schema import Campaign
from quadstep.studies.campaign.sensitivity import Interaction, certain

ERROR, FAILURE = "position RMSE (its logarithm)", "failure"
"""Names of the explained quantities."""

FIRST_ORDER = (
    "Share of the variance [%] that would vanish if the key were known (first-order index). It is large where a key has a "
    "large effect and was varied widely."
)


def ranking(
    campaign: Campaign, estimates: Mapping[str, Mapping[str, Estimate]], said: Mapping[str, tuple[str, Interaction | None]]
) -> list[TableSection]:
    """The share of each result that each key explains, and what a share is. said: why there is none; the strongest pair."""
    lines = [FIRST_ORDER] if any(estimates.values()) else []
    if len(estimates) == 1 and lines:
        ((key, shares),) = estimates.items()
        parts = [f"{percent(one)} % of the variance of {name}" for name, one in shares.items()]
        rest = f" Nothing else varies but {units.listed(campaign.mission.random)}." * campaign.mission.noisy
        lines = [f"{words(key)[0].upper()}{words(key)[1:]} explains {units.listed(parts)}.{rest}"]
    for name, (why, pair) in said.items():
        if why:
            lines.append(f"The causes of {name} are not analysed: {why}.")
        if pair and certain(pair.share, pair.pairs):
            both = units.listed([*map(words, pair.keys)])
            lines.append(f"Together, {both} explain {percent(pair.share)} % of {name} beyond what each explains alone.")
    if campaign.file.correlated:
        groups = "; ".join(", ".join(map(words, one.keys)) for one in campaign.file.correlated)
        lines.append(
            "Correlated keys partly explain the same variance, so their shares overlap and may add up to more than "
            f"100 %: {groups}."
        )
    body = [TableSection(text=line, set_as=escape) for line in lines]  # in which nothing is a symbol
    if any(estimates.values()) and len(estimates) > 1:
        names = list(dict.fromkeys(name for one in estimates.values() for name in one))
        rows = [
            (label(campaign.mission, key), *(percent(one[name]) if name in one else "–" for name in names))
            for key, one in estimates.items()
        ]
        body.append(TableSection(header=("", *names), rows=rows, set_as=escape))
    return body


def keys(count: int, most: int) -> TableSection:
    text = "Flights are grouped by value, or into ranges (horizontal bars) of equal width; those at the ends have at least 20."
    if count > most:
        text += f" These are the {most} of {count} keys that explain most; the others are in the flight files."
    return TableSection("One quantity at a time", "keys", text=text)


def over_key(key: str, said: Sequence[str]) -> str:
    """What to see of the flights over a key. said: of their failures, if anything is known."""
    return " ".join(said) or f"The flights over {words(key)}."

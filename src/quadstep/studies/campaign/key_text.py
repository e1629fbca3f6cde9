"""What a campaign's report says of its keys: how much each explains, and how flights do over it."""

from collections.abc import Mapping
from html import escape

from quadstep.metrics.statistics import Estimate
from quadstep.mission.fields import label, words
from quadstep.report import units
from quadstep.report.evidence import TableSection
from quadstep.studies.campaign.pictures import ByKey
from quadstep.studies.campaign.report_text import paragraphs, percent
from quadstep.studies.campaign.schema import Campaign
from quadstep.studies.campaign.sensitivity import Interaction, certain
from quadstep.studies.campaign.splits import Split
from quadstep.studies.campaign.varied import Bins

ERROR, FAILURE = "position RMSE (its logarithm)", "failure"
"""Names of the explained quantities."""

FIRST_ORDER = (
    "First-order index: the share of the variance that would vanish if the key were known. A key explains much if it has a "
    "large effect and was varied widely."
)


def ranking(
    campaign: Campaign, estimates: Mapping[str, Mapping[str, Estimate]], said: Mapping[str, tuple[str, Interaction | None]]
) -> list[TableSection]:
    lines = []
    for name, (why, pair) in said.items():
        if why:
            lines.append(f"The causes of {name} are not analysed: {why}.")
            continue
        shares = {key: one[name] for key, one in estimates.items() if name in one}
        clear = {key: one for key, one in shares.items() if certain(one, len(shares))}
        key, *rest = sorted(shares, key=lambda key: -shares[key].value)
        if clear and shares[key].low > max((shares[one].high for one in rest), default=0.0):
            most = "the largest share: " if rest else ""
            line = f"Of {name}, {words(key)} explains {most}{percent(shares[key])} % of the variance."
        elif clear:
            line = f"It is not decided which key matters most for {name}: the largest estimate is that of {words(key)}, "
            line += f"{percent(shares[key])} % of the variance, and the interval of another key overlaps it."
        elif not rest and shares[key].high > 0.0:
            line = f"How much of the variance of {name} is due to {words(key)} is not known to be above zero: "
            line += f"{percent(shares[key])} %. A small share can still be a clear trend: see the figures."
        else:
            line = f"No single key explains a share of {name} that differs significantly from zero."
        if clear and not rest:
            line += " The rest is due to whatever else is random in a flight, and to the coarseness of the estimate."
        elif clear and not campaign.file.correlated:
            together = min(1.0, sum(one.value for one in clear.values()))
            known = f"Taken one by one, the {len(clear)} significant keys together explain {100.0 * together:.3g} %"
            if len(clear) == 1:
                known = f"Only {words(next(iter(clear)))} is significant, with {100.0 * together:.3g} %"
            line += f" {known}; the rest is due to the others, interactions and noise."
        if pair and certain(pair.share, pair.pairs):
            line += (
                f" {units.listed([*map(words, pair.keys)])} together explain {percent(pair.share)} % more than each does alone"
                f"{f' (the strongest of {pair.pairs} pairs)' if pair.pairs > 1 else ''}."
            )
        lines.append(line)
    if campaign.file.correlated:
        groups = "; ".join(", ".join(map(words, one.keys)) for one in campaign.file.correlated)
        lines.append(
            "Correlated keys partly explain the same variance, so their shares overlap and may add up to more than "
            f"100 %: {groups}."
        )
    body = paragraphs(lines)
    if any(estimates.values()):
        names = list(dict.fromkeys(name for one in estimates.values() for name in one))
        rows = [
            (label(campaign.mission, key), *(percent(one[name]) if name in one else "–" for name in names))
            for key, one in estimates.items()
        ]
        body.append(TableSection(header=("", *(f"{name} [% of variance]" for name in names)), rows=rows, set_as=escape))
        body.append(TableSection(text=FIRST_ORDER))
    return body


def keys(count: int, most: int) -> TableSection:
    text = "All flights, grouped by the key's value or into ranges of equal width (end ranges are merged until they have 20 "
    text += f"flights){'; all other keys vary within each group' if count > 1 else ''}. One panel shows the success rate "
    text += (
        "with exact 95 % intervals, the other the position RMSE of completed flights: its median (line) and its range from "
    )
    text += "10 to 90 % (band)."
    if count > most:
        text += f" These are the {most} of {count} keys that explain most; the others are in the flight files."
    return TableSection("Individual keys", "keys", text=text)


def over_key(one: Split, statistical: bool, unit: str, bins: Bins, shown: ByKey) -> str:
    """What to see of the flights over a key: where most and fewest fail, and where the error is extreme. statistical: whether
    the flights say something of others.
    """

    def group(place: int) -> str:
        if bins.edges is None:
            return f"with {words(one.key)} = {bins.labels[place]}"
        return units.numerals(f"from {bins.edges[place]:.3g} to {bins.edges[place + 1]:.3g} {unit}".rstrip(" -"))

    said = f"{one.sentence}{'; this may be chance' * (statistical and not one.clear)}." if len({*one.shares}) > 1 else (
        f"{words(one.key)}: {units.percent(one.shares[0])} of the flights fail in every group."
        if one.shares else f"{words(one.key)}: too few flights to tell where more fail."
    )  # fmt: skip
    if len(shown.errors) > 1:
        ends = [edge(shown.errors, key=lambda place: shown.errors[place][1]) for edge in (min, max)]
        least, most = (f"{units.quantity(float(shown.errors[end][1]), 'm')} {group(end)}" for end in ends)
        said += f" Of those that complete, the median RMSE is between {least} and {most}."
    return f"{said[0].upper()}{said[1:]}"

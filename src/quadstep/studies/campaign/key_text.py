"""What a campaign's report says of its keys: how much each explains, and how flights do over it."""

import math
from collections.abc import Collection, Mapping, Sequence
from html import escape

from quadstep.metrics.statistics import Estimate
from quadstep.mission.fields import label, words
from quadstep.report import units
from quadstep.report.evidence import TableSection
from quadstep.studies.campaign.pictures import ByKey
from quadstep.studies.campaign.report_text import percent
from quadstep.studies.campaign.schema import Campaign
from quadstep.studies.campaign.sensitivity import Interaction, certain
from quadstep.studies.campaign.splits import with_option
from quadstep.studies.campaign.varied import Bins

ERROR, FAILURE = "position RMSE (its logarithm)", "failure"
"""Names of the explained quantities."""

FIRST_ORDER = (
    "First-order index: the share of the variance that would vanish if the key were known. A key explains much if it has a "
    "large effect and was varied widely."
)


def ranking(
    campaign: Campaign, estimates: Mapping[str, Mapping[str, Estimate]], said: Mapping[str, tuple[str, Interaction | None]],
    named: Collection[str] = (),
) -> list[TableSection]:  # fmt: skip
    """named: keys that failures go with."""
    lines = []
    for name, (why, pair) in said.items():
        if why:
            lines.append(f"The causes of {name} are not analysed: {why}.")
            continue
        shares = {key: one[name] for key, one in estimates.items() if name in one}
        clear = {key: one for key, one in shares.items() if (key in named if name == FAILURE else certain(one, len(shares)))}
        key, *rest = sorted(shares, key=lambda key: -shares[key].value)
        if key in clear and (not rest or shares[key].low > max(shares[one].high for one in rest)):
            most = ", the largest share" * bool(rest)
            line = f"Of the variance of {name}, {percent(shares[key])} % is explained by {words(key)}{most}."
        elif clear:
            line = f"It is not decided which key matters most for {name}: the largest estimate is that of {words(key)}, "
            line += f"{percent(shares[key])} % of the variance."
        else:
            line = f"No single key explains a share of {name} that differs significantly from zero."
        if clear and not rest:
            line += f" {'Most' if shares[key].high < 0.5 else 'The rest'} is due to whatever else is random in a flight,"
            line += " turbulence for instance, and to the coarseness of the estimate."
        elif clear and not campaign.file.correlated:
            together = min(1.0, sum(one.value for one in clear.values()))
            known = f"Taken one by one, the {len(clear)} significant keys together explain {100.0 * together:.3g} %"
            if len(clear) == 1:
                known = f"Only {words(next(iter(clear)))} is significant, with {100.0 * together:.3g} %"
            line += f" {known}; the rest is due to the others, interactions and noise."
        if pair and certain(pair.share, pair.pairs):
            line += (
                f" Together, {units.listed([*map(words, pair.keys)])} explain {percent(pair.share)} % beyond their own shares"
                f"{f' (the strongest of {pair.pairs} pairs)' if pair.pairs > 1 else ''}."
            )
        lines.append(line)
    if campaign.file.correlated:
        groups = "; ".join(", ".join(map(words, one.keys)) for one in campaign.file.correlated)
        lines.append(
            "Correlated keys partly explain the same variance, so their shares overlap and may add up to more than "
            f"100 %: {groups}."
        )
    body = [TableSection(text=line, set_as=escape) for line in lines]  # in which nothing is a symbol
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


def over_key(key: str, said: Sequence[str], bins: Bins, lines: Mapping[str, ByKey], unit: str) -> str:
    """What to see of the flights over a key. said: of their failures, nothing if chance explains these; lines: by the value of
    another key, those whose median error is told.
    """
    found = " ".join(said) or f"No range of {words(key)} was found in which more flights fail than chance explains."
    for what, shown in lines.items():
        if len(shown.errors) > 1:
            order = sorted((float(some[1]), place) for place, some in shown.errors.items())
            least, most = (
                f"{units.quantity(error, 'm')} ({group(key, bins, place, unit)})" for error, place in (order[0], order[-1])
            )
            which = f"that complete{' with ' * bool(what)}{what}"
            found += f" Of those {which}, the median RMSE is between {least} and {most}."
    return f"{found[0].upper()}{found[1:]}"


def extremes(key: str, bins: Bins, lines: Mapping[str, ByKey], unit: str) -> str:
    """Where most and fewest fail."""
    good = next(iter(lines.values())).good
    least, most = (edge(good, key=lambda place: good[place].value) for edge in (min, max))
    if good[least].value == good[most].value:
        return f"{words(key)}: {units.percent(1.0 - good[least].value)} of the flights fail in every group."
    shares = [f"{units.percent(1.0 - good[at].value)}{{}} {group(key, bins, at, unit)}" for at in (least, most)]
    return f"{words(key)}: {shares[0].format(' fail')}, but {shares[1].format('')}."


def group(key: str, bins: Bins, place: int, unit: str) -> str:
    if bins.edges is None:
        return f"with {with_option(key, bins.labels[place])}"
    low, high = bins.edges[place : place + 2].tolist()
    digits = 1 - math.floor(math.log10((high - low) or 1.0))
    said = [f"{round(end, digits) + 0.0:.10g}" for end in (low, high)]
    return units.numerals(f"from {said[0]} to {said[1]} {unit}".rstrip(" -"))

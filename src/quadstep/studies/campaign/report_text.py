"""The text of a campaign's report.html."""

from collections.abc import Mapping, Sequence
from html import escape
from itertools import starmap
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from quadstep.interfaces.log import FlightLog
from quadstep.metrics.quantities import position_errors
from quadstep.metrics.statistics import Estimate, exact_share
from quadstep.mission.fields import label
from quadstep.report import markup, units
from quadstep.report.evidence import Section, TableSection
from quadstep.report.publish import booktabs
from quadstep.studies.campaign.flyer import OUTCOMES
from quadstep.studies.campaign.planner import SINGLY
from quadstep.studies.campaign.schema import Campaign
from quadstep.studies.campaign.single_flight import replay_command
from quadstep.studies.campaign.store import Store
from quadstep.studies.campaign.summary import FEW, QUANTILES, CampaignSummary, WorstFlight
from quadstep.studies.campaign.varied import text_of, variation_text

DIGITS = 4
"""Of what is told of one flight."""

SUCCEEDED, ABOVE = "completed, succeeded", "completed, above a limit"


def facts(summary: CampaignSummary, which: str = "", since: str = "") -> list[markup.Fact]:
    """Of each metric the largest quantile, or what one flight has. which: flights, if not all; since: when errors count."""
    found = []
    for spread in summary.spreads:
        words, unit = units.metric(spread.metric)
        share, one = list(spread.quantiles.items())[-1]
        what = "" if alone(summary) else "median " if share == QUANTILES[0] else f"{100.0 * share:g}th percentile of "
        ends = " to ".join(units.quantity(end, unit) for end in one[1:])
        only = "; of completed flights only" * (summary.flights > spread.flights)
        interval = f"95 % interval: {ends}{only}" if one.bounded else FEW
        told = (units.estimate(*one, unit), interval) if summary.statistical else (units.quantity(one.value, unit),)
        found.append(markup.Fact(f"{what}{words}{since}{f', {which}' * bool(which)}", *told))
    return found


def alone(summary: CampaignSummary) -> bool:
    return summary.copies or summary.flights == 1


def opening(store: Store, campaign: Campaign, summary: CampaignSummary, path: Path) -> list[Section]:
    file, manifest = campaign.file, store.manifest
    rows = [
        ("campaign", f"{file.name}, {path}"),
        ("mission", f"{campaign.content.get('name', 'Flight')}, {campaign.source}"),
        ("flights", f"{summary.flights:,}"),
        ("a flight fails", campaign.failing),
        ("seed, precision, engine", f"{file.seed}, {file.precision}, {manifest.get('engine')}"),
        ("error sampled every", f"{file.score_period:g} s" if file.score_period else "log period of the mission"),
        ("quadstep", f"{manifest.get('version')}, with {pairs(manifest.get('packages', {}))}"),
        ("version of the draws", str(manifest.get("draws"))),
        *[("set up one by one", f"each flight, because {' and '.join(summary.singly)} {SINGLY}")][: len(summary.singly)],
        *(("machine", pairs(one)) for one in manifest["machines"]),
    ]
    varied = [(label(campaign.mission, key), key, variation_text(file, key)) for key in file.keys]
    return [
        TableSection("Campaign settings", "flown"),
        TableSection(header=("", ""), rows=rows, set_as=markup.own),
        TableSection(header=("what varies", "key", "how"), rows=varied, set_as=escape),
        markup.verbatim(campaign.text, f"campaign file {path.name}"),
    ]


def pairs(table: Mapping[str, object]) -> str:
    """A small table in one line."""
    return ", ".join(f"{name} {value}" for name, value in table.items())


def ended(summary: CampaignSummary) -> dict[str, int]:
    """The number of flights by outcome; completed ones are split by whether they succeeded."""
    good = round(summary.success.value * summary.flights)
    completed = summary.outcomes.get(OUTCOMES[0], 0)
    counts = {SUCCEEDED: good, ABOVE: completed - good} if summary.limited else {OUTCOMES[0]: completed}
    early = ((f"lost: {name}", count) for name, count in summary.outcomes.items() if name != OUTCOMES[0])
    rest = sorted(early, key=lambda one: -one[1])
    return {name: count for name, count in (*counts.items(), *rest) if count or name in (SUCCEEDED, OUTCOMES[0])}


def errors_seen(summary: CampaignSummary) -> str:
    """What the figure of the errors shows."""
    early = ", lost ones included," * bool(summary.outcomes.keys() - {OUTCOMES[0]})
    return f"The share of all flights{early} with a larger error."


def by_choice(title: str, name: str, header: Sequence[str], rows: Mapping[str, Sequence[tuple[str, ...]]]) -> TableSection:
    """A table with the rows of all flights, or with those of each value of a choice, which a first column names."""
    lead = len(rows) > 1
    every = [((which,) * lead + row) for which, some in rows.items() for row in some]
    return TableSection(title, name, [*[""] * lead, *header], every)


def outcomes(summary: CampaignSummary) -> list[tuple[str, ...]]:
    """Every outcome with its exact interval; without it where nothing is statistical."""
    some = ended(summary).items()
    return [(what, f"{count:,}", percent(share_of(summary, count)) if summary.statistical else "–") for what, count in some]


def of_key(findings: Mapping[str, tuple[str, ...]], key: str) -> list[str]:
    """The findings of a key; if there is none, those that name it."""
    own = [one for one, about in findings.items() if about[:1] == (key,)]
    return own or [one for one, about in findings.items() if key in about]


def share_of(summary: CampaignSummary, count: int) -> Estimate:
    """Of all flights so many, with the interval."""
    return exact_share(count, summary.flights, summary.tail)


def for_a_paper(summary: CampaignSummary, name: str) -> str:
    """Outcomes and quantiles as a LaTeX table; without intervals where nothing is statistical."""
    sure, groups = summary.statistical, list[list[tuple[str, ...]]]()
    for which, part in summary.each.items():
        counts = ended(part).items()
        ends = [(what, "", units.percent(*share_of(part, count)) if sure else f"{count:,}") for what, count in counts]
        groups += [[(", ".join(filter(None, (what, which))), *row) for what, *row in rows] for rows in (ends, quantiles(part))]
    comment = f"{name}: {units.counted(summary.flights, 'flight')}{', 95 % intervals' * sure}"
    return booktabs(("", "share below", "value" if sure else "flights"), groups, [comment])


def percent(one: Estimate) -> str:
    return units.percent(*one).removesuffix(" %")


def distributions(summary: CampaignSummary, since: str) -> TableSection:
    header = f"of completed flights{since}", "share below", f"value{' with its 95 % interval' * summary.statistical}"
    rows = {which: quantiles(part) for which, part in summary.each.items()}
    return by_choice("Distance from the path", "distributions", header, rows)


def quantiles(summary: CampaignSummary) -> list[tuple[str, str, str]]:
    """Rows of a table: metric, share of flights below, and the value, with its interval where there is one."""
    return [
        (
            words,
            "–" if alone(summary) else f"{100.0 * q:g} %",
            units.interval(*one, unit) if summary.statistical else units.quantity(one.value, unit),
        )
        for (words, unit), known in ((units.metric(spread.metric), spread.quantiles) for spread in summary.spreads)
        for q, one in known.items()
    ]


def from_the_start(largest: NDArray[np.float64], offsets: NDArray[np.float64], can_leave_out: bool) -> str:
    """What the largest errors are, where most are those of the first row, at which flights begin beside their paths; else
    nothing. offsets: how far beside [m]; can_leave_out: whether the mission can have errors count from later on.
    """
    count = int(((offsets > 0.0) & np.isclose(largest, offsets, rtol=1e-6, atol=0.0)).sum())
    if 2 * count <= len(largest):
        return ""
    said = f"In {count:,} of {units.counted(len(largest), 'completed flight')} the largest error is the one at the start"
    said += ", which is off the path."
    return f"{said} Set `score_from` in the mission to leave the first seconds out." if can_leave_out else said


def worst(
    told: Mapping[WorstFlight, str], values: Sequence[Mapping[str, object]], since: str, path: Path, folder: Path
) -> list[Section]:
    """A table with a column per flight, and the command that replays it. told: their outcomes; since: when errors count; path:
    of the campaign; folder: of its results.
    """
    flights = [*told]
    names = list(dict.fromkeys(name for one in values for name in one))
    endings = zip([*ENDING[:2], *(f"{error}{since}" for error in ENDING[2:])], *starmap(ending, told.items()), strict=True)
    rows = [
        *(row for row in endings if {*row[1:]} != {"–"}),
        *([name, *(text_of(drawn[name], DIGITS) if name in drawn else "–" for drawn in values)] for name in names),
    ]
    first = "Lost flights, the earliest first; then those above a limit, then the rest, each by their largest error."
    return [
        TableSection("The worst flights", "worst", text=first),
        TableSection(header=("flight", *(str(one.flight) for one in flights)), rows=rows, set_as=escape),
        TableSection(text="To replay one with its full log, here the first:"),
        markup.verbatim(replay_command(path, flights[0].flight, folder)),
        TableSection(text="Replayed in f64 (circle: start; cross: end). Plots are cropped around the desired path."),
    ]


ENDING = ("outcome", "ended [s]", "RMSE", "largest error")


def ending(one: WorstFlight, outcome: str) -> tuple[str, ...]:
    """How a flight ended, and how far from its path it was, as `ENDING` has it."""
    return outcome, "–" if one.time is None else f"{one.time:.4g}", length(one.rmse), length(one.largest)


def length(value: float | None) -> str:
    """A length [m] in a suitable unit, or a dash."""
    return "–" if value is None else units.quantity(value, "m", DIGITS)


def outcome_of(one: WorstFlight, summary: CampaignSummary) -> str:
    if summary.limited or one.outcome != OUTCOMES[0]:
        return f"lost: {one.outcome}" if one.outcome != OUTCOMES[0] else SUCCEEDED if one.success else ABOVE
    lacks = summary.lacking.get(one.flight)
    return OUTCOMES[0] if lacks is None else f"{OUTCOMES[0]},{' not' * bool(lacks)} as commanded"


def of_flight(one: WorstFlight, outcome: str, since: str) -> str:
    ended = f" at {one.time:.4g} s" if one.time is not None else f", largest error {length(one.largest)}{since}"
    return f"Flight {one.flight}: {outcome}{ended}"


def differing(one: WorstFlight, log: FlightLog, campaign: Campaign) -> str:
    """A note on a flight that ends differently from the campaign's, or far from it."""
    now = log.outcome.name.lower().replace("_", "-")
    largest = max((float((error @ error) ** 0.5) for error in position_errors(log)), default=0.0)
    if now != one.outcome:
        what = f"its outcome is {now} (largest error {length(largest)})"
    elif one.time is not None and abs(log.ended - one.time) > 0.01 * one.time:
        what = f"it ends at {log.ended:.4g} s"
    else:
        return ""
    why = "in f32, whose round-off such a flight amplifies" if not campaign.double else "with another version"
    return f"When replayed in f64, {what}; the campaign flew it {why}."


INTERVALS = (
    "Intervals are at 95 % (docs/campaigns.md). The ranges in which success rates differ were chosen after the flights: that "
    "they differ is no chance, but in new flights they may differ less."
)

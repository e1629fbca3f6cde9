"""report.html of a campaign, and its pictures."""

from collections.abc import Callable, Collection, Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from quadstep.engines.scored import LARGEST, RMSE
from quadstep.io.run_record import FIGURES
from quadstep.metrics.registry import SOUND
from quadstep.metrics.statistics import Estimate
from quadstep.mission.fields import label
from quadstep.mission.schema import Mission
from quadstep.report import markup
from quadstep.report.drawing import FigureJob
from quadstep.report.evidence import Evidence, Figure, Section, TableSection
from quadstep.report.panels import seen_moments, track_of
from quadstep.report.sheet import Sheet
from quadstep.studies.campaign import key_text
from quadstep.studies.campaign import report_text as text
from quadstep.studies.campaign.flyer import OUTCOME, OUTCOMES, SUCCESS
from quadstep.studies.campaign.pictures import (
    SCREEN,
    PlottedKey,
    PlottedMetric,
    by_key,
    draw_distributions,
    draw_keys,
    draw_ranking,
)
from quadstep.studies.campaign.schema import Campaign
from quadstep.studies.campaign.sensitivity import (
    ExplainedResult,
    FlightParts,
    Interaction,
    certain,
    first_order,
    strongest_interaction,
)
from quadstep.studies.campaign.single import MOST_POINTS, FlownAgain, draw_points, flown_again, lacking, others, write_flights
from quadstep.studies.campaign.splits import few_values, values_of
from quadstep.studies.campaign.store import Store
from quadstep.studies.campaign.summary import RESULTS, CampaignSummary, answer
from quadstep.studies.campaign.varied import VariedKey, bins
from quadstep.studies.flight_report import errors_since

RANKING = "How much of the variance each key explains on its own. Thin lines: 95 % intervals."

FEWEST, FEWEST_EITHER = 40, 10
"""Fewest flights for a statement on what explains the error; fewest failures and successes, each, for one on failure."""

FEWEST_BARS = 3
"""Of a figure; fewer say what a sentence does."""

SPREAD = "spread evenly from the smallest position RMSE to the largest"

MOST_FIRST = 3
"""Most keys of the figure at the top."""

MOST_PICTURES = 12
"""Most keys that get a figure: those that explain most."""


class RankedKeys(NamedTuple):
    """The sensitivity indices of the keys for one result, largest first, and the strongest pair; sentence: why none."""

    shares: dict[str, Estimate]
    pair: Interaction | None
    sentence: str = ""


Columns = Mapping[str, VariedKey]


class ReportSubject(NamedTuple):
    """What a report is of. flown: the `RESULTS` of the flights. path: of the campaign file. out: for its figures. columns: its
    keys. again: flights shown.
    """

    store: Store
    flown: pa.Table
    campaign: Campaign
    summary: CampaignSummary
    path: Path
    out: Path
    sheet: Sheet
    columns: Columns
    again: Mapping[int, FlownAgain]

    @property
    def folder(self) -> Path:
        return self.out / FIGURES

    @property
    def through(self) -> NDArray[np.bool_]:
        """Which flights completed."""
        return completed(self.flown)


def write_report(
    store: Store, campaign: Campaign, summary: CampaignSummary, flown: pa.Table, path: Path, columns: Columns,
    sheet: Sheet = SCREEN,
) -> CampaignSummary:  # fmt: skip
    """Write report.html, its figures and the table; the summary with what the flights shown lack, where no limits judge them.
    flown, path, columns: as in `ReportSubject`. Raises UserError.
    """
    through, worst = completed(flown), [one.flight for one in summary.worst]
    seen = [*worst, *([] if summary.copies else others(np.where(through, number(flown[RMSE]), np.nan), worst))]
    again = dict(zip(seen, flown_again(campaign, seen), strict=True))
    if not summary.limited:
        found = lacking((flight, one) for flight, one in again.items() if through[flight])
        known = [*found.values()][:1] if summary.copies else []  # which is of all
        summary = summary._replace(lacking=dict.fromkeys(range(summary.flights), *known) if known else found)

    def write(out: Path) -> None:
        evidence(ReportSubject(store, flown, campaign, summary, path, out, sheet.with_svg(), columns, again)).write_report(out)

    store.report(write)
    return summary


def evidence(of: ReportSubject) -> Evidence:
    """What the report says; draws its figures."""
    flown, through, summary, name = of.flown, of.through, of.summary, of.campaign.file.name
    rmse = np.where(through, number(flown[RMSE]), np.nan)
    success = flown[SUCCESS].to_numpy()
    mission, keys = of.campaign.mission, of.campaign.file.keys
    begun = from_the_start(mission, keys, lambda key: number(of.store.read([key])[key]), number(flown[LARGEST]), through)
    limits = limits_of(of.campaign)
    judged = next(iter(limits), RMSE)
    metric = PlottedMetric(judged, np.where(through, number(of.store.read([judged])[judged]), np.nan), limits.get(judged))
    first, more = key_sections(of, rmse, success, metric)
    told = [one for which, part in summary.each.items() for one in text.facts(part, which, errors_since(mission))]
    ends = distribution_section(of)
    errors = [figure("distributions", text.errors_seen(summary))] if (of.folder / "distributions.svg").is_file() else []
    sections = [
        *ends,
        *([TableSection(text=begun)] if begun else []),
        *(errors if first else []),
        *more,
        *worst_section(of),
        *text.opening(of.store, of.campaign, summary, of.path),
        *([TableSection("How to read this", "reading", text=text.INTERVALS)] if summary.statistical else []),
    ]
    return Evidence(
        name=name,
        kind="Campaign",
        answer=answer(summary),
        sentences=(),
        record={},
        facts=[one for one in told if not (begun and "largest error" in one.what)],
        figures=first or errors,
        sections=sections,
        paper=text.for_a_paper(summary, name),
        grade=summary.rest,
        told=summary.rest.get("grade") == SOUND,
        fold=("distributions", "ranking", "keys", "flights", "worst", "flown", "reading"),
    )


def figure(name: str, caption: str) -> Figure:
    return Figure(f"{FIGURES}/{name}", caption)


def number(column: pa.ChunkedArray) -> NDArray[np.float64]:
    """A column, with NaN for missing or non-finite values."""
    values: NDArray[np.float64] = column.to_numpy().astype(float)
    return np.where(np.isfinite(values), values, np.nan)


def distribution_section(of: ReportSubject) -> list[Section]:
    """How the flights ended, and how far from the path they were; drawn only where no choice decides."""
    rows = {which: text.outcomes(part) for which, part in of.summary.each.items()}
    body: list[Section] = [text.by_choice("How the flights ended", "outcomes", ("outcome", "flights", "share [%]"), rows)]
    limits, through = limits_of(of.campaign), of.through
    metrics = []
    for name in dict.fromkeys((RMSE, LARGEST, *limits)):
        column = of.flown[name] if name in RESULTS else of.store.read([name])[name]
        values = number(column)[through]
        metrics.append(PlottedMetric(name, values[np.isfinite(values)], limits.get(name)))
    metrics = [metric for metric in metrics if len(metric.values)]
    if metrics and of.summary.spreads:
        if not of.summary.parts:
            draw_distributions(of.folder / "distributions", metrics, of.summary.flights, of.sheet)
        body.append(text.distributions(of.summary, errors_since(of.campaign.mission)))
    return body


def from_the_start(
    mission: Mission, keys: Collection[str], drawn: Callable[[str], NDArray[np.float64]], largest: NDArray[np.float64],
    through: NDArray[np.bool_],
) -> str:  # fmt: skip
    """That the largest errors [m] of most flights that came through are those at the start; nothing where errors count from
    later on, or the keys that vary do not say how far from its path a flight starts. drawn: their values.
    """
    place = getattr(getattr(mission, "start", None), "position", None)
    anywhere = any(key.split(".")[0] == "path" or key in ("start", "start.position") for key in keys)
    if place is None or anywhere or mission.scored_from:
        return ""
    path = mission.path.build(mission.folder)
    named = [f"start.position.{axis}" for axis in range(3)]
    places = [drawn(key) if key in keys else place[axis] for axis, key in enumerate(named)]
    begun = zip(places, path.law.reference(0.0, path.parameters).position, strict=True)
    offsets = np.sqrt(sum((np.square(one - at) for one, at in begun), np.zeros(len(largest))))
    return text.from_the_start(largest[through], offsets[through], "score_from" in type(mission).model_fields)


def completed(flown: pa.Table) -> NDArray[np.bool_]:
    column = flown[OUTCOME].combine_chunks()
    return np.asarray(column.indices) == column.dictionary.to_pylist().index(OUTCOMES[0])


def limits_of(campaign: Campaign) -> dict[str, float]:
    """Above which flights fail, by the full name of the metric."""
    return {campaign.thresholds[name]: limit for name, limit in campaign.file.failure.items()}


def key_sections(
    of: ReportSubject, rmse: NDArray[np.float64], success: NDArray[np.bool_], metric: PlottedMetric
) -> tuple[list[Figure], list[Section]]:
    """What the result depends on: figures of the keys that failures go with, for the top; the ranking, then other keys.
    metric: drawn over them, a number per flight, NaN where it did not complete.
    """
    campaign, columns, findings = of.campaign, of.columns, of.summary.findings
    keys = campaign.file.keys
    if not keys:
        what = "Nothing" if of.summary.copies else "Only the noise"
        return [], [TableSection("Sensitivity", "ranking", text=f"{what} varies from flight to flight.")]
    found = {
        key_text.ERROR: explained_error(columns, rmse, campaign),
        key_text.FAILURE: explained_failure(columns, success, campaign),
    }
    ranking = ranked(keys, {name: one.shares for name, one in found.items()})
    body: list[Section] = [TableSection("Sensitivity", "ranking")]
    if sum(map(len, ranking.values())) >= FEWEST_BARS:
        first = {label(campaign.mission, key): ranking[key] for key in list(ranking)[: 2 * MOST_PICTURES]}
        draw_ranking(of.folder / "ranking", first, of.sheet)
        body.append(figure("ranking", RANKING))
    named = {key for about in findings.values() for key in about}
    body += key_text.ranking(campaign, ranking, {name: (one.sentence, one.pair) for name, one in found.items()})
    headline = next(iter(findings.values()))[0] if of.summary.by else ""
    at_top = list(dict.fromkeys(about[0] for about in findings.values() if about[0] != headline))[:MOST_FIRST] or [headline]
    drawn: dict[str, PlottedKey] = {}
    shown: dict[str, Figure] = {}
    clear = {key for key in keys if key_text.ERROR in ranking[key] and certain(ranking[key][key_text.ERROR], len(ranking))}
    for place, key in enumerate(list(ranking)[:MOST_PICTURES], 1):
        cut = bins(columns[key], campaign.file.vary.get(key))
        name = f"key-{place:02d}-{''.join(c if c.isascii() and (c.isalnum() or c in '-_.') else '_' for c in key)}"
        apart = next((other for other in ranking if other in (named | clear) - {key} and few_values(columns[other])), None)
        lines = {
            what: by_key(cut, success, metric.values, where) for what, where in values_of(apart, columns, len(success)).items()
        }
        drawn[key] = PlottedKey(label(campaign.mission, key), cut, lines, (metric.name, metric.limit))
        draw_keys(of.folder / name, [drawn[key]], of.sheet)
        elsewhere = at_top if len(at_top) > 1 else []
        seen = {one: on for one, on in findings.items() if on[0] not in elsewhere or {*on} <= {key, apart}}
        shown[key] = figure(name, key_text.over_key(key, text.of_key(seen, key)))
    at_top = [key for key in at_top if key in drawn]
    tops = [shown.pop(key) for key in at_top if len(at_top) == 1]
    if at_top and not tops:
        draw_keys(of.folder / "keys", [drawn[key] for key in at_top], of.sheet)
        said = [one for one in list(findings)[bool(of.summary.by) :] if findings[one][0] in at_top]
        tops = [figure("keys", "\n".join([*said, "Vertical bars: exact 95 % intervals; horizontal bars: ranges."]))]
    body += [key_text.keys(len(keys), MOST_PICTURES)] if shown else []
    return tops, [*body, *shown.values()]


def ranked(keys: list[str], estimates: Mapping[str, Mapping[str, Estimate]]) -> dict[str, dict[str, Estimate]]:
    """All keys with the share of each result that they explain, the key with the largest share first."""
    ranking = {key: {name: shares[key] for name, shares in estimates.items() if key in shares} for key in keys}
    return dict(sorted(ranking.items(), key=lambda item: -max((one.value for one in item[1].values()), default=-1.0)))


def explained_error(columns: Mapping[str, VariedKey], rmse: NDArray[np.float64], campaign: Campaign) -> RankedKeys:
    """Indices for the logarithm of the position RMSE of completed flights."""
    known = np.nan_to_num(rmse) > 0.0
    count = int(known.sum())
    if count < FEWEST:
        return RankedKeys({}, None, f"too few flights completed with an error above 0 ({count})")
    parts = {key: one.parts._replace(places=one.parts.places[known]) for key, one in columns.items()}
    return explained(ExplainedResult(np.log10(rmse[known])), parts, campaign)


def explained_failure(columns: Mapping[str, VariedKey], success: NDArray[np.bool_], campaign: Campaign) -> RankedKeys:
    """Indices for failure, as 0 or 1, over all flights."""
    good, flights = int(success.sum()), len(success)
    for count, what in ((flights - good, "failed"), (good, "succeeded")):
        if count < FEWEST_EITHER:
            return RankedKeys({}, None, f"too few flights {what} ({count:,} of {flights:,})")
    return explained(ExplainedResult((~success).astype(float)), {key: one.parts for key, one in columns.items()}, campaign)


def explained(result: ExplainedResult, parts: Mapping[str, FlightParts], campaign: Campaign) -> RankedKeys:
    """The indices, and the strongest pair of the first keys, which has no meaning where keys are correlated."""
    shares = first_order(result, parts)
    if not shares:
        return RankedKeys({}, None, "it does not vary")
    most = {key: parts[key] for key in list(shares)[:MOST_PICTURES]}
    return RankedKeys(shares, None if campaign.file.correlated else strongest_interaction(result, most))


def worst_section(of: ReportSubject) -> list[Section]:
    """Flights that can be seen to move; the worst: what was drawn, how to fly each again, and its picture, flown again."""
    summary, again, worst = of.summary, of.again, [one.flight for one in of.summary.worst]
    shown = {one: "the worst flights" if one in worst else f"the completed flights {SPREAD}" for one in again}
    links = write_flights(of.out, of.campaign, again, why={one: f"One of {which}." for one, which in shown.items()})
    body = moving(of, links) if links else []
    values = [
        {label(found.mission, key): value for key, value in found.values.items()} if (found := again[one].replay) else {}
        for one in worst
    ]
    begin, since = of.campaign.mission.scored_from, errors_since(of.campaign.mission)
    told = {one: text.outcome_of(one, summary) for one in summary.worst}
    body += text.worst(told, values, since, of.path, of.store.folder)
    pictures: list[Section] = []
    for one, outcome in told.items():
        log, title = again[one.flight].log, text.of_flight(one, outcome, since)
        if log is not None and again[one.flight].drawable:
            name = f"flight-{one.flight}"
            found = again[one.flight].replay
            seen = seen_moments(log, found.mission.moments if found else ())
            FigureJob(name, title, log.column("t"), [], track=track_of(log, begin), moments=seen).draw(of.folder, of.sheet)
            pictures.append(figure(name, f"{title}; shaded: not counted" if begin else title))
        else:
            why = f"cannot be replayed: {again[one.flight].reason}" if log is None else "it ended before it could be drawn"
            pictures.append(TableSection(text=f"{title}; {why}."))
        differs = text.differing(one, log, of.campaign) if log else ""
        pictures += [TableSection(text=differs)] * bool(differs)
    return [*body, *pictures]


def moving(of: ReportSubject, links: Mapping[int, str]) -> list[Section]:
    """The flights as points, some of which are links to the page where they move."""
    limits, lost = limits_of(of.campaign), ~of.through
    across, up = (PlottedMetric(name, number(of.flown[name]), limits.get(name)) for name in (RMSE, LARGEST))
    body: list[Section] = [TableSection("Flights to watch", "flights")]
    more = f", and completed ones {SPREAD}" if len(links) > len(of.summary.worst) else ""
    said = f"See them move: the worst flights{more}."
    if len(lost) > 1 and draw_points(of.folder / "points", (across, up), lost, links, of.sheet):
        whose = f": the first {MOST_POINTS} and those with a ring" if len(lost) > MOST_POINTS else ""
        points = f"Each point is a flight{whose}."
        body.append(figure("points", f"{points}\nRings: the worst flights{more}. Click one to see that flight move."))
        said = ""
    return [*body, markup.links([(link, f"flight {flight}") for flight, link in links.items()], said)]

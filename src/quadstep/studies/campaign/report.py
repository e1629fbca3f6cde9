"""report.html of a campaign, and its pictures."""

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from quadstep.engines.scored import LARGEST, RMSE
from quadstep.io.results.record import FIGURES, REPORT
from quadstep.metrics.statistics import Estimate
from quadstep.mission.keys import label
from quadstep.report import page
from quadstep.report.panels import path_job
from quadstep.report.sheet import Sheet
from quadstep.studies.campaign import report_text as text
from quadstep.studies.campaign.flyer import OUTCOME, OUTCOMES, SUCCESS, TIME
from quadstep.studies.campaign.pictures import (
    SCREEN,
    PlottedMetric,
    by_key,
    draw_distributions,
    draw_key,
    draw_outcomes,
    draw_ranking,
)
from quadstep.studies.campaign.schema import Campaign
from quadstep.studies.campaign.sensitivity import ExplainedResult, FlightParts, Interaction, first_order, strongest_interaction
from quadstep.studies.campaign.single import MOST_POINTS, draw_points, flown_again, others, write_flights
from quadstep.studies.campaign.store import Store
from quadstep.studies.campaign.summary import CampaignSummary
from quadstep.studies.campaign.varied import Varied, bins, varied

TABLE = "table.tex"

GLANCE = {
    "outcomes": "How the flights ended, and when the early ones did.",
    "distributions": "Above, how many completed flights were how far from their path; below, the share of all flights that "
    "were worse, lost ones included: where the curve meets a limit (red), it says how often that is exceeded.",
    "ranking": "What explains the spread: the share of the variance that each key explains on its own, with its interval.",
}
"""Figures of the summary, if they are drawn."""

FEWEST, FEWEST_EITHER = 40, 10
"""Fewest flights for a statement on what explains the error; fewest failures and successes, each, for one on failure."""

MOST_PICTURES = 12
"""Most keys that get a figure: those that explain most."""


class Explained(NamedTuple):
    """The sensitivity indices of the keys for one result, largest first, and the strongest pair; said: why there are none."""

    shares: dict[str, Estimate]
    pair: Interaction | None
    said: str = ""


def write_report(store: Store, campaign: Campaign, summary: CampaignSummary, path: Path, sheet: Sheet = SCREEN) -> None:
    """Write report.html, its figures and the table. path: of the campaign file, as given. Raises UserError."""

    def write(out: Path) -> None:
        body = sections(store, campaign, summary, path, out / FIGURES, sheet.with_svg())
        page.write_page(out / REPORT, campaign.file.name, body, "Campaign")
        (out / TABLE).write_text(text.for_a_paper(summary, campaign.file.name), encoding="utf-8")

    store.report(write)


def sections(
    store: Store, campaign: Campaign, summary: CampaignSummary, path: Path, folder: Path, sheet: Sheet = SCREEN
) -> list[str]:
    """The body of the page; its figures are drawn into `folder`."""
    flown = store.read([OUTCOME, TIME, RMSE, LARGEST, SUCCESS])
    through = np.asarray(flown[OUTCOME].combine_chunks().indices) == OUTCOMES.index(OUTCOMES[0])
    success = flown[SUCCESS].to_numpy()
    rmse = np.where(through, number(flown[RMSE]), np.nan)
    evidence = [
        *distribution_section(store, campaign, summary, flown, through, folder, sheet),
        *key_sections(store, campaign, rmse, success, summary.copies, folder, sheet),
        *worst_section(store, campaign, summary, flown, path, folder, sheet),
    ]
    drawn = [page.figure(folder / name, caption) for name, caption in GLANCE.items() if (folder / f"{name}.svg").is_file()]
    return [
        text.glance(summary, drawn),
        *evidence,
        *text.opening(store, campaign, summary, path),
        *text.closing(summary.copies),
    ]


def number(column: pa.ChunkedArray) -> NDArray[np.float64]:
    """A column, with NaN for missing or non-finite values."""
    values: NDArray[np.float64] = column.to_numpy().astype(float)
    return np.where(np.isfinite(values), values, np.nan)


def distribution_section(
    store: Store,
    campaign: Campaign,
    summary: CampaignSummary,
    flown: pa.Table,
    through: NDArray[np.bool_],
    folder: Path,
    sheet: Sheet,
) -> list[str]:
    """How the flights ended, and how far from the path they were."""
    times = {name: number(flown[TIME])[over_as(flown, name)] for name in summary.outcomes if name != OUTCOMES[0]}
    times = {name: some[np.isfinite(some)] for name, some in times.items()}
    draw_outcomes(folder / "outcomes", text.ended(summary), times, sheet)
    body = [
        page.heading("How the flights ended", "outcomes"),
        *text.outcomes(summary),
    ]
    limits = {campaign.thresholds[name]: limit for name, limit in campaign.file.failure.items()}
    metrics = []
    for name in dict.fromkeys((RMSE, LARGEST, *limits)):
        column = flown[name] if name in flown.column_names else store.read([name])[name]
        values = number(column)[through]
        metrics.append(PlottedMetric(name, values[np.isfinite(values)], limits.get(name)))
    metrics = [metric for metric in metrics if len(metric.values)]
    if metrics:
        draw_distributions(folder / "distributions", metrics, summary.flights, sheet)
        body += [page.heading("Distance from the path", "distributions"), *text.distributions(summary)]
    return body


def over_as(flown: pa.Table, name: str) -> NDArray[np.bool_]:
    column = flown[OUTCOME].combine_chunks()
    chosen: NDArray[np.bool_] = np.asarray(column.indices) == column.dictionary.to_pylist().index(name)
    return chosen


def key_sections(
    store: Store, campaign: Campaign, rmse: NDArray[np.float64], success: NDArray[np.bool_], copies: bool, folder: Path,
    sheet: Sheet,
) -> list[str]:  # fmt: skip
    """What the result depends on: the ranking, then key by key. copies: whether the flights do not differ."""
    keys = campaign.file.keys
    if not keys:
        what = "Nothing" if copies else "Only the noise"
        return [page.heading("Sensitivity", "ranking"), page.paragraph(f"{what} varies from flight to flight.")]
    columns = {key: varied(store.read([key])[key], campaign.file.vary.get(key)) for key in keys}
    mission = campaign.mission
    found = {text.ERROR: explained_error(columns, rmse, campaign), text.FAILURE: explained_failure(columns, success, campaign)}
    ranking = ranked(keys, {name: one.shares for name, one in found.items()})
    body = [page.heading("Sensitivity", "ranking")]
    if any(ranking.values()):
        draw_ranking(folder / "ranking", dict(list(ranking.items())[: 2 * MOST_PICTURES]), sheet)
    body += text.ranking(campaign, ranking, {name: (one.said, one.pair) for name, one in found.items()})
    body += [page.heading("Individual keys", "keys"), *text.keys(len(keys), MOST_PICTURES)]
    for place, key in enumerate(list(ranking)[:MOST_PICTURES], 1):
        cut = bins(columns[key], campaign.file.vary.get(key))
        name = f"key-{place:02d}-{''.join(c if c.isascii() and (c.isalnum() or c in '-_.') else '_' for c in key)}"
        draw_key(folder / name, label(mission, key), cut, by_key(cut, success, rmse), sheet)
        body.append(page.figure(folder / f"{name}.svg", f"Success and error over {key}"))
    return body


def ranked(keys: list[str], found: Mapping[str, Mapping[str, Estimate]]) -> dict[str, dict[str, Estimate]]:
    """All keys with the share of each result that they explain, the key with the largest share first."""
    ranking = {key: {name: shares[key] for name, shares in found.items() if key in shares} for key in keys}
    return dict(sorted(ranking.items(), key=lambda item: -max((one.value for one in item[1].values()), default=-1.0)))


def explained_error(columns: Mapping[str, Varied], rmse: NDArray[np.float64], campaign: Campaign) -> Explained:
    """Indices for the logarithm of the position RMSE of completed flights."""
    known = np.nan_to_num(rmse) > 0.0
    count = int(known.sum())
    if count < FEWEST:
        return Explained({}, None, f"too few flights completed with an error above 0 ({count})")
    return explained(
        ExplainedResult(np.log10(rmse[known])), {key: one.parts.among(known) for key, one in columns.items()}, campaign
    )


def explained_failure(columns: Mapping[str, Varied], success: NDArray[np.bool_], campaign: Campaign) -> Explained:
    """Indices for failure, as 0 or 1, over all flights."""
    good, flights = int(success.sum()), len(success)
    for count, what in ((flights - good, "failed"), (good, "succeeded")):
        if count < FEWEST_EITHER:
            return Explained({}, None, f"too few flights {what} ({count} of {flights})")
    return explained(ExplainedResult((~success).astype(float)), {key: one.parts for key, one in columns.items()}, campaign)


def explained(result: ExplainedResult, parts: Mapping[str, FlightParts], campaign: Campaign) -> Explained:
    """The indices, and the strongest pair of the first keys, which has no meaning where keys are correlated."""
    shares = first_order(result, parts)
    if not shares:
        return Explained({}, None, "it does not vary")
    most = {key: parts[key] for key in list(shares)[:MOST_PICTURES]}
    return Explained(shares, None if campaign.file.correlated else strongest_interaction(result, most))


def worst_section(
    store: Store, campaign: Campaign, summary: CampaignSummary, flown: pa.Table, path: Path, folder: Path, sheet: Sheet
) -> list[str]:
    """Flights that can be seen to move; the worst: what was drawn, how to fly each again, and its picture, flown again."""
    worst = [one.flight for one in summary.worst]
    through = over_as(flown, OUTCOMES[0])
    more = [] if summary.copies else others(np.where(through, number(flown[RMSE]), np.nan), worst)
    again = dict(zip([*worst, *more], flown_again(campaign, [*worst, *more]), strict=True))
    links = write_flights(folder.parent, campaign, again)
    body = moving(campaign, flown, ~through, links, folder, sheet) if links else []
    values = [
        {label(found.mission, key): value for key, value in found.values.items()} if (found := again[one].replay) else {}
        for one in worst
    ]
    body += [page.heading("The worst flights", "worst"), *text.worst(summary, values, path, store.folder)]
    for one in summary.worst:
        log, title = again[one.flight].log, text.of_flight(one)
        if log is not None and again[one.flight].drawable:
            name = f"flight-{one.flight}"
            path_job(log, name, title).draw(folder, sheet)
            body.append(page.figure(folder / f"{name}.svg", title))
        else:
            why = f"cannot be replayed: {again[one.flight].said}" if log is None else "it ended before it could be drawn"
            body.append(page.paragraph(f"{title}; {why}."))
        differs = text.differing(one, log, campaign) if log else ""
        body += [page.paragraph(differs)] * bool(differs)
    return body


def moving(
    campaign: Campaign, flown: pa.Table, lost: NDArray[np.bool_], links: Mapping[int, str], folder: Path, sheet: Sheet
) -> list[str]:
    """The flights as points, some of which are links to the page where they move."""
    limits = {campaign.thresholds[name]: limit for name, limit in campaign.file.failure.items()}
    across, up = (PlottedMetric(name, number(flown[name]), limits.get(name)) for name in (RMSE, LARGEST))
    body = [page.heading("Flights to watch", "flights")]
    if len(lost) > 1 and draw_points(folder / "points", (across, up), lost, links, sheet):
        whose = f"The first {MOST_POINTS} flights, and those with a ring," if len(lost) > MOST_POINTS else "All flights"
        caption = f"{whose} by how far they were from their path, up to their end. Click a ring to see that flight move."
        body.append(page.figure(folder / "points.svg", caption))
    places = [(link, f"flight {flight}") for flight, link in links.items()]
    return [*body, page.links(places, "See them move, flown as `quadstep fly` flies them:")]

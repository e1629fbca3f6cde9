"""The results of a campaign, every number with its interval."""

import itertools
from collections import Counter
from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from quadstep.engines.scored import LARGEST, RMSE
from quadstep.metrics.registry import AT_REST
from quadstep.metrics.statistics import TAIL, Estimate, exact_share, quantile
from quadstep.report import units
from quadstep.studies.campaign.flyer import FLIGHT, OUTCOME, OUTCOMES, SUCCESS, TIME
from quadstep.studies.campaign.store import Store

QUANTILES = (0.5, 0.9, 0.99, 0.999)
WORST, FEWEST_ABOVE = 5, 2
"""Flights that are told as the worst; of these at least so many that completed above a limit, if there are."""

FEWEST = 20
"""Fewest flights beyond a quantile for its interval to mean anything."""

FEW = "too few flights for a 95 % interval"

COPIES = "Its {:,} flights do not differ, so there are no statistics."
"""Of a campaign of copies of one flight, whatever varies: wind, say, on a vehicle without drag."""

POINTS = "Its {:,} flights are {} of a grid, without noise, so there are no statistics."
"""Of a campaign in which nothing is drawn at random."""

ROUNDS = "Its {:,} flights do not cover its grid of {:,} points evenly, so there are no statistics."
"""Of a campaign that flies some points of its grid more often than others."""

DID = {True: "succeeded", False: "reached the end"}
"""What flights that succeed did, by whether limits of the user's judge them."""

RESULTS = (FLIGHT, OUTCOME, TIME, RMSE, LARGEST, SUCCESS)
"""Columns of the flights that a summary and its report are of."""

SINGLE = "It is a single flight, which gives no success rate."


class MetricQuantiles(NamedTuple):
    """Quantiles of a metric over completed flights. quantiles: by share."""

    metric: str
    flights: int
    quantiles: dict[float, Estimate]


class WorstFlight(NamedTuple):
    """One of the worst flights. time: of its end, None if it completed."""

    flight: int
    outcome: str
    time: float | None
    rmse: float | None
    largest: float | None
    success: bool = False


class CampaignSummary(NamedTuple):
    """The results. success: share of flights. outcomes: number of flights by outcome. copies: whether the flights do not
    differ in any result, as where nothing varies, or nothing that has an effect. points: of a grid that the flights are, where
    nothing of them is drawn at random; 0 where something is. uneven: points of its grid, where it does not fly all of them
    equally often; else 0. singly: keys because of which each flight was set up by itself.
    meaning: as `Campaign` has it. decision: what `--until` has shown of the flights, a sentence. findings: what failures go
    with, and the keys that each names; by: `successes` of the first; parts: the flights with each of its values, if it is
    said. tail: the chance that an interval misses the truth on either side. limited: whether limits of the user's judge
    flights; lacking: what others lack of being as commanded, of those that are graded.
    """

    flights: int
    success: Estimate
    outcomes: dict[str, int]
    spreads: list[MetricQuantiles]
    worst: list[WorstFlight]
    copies: bool = False
    rest: Mapping[str, str] = {}
    singly: tuple[str, ...] = ()
    points: int = 0
    uneven: int = 0
    meaning: str = ""
    decision: str = ""
    findings: Mapping[str, tuple[str, ...]] = {}
    by: str = ""
    parts: Mapping[str, "CampaignSummary"] = {}
    tail: float = TAIL
    limited: bool = True
    lacking: Mapping[int, tuple[str, ...]] = {}

    @property
    def each(self) -> Mapping[str, "CampaignSummary"]:
        """The parts, by what they are with, or all flights."""
        return self.parts or {"": self}

    @property
    def statistical(self) -> bool:
        """Whether the flights say something of others, so that numbers have intervals."""
        return self.flights > 1 and not (self.copies or self.points or self.uneven)

    @property
    def why_not(self) -> str:
        """Why they do not, where they do not."""
        if self.uneven and not self.copies:
            return ROUNDS.format(self.flights, self.uneven)
        if self.flights == 1:
            return SINGLE
        return COPIES.format(self.flights) if self.copies else POINTS.format(self.flights, units.counted(self.points, "point"))


def summarise(
    store: Store, flown: pa.Table, varied: bool = False, rest: Mapping[str, str] = MappingProxyType({}),
    singly: Iterable[str] = (), grid: int = 1, random: bool = True, tail: float = TAIL,
) -> CampaignSummary:  # fmt: skip
    """The summary of all finished flights. flown: their `RESULTS`. varied: whether any key varies: those lost at once may then
    end alike by chance. rest, singly, tail: as in `CampaignSummary`. grid: its points, 1 without one. random: whether anything
    is drawn at random.

    Raises UserError for files that cannot be read.
    """
    count = flown.num_rows
    scored = not varied or flown[RMSE].null_count == 0
    copies = scored and alike(flown) and alike(store.read(store.manifest["metrics"]))
    points, uneven = 0 if random else min(grid, count), grid if count % grid else 0
    found = tallied(flown, tail)._replace(worst=worst(flown), copies=copies, rest=rest, singly=tuple(singly))
    told = [] if uneven and count > 1 and not copies else found.spreads  # which would count some points more often
    return found._replace(points=points, uneven=uneven, spreads=told)


def tallied(flown: pa.Table, tail: float, limited: bool = True) -> CampaignSummary:
    """The counts and quantiles of any flights. tail, limited: as in `CampaignSummary`."""
    success = exact_share(int(pc.sum(flown[SUCCESS]).as_py() or 0), flown.num_rows, tail)
    counted = {entry["values"]: entry["counts"] for entry in pc.value_counts(flown[OUTCOME]).to_pylist()}
    through = pc.equal(flown[OUTCOME].cast(pa.string()), OUTCOMES[0])
    spreads = []
    for metric in (RMSE, LARGEST):
        values = flown.filter(through)[metric].drop_null().to_numpy().astype(np.float64)
        values = values[np.isfinite(values)]
        if count_known := len(values):
            told = [q for q in QUANTILES if round(count_known * (1.0 - q), 6) >= FEWEST or q == QUANTILES[0]]
            spreads.append(MetricQuantiles(metric, count_known, {q: quantile(values, q, tail) for q in told}))
    return CampaignSummary(flown.num_rows, success, counted, spreads, [], tail=tail, limited=limited)


def alike(flown: pa.Table) -> bool:
    results = flown.select([name for name in flown.column_names if name != FLIGHT]).combine_chunks()
    return flown.num_rows > 1 and all(len(pc.unique(column)) == 1 for column in results.columns)


def worst(flown: pa.Table) -> list[WorstFlight]:
    """Lost flights, those that ended first; then others, failed ones first, the farthest from the path: at least two of the
    failed ones, if there are so many. Among equals the lower number comes first.
    """
    keys = [("good", "ascending"), (TIME, "ascending"), (LARGEST, "descending"), (FLIGHT, "ascending")]
    known = flown.append_column("good", flown[SUCCESS].cast(pa.int8()))
    through = pc.equal(flown[OUTCOME].cast(pa.string()), OUTCOMES[0])
    lost, others = (
        part.take(pc.select_k_unstable(part, k=min(WORST, part.num_rows), sort_keys=keys)).to_pylist()
        for part in (known.filter(pc.invert(through)), known.filter(through))
    )
    above = sum(not row["good"] for row in others)
    rows = [*lost[: WORST - min(above, FEWEST_ABOVE)], *others][:WORST]
    return [WorstFlight(*(row[name] for name in (FLIGHT, OUTCOME, TIME, RMSE, LARGEST, SUCCESS))) for row in rows]


def within(low: float, high: float) -> str:
    """An interval of a share in words."""
    return f"{units.percent(low)} to {units.percent(high)}"


def as_sentence(meaning: str) -> str:
    """How flights are judged, as `Campaign.meaning` has it, in a sentence after a blank."""
    return f" {meaning[2:3].upper()}{meaning[3:-1]}." if meaning else ""


def graded(lacking: Mapping[int, tuple[str, ...]]) -> dict[str, Any]:
    lacks = Counter(itertools.chain(*lacking.values()))
    return {"flights": len(lacking), "not as commanded": sum(map(bool, lacking.values())), "lacks": dict(lacks.most_common())}


def as_commanded(lacking: Mapping[int, tuple[str, ...]], reach: int, flights: int) -> str:
    """How many of the graded flights that reach the end are as commanded, what the others lack, and how many are not graded:
    sentences of their own, or where none is, first a clause. reach: so many of the flights reach the end.
    """
    ended, bad, lack = graded(lacking).values()
    more = max(0, reach - ended)
    if not ended:
        return ". No flight that reaches the end is graded" * bool(more)
    why = units.listed([f"{label} in {times:,}" if ended > 1 else label for label, times in lack.items()])
    none, shown = bad == ended, " graded flights" * bool(more)
    if ended == 1:
        one = "it" if flights == 1 else f"the only one of the{shown or ' flights'} that reaches the end"
        said = f"{one} is{' not' * bad} as commanded"
    else:
        ends = " that reach the end" * (not none or bool(more and reach < flights))
        of = f"{'none' if none else f'{bad:,}' if bad else 'all'} of the {ended:,}{shown}{ends}"
        said = f"{of} {'is' if none or bad == 1 else 'are'}{' not' * (0 < bad < ended)} as commanded"
    why = f". {why[0].upper()}{why[1:]}" if none else f"{': ' * bool(why)}{why}"
    said += why + f"; the other {'is' if more == 1 else f'{more:,} are'} not graded" * bool(more)
    return f"; {said}" if none else f". {said[0].upper()}{said[1:]}"


def answer(summary: CampaignSummary) -> str:
    """How many succeed, by what they are judged and, without limits, how many reach the end and how many do as commanded."""
    flights, share, sure = summary.flights, summary.success.value, ""
    did = DID[summary.limited]
    if summary.by:
        said = summary.by[:-1]
    elif flights == 1:
        said = f"The only flight {did if share else 'failed'}"
    else:
        said = f"{'All' if share == 1.0 else f'{units.percent(share)} of'} {units.counted(flights, 'flight')} {did}"
        sure = f" (95 % interval {within(*summary.success[1:])})" * summary.statistical
    grades = "" if summary.limited else as_commanded(summary.lacking, summary.outcomes.get(OUTCOMES[0], 0), flights)
    why_not = "" if summary.statistical or summary.by else f" {summary.why_not}"
    return f"{summary.decision} {said}{sure}{grades}.{why_not}{as_sentence(summary.meaning)}".lstrip()


def sentences(summary: CampaignSummary) -> list[str]:
    """The answer for the terminal, and what failures go with, which the answer may say already of the first key."""
    lines = [answer(summary), *list(summary.findings)[bool(summary.by) :]]
    for which, part in summary.each.items():
        having = f" with {which}" * bool(which)
        lost = ", ".join(f"{count:,} {name}" for name, count in sorted(part.outcomes.items()) if name != OUTCOMES[0])
        if lost:
            lines.append(f"Ended early{having}: {lost}.")
        for spread in part.spreads[:1]:  # the largest error may be the start's own
            words, unit = units.metric(spread.metric)
            told = [f"{100 * q:g} % below {units.quantity(e.value, unit)}" for q, e in spread.quantiles.items()]
            if summary.copies or spread.flights == 1:
                told = [units.quantity(spread.quantiles[QUANTILES[0]].value, unit)]
            whose = "the completed flight" if spread.flights == 1 else f"the {spread.flights:,} completed flights"
            lines.append(f"{words[0].upper()}{words[1:]} of {whose}{having}: {'; '.join(told)}.")
    return [line.replace("\N{NO-BREAK SPACE}", " ") for line in lines]  # which pages have between number and unit


def as_json(summary: CampaignSummary) -> dict[str, Any]:
    return {
        "copies": summary.copies,
        "points": summary.points,
        "uneven_grid": summary.uneven,
        AT_REST: dict(summary.rest),
        **({} if summary.limited else {"graded": graded(summary.lacking)}),
        "meaning": summary.meaning.strip(" ()"),
        "findings": [one.replace("\N{NO-BREAK SPACE}", " ") for one in summary.findings],
        "set_up_singly": list(summary.singly),
        **tallies(summary),
        "by_choice": {which: tallies(part) for which, part in summary.parts.items()},
        "worst": [{**one._asdict(), "lacks": summary.lacking.get(one.flight)} for one in summary.worst],
    }


def tallies(summary: CampaignSummary) -> dict[str, object]:
    quantiles = {one.metric: {str(q): found.as_json() for q, found in one.quantiles.items()} for one in summary.spreads}
    success = summary.success._asdict()
    return {"flights": summary.flights, "success": success, "outcomes": summary.outcomes, "quantiles": quantiles}

"""`quadstep campaign` from file to folder; with `--until P`, until it is certain that fewer than P of all flights fail, or
that no fewer do.

Stopping at the first interval that is good enough is wrong more often than the interval says. So looks are taken at numbers
of flights that P alone determines, and each spends half of the remaining error probability (alpha spending, Lan and DeMets
1983): the intervals of all looks together contain the probability with 95 % confidence.
"""

import math
from collections.abc import Iterator, Sequence
from itertools import count
from pathlib import Path
from typing import NamedTuple

import pyarrow as pa
import pyarrow.compute as pc

from quadstep.engines.engine import CAMPAIGNS, Engine, loaded
from quadstep.io.errors import UserError, number_in
from quadstep.io.run_record import read_manifest
from quadstep.metrics.statistics import LEVEL, TAIL, Estimate, exact_share, incomplete_beta
from quadstep.mission.distributions import Grid, Sobol
from quadstep.mission.schema import Grading, ungraded
from quadstep.report.progress import SILENT, Count, Progress
from quadstep.report.screen import command
from quadstep.report.sheet import Sheet
from quadstep.studies.campaign import MOST_FLIGHTS
from quadstep.studies.campaign.flyer import SUCCESS, Fly
from quadstep.studies.campaign.manifest import MANIFEST, CampaignManifest
from quadstep.studies.campaign.planner import is_random
from quadstep.studies.campaign.schema import Campaign, read_campaign
from quadstep.studies.campaign.splits import failures_go_with, values_of
from quadstep.studies.campaign.store import Store, opened
from quadstep.studies.campaign.summary import RESULTS, CampaignSummary, as_json, summarise, tallied
from quadstep.studies.campaign.varied import varied_keys


class CampaignRequest(NamedTuple):
    """What is asked of a campaign. path: of its file; folder: of its results, where `resume` goes on with what is there, and
    `overwrite` replaces it. flights: instead of the file's. sheet: what figures are drawn on. grading: of the loop at rest.
    """

    path: Path
    folder: Path
    flights: int | None = None
    engine: Engine = Engine.LANES
    resume: bool = False
    overwrite: bool = False
    progress: Progress = SILENT
    sheet: Sheet = Sheet()
    grading: Grading = ungraded


class FinishedCampaign(NamedTuple):
    campaign: Campaign
    summary: CampaignSummary
    folder: Path


def fly_campaign(request: CampaignRequest) -> FinishedCampaign:
    """Fly a campaign. Raises UserError, and InterruptedRun on Ctrl-C; in both cases what was flown so far is kept."""
    campaign = read_campaign(request.path)
    count = request.flights or campaign.flights
    campaign.check_count(count)
    fly: Fly = loaded(CAMPAIGNS, request.engine)(campaign)
    with opened(request.folder, campaign, count, request.engine, request.resume, request.overwrite) as store:
        fly_missing(store, fly, store.flights, request.progress)
        return finish(store, campaign, request)


def fly_missing(store: Store, fly: Fly, flights: int, progress: Progress) -> None:
    """Fly what the store lacks of its first flights."""
    missing = [chunk for chunk in store.missing if chunk.first < flights]
    counted = Count(progress, flights, flights - sum(min(chunk.past, flights) - chunk.first for chunk in missing))
    for chunk, table in fly(missing, counted.add):
        store.write(chunk, table)


def finish(
    store: Store, campaign: Campaign, request: CampaignRequest, decision: str = "", tail: float = TAIL
) -> FinishedCampaign:
    """Summarise what was flown; write the report and the final manifest. decision, tail: as in `CampaignSummary`."""
    from quadstep.studies.campaign.report import write_report  # noqa: PLC0415 (figures are drawn only here)

    grading, grid = request.grading(campaign.mission), campaign.file.combinations
    flown = store.read(RESULTS)
    summary = summarise(store, flown, campaign.varies, grading, campaign.singly, grid, is_random(campaign), tail)
    limited, columns = bool(campaign.file.failure), varied_keys(store, campaign.file)
    by, found = failures_go_with(flown, campaign, columns) if summary.statistical else ("", {})
    if by:
        apart = values_of(next(iter(found.values()))[0], columns, flown.num_rows)
        summary = summary._replace(
            parts={at: tallied(flown.filter(pa.array(one)), tail, limited) for at, one in apart.items()}
        )
    summary = summary._replace(meaning=campaign.meaning, decision=decision, findings=found, by=by, limited=limited)
    summary = write_report(store, campaign, summary, flown, request.path, columns, request.sheet)
    store.save(complete=True, summary=as_json(summary))
    return FinishedCampaign(campaign, summary, store.folder)


LOOKS = 6
"""Looks after which a run ends undecided if the user sets no limit on flights."""


class Look(NamedTuple):
    """A planned look: after so many flights, with at most so many failures. tail: error probability spent on either side."""

    flights: int
    failures: int
    tail: float


class LookResult(NamedTuple):
    look: Look
    failures: int
    rate: Estimate


class DecidedRun(NamedTuple):
    """A finished run. seen: its looks, in order."""

    done: FinishedCampaign
    target: float
    seen: tuple[LookResult, ...]

    @property
    def below(self) -> bool:
        """Whether the probability is known to be below the target."""
        return self.seen[-1].rate.high <= self.target

    @property
    def above(self) -> bool:
        """Whether the probability is known not to be below the target."""
        return self.seen[-1].rate.low >= self.target


def looks(target: float) -> Iterator[Look]:
    """The looks for a target: with 0, 1, 3, 7, ... failures allowed, each after the fewest flights that can show it."""
    for place in count():
        allowed, tail = 2**place - 1, 0.5 * (1.0 - LEVEL) / 2 ** (place + 1)
        yield Look(fewest(target, allowed, tail), allowed, tail)


def fewest(target: float, failures: int, tail: float) -> int:
    """The fewest flights for which this many failures would be this unlikely if the probability were the target."""
    low, high = failures, 2 * (failures + 1)
    while unlikely(target, failures, high) > tail:
        low, high = high, 2 * high
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if unlikely(target, failures, middle) > tail else (low, middle)
    return high


def unlikely(probability: float, failures: int, flights: int) -> float:
    """The probability of at most this many failures."""
    return incomplete_beta(1.0 - probability, flights - failures, failures + 1)


def parsed(text: str) -> float:
    """A target probability that flights can show. Raises UserError."""
    target = number_in(text)
    if not 0.0 < target < 1.0:
        raise UserError(f"--until {text!r:.40}: should be a probability of failure between 0 and 1, like 1e-4")
    if -math.log(0.25 * (1.0 - LEVEL)) / target > MOST_FLIGHTS:
        raise UserError(
            f"--until {target:g}: needs more than {MOST_FLIGHTS:.3g} flights even if none fails; use --rare for so small a "
            "probability"
        )
    return target


def fly_until(request: CampaignRequest, target: float) -> DecidedRun:
    """Fly a campaign until its failures are known to be rarer than the target, or not to be; `flights` is a limit.

    Raises UserError, and InterruptedRun on Ctrl-C; in both cases what was flown so far is kept.
    """
    campaign, most = read_campaign(request.path), request.flights
    first = next(looks(target))
    check(campaign, request.path, first, most)
    fly: Fly = loaded(CAMPAIGNS, request.engine)(campaign)
    known = read_manifest(request.folder / MANIFEST, CampaignManifest) if request.resume else None
    begun = max(first.flights, known["flights"] if known else 0)
    campaign.check_count(begun)
    seen: list[LookResult] = []
    with opened(request.folder, campaign, begun, request.engine, request.resume, request.overwrite) as store:
        for place, look in enumerate(looks(target)):
            if place and (look.flights > min(most or MOST_FLIGHTS, MOST_FLIGHTS) or (not most and place >= LOOKS)):
                break
            if look.flights > store.flights:
                campaign.check_count(look.flights)
                store.shorten(look.flights)
            fly_missing(store, fly, look.flights, request.progress)
            success = store.read([SUCCESS])[SUCCESS].slice(0, look.flights)
            failures = look.flights - int(pc.sum(success).as_py() or 0)
            seen.append(LookResult(look, failures, exact_share(failures, look.flights, look.tail)))
            if seen[-1].rate.high <= target or seen[-1].rate.low >= target:
                break
        last = seen[-1]
        tail = last.look.tail if last.look.flights == store.flights else TAIL  # of a run resumed with more, theirs
        return DecidedRun(finish(store, campaign, request, decision(target, seen), tail), target, tuple(seen))


def check(campaign: Campaign, path: Path, first: Look, most: int | None) -> None:
    """Refuses flights that are not drawn independently, and too few of them. Raises UserError."""
    for name, one in campaign.file.vary.items():
        if isinstance(one, Grid | Sobol):
            raise UserError(
                f"{path}: vary.{name}: --until counts independent flights; those of a {one.type} are not; use another type"
            )
    if most is not None and most < first.flights:
        raise UserError(f"--flights {most}: --until needs at least {first.flights} flights, even if none of them fails")


def decision(target: float, looks: Sequence[LookResult]) -> str:
    """Whether the target is shown, and by what."""
    last = looks[-1]
    if last.rate.high <= target:
        said = f"Shown: fewer than {target:g} of the flights fail."
    else:
        said = f"Not met: {target:g} of the flights or more fail." if last.rate.low >= target else "Not decided."
    return (
        f"{said} {last.failures:,} of {last.look.flights:,} flights failed: a probability from {last.rate.low:.3g} to "
        f"{last.rate.high:.3g}, with 95 % confidence over all looks (this was number {len(looks)})."
    )


def following(decided: DecidedRun, file: Path) -> list[str]:
    """What to fly next if the target is not shown."""
    last, target = decided.seen[-1], decided.target
    if decided.below:
        return []
    if decided.above:
        return ["Next: the report shows what failures depend on; replay the worst. Another controller needs a new campaign."]
    more = next(look for look in looks(target) if look.flights > last.look.flights)
    expected = last.rate.value * more.flights
    if more.flights > MOST_FLIGHTS:
        return [f"No further look is possible; a campaign has at most {MOST_FLIGHTS:.3g} flights."]
    if expected > more.failures:
        return [
            f"Next: the following look, at {more.flights:,} flights, allows {more.failures:,} failures; at the rate so "
            f"far expect {expected:,.0f}, so success is unlikely. The report shows what failures depend on."
        ]
    again = command("campaign", file, "--resume", "--until", f"{target:g}", "--flights", more.flights)
    return [f"Next: {again}, which succeeds if no more than {more.failures:,} flights fail; expect {expected:,.0f}."]


def decided_as_json(decided: DecidedRun) -> dict[str, object]:
    looks = [
        {"flights": one.look.flights, "allowed": one.look.failures, "failures": one.failures, "rate": one.rate._asdict()}
        for one in decided.seen
    ]
    decision = "below" if decided.below else "above" if decided.above else "undecided"
    return {"target": decided.target, "decision": decision, "looks": looks}

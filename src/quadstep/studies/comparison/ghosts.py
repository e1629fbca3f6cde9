"""A page on which the best controllers of each vehicle fly the same flight, one the ghost of the other."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from quadstep.engines.fly import fly
from quadstep.io.errors import UserError
from quadstep.mission.derived import ControllerSection
from quadstep.page.build import build_page
from quadstep.page.flights import ShownFlight
from quadstep.page.identity import identity
from quadstep.studies.campaign.draws import draw
from quadstep.studies.campaign.flown import Flyer
from quadstep.studies.comparison.found import Comparison
from quadstep.studies.comparison.jobs import Job
from quadstep.studies.comparison.study import FIRST, Cell, Situation

MOST_RIVALS = 3


class Shown(NamedTuple):
    """A page. flights: id of each, and of the ghost that is best shown beside it."""

    html: str
    flights: tuple[tuple[str, str, str], ...]


def ghosts(found: Comparison, flights: Sequence[Job[Cell]]) -> Shown:
    """The page, and what it shows: for each vehicle the situation that is hardest for the best, and in it the best that can be
    flown again without an autopilot. Raises UserError.
    """
    shown: list[ShownFlight] = []
    links: list[tuple[str, str, str]] = []
    for vehicle in dict.fromkeys(one.vehicle for one in found.situations):
        situation = hardest(found, vehicle)
        ranked = sorted(found.of(situation), key=lambda one: found.ranked[situation].ranks[one.controller])
        jobs = {job.subject.controller: job for job in flights if job.subject.situation == situation}
        again = [one.controller for one in ranked if not jobs[one.controller].subject.law.one_at_a_time]
        names = again[: MOST_RIVALS + 1]
        if not names:
            continue
        one = fly_side_by_side(
            found, situation, jobs[names[0]], {name: jobs[name] for name in names[1:]}, [flight.id for flight in shown]
        )
        shown.append(one)
        links.append((one.id, identity(names[1], ()) if len(names) > 1 else "", f"{one.name}: {' and '.join(names[:2])}"))
    if not shown:
        raise UserError("flights of an autopilot cannot be shown without it")
    return Shown(build_page(found.name, "", shown), tuple(links))


def hardest(found: Comparison, vehicle: str) -> Situation:
    """The situation of a vehicle whose best controller has the largest median error that is known."""

    def difficulty(situation: Situation) -> float:
        medians = [one.spreads[found.metric].median.value for one in found.of(situation)]
        return min(medians) if np.isfinite(min(medians)) else -1.0

    return max((one for one in found.situations if one.vehicle == vehicle), key=difficulty)


def fly_side_by_side(
    found: Comparison, situation: Situation, best: Job[Cell], rivals: dict[str, Job[Cell]], taken: Sequence[str]
) -> ShownFlight:
    """The first flight of a situation, under the best controller and under its rivals."""
    campaign = best.subject.campaign
    flyer = Flyer(campaign)
    drawn = {name: one.at(0) for name, one in draw(campaign.file, np.array([FIRST])).items()}
    mission, plan = flyer.planner.mission(drawn, FIRST), flyer.planner.plan(drawn, FIRST)
    log = fly(plan)
    metrics, warnings = mission.flight_metrics(log)
    name = situation.label or found.name
    others: dict[str, ControllerSection] = {}
    for rival, job in rivals.items():
        theirs = job.subject.campaign
        if theirs.content.get("vehicle") == campaign.content.get("vehicle"):
            others[rival] = Flyer(theirs).planner.mission(drawn).controller
    return ShownFlight(
        identity(name, taken), name, found.name, mission, plan, log, metrics, campaign.folder,
        warnings=tuple(warnings), called=best.subject.controller, rivals=others,
    )  # fmt: skip

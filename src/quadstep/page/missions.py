"""A page of missions: each is flown once by Python, and again when a slider is moved."""

import contextlib
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from quadstep.engines.engine import Engine
from quadstep.engines.fly import FlightPlan, fly
from quadstep.interfaces.log import FlightLog
from quadstep.io.errors import UserError
from quadstep.metrics.registry import Metrics
from quadstep.mission.read import plan_mission, read_mission
from quadstep.mission.schema import Grading, Mission, ungraded
from quadstep.page.build import Walk, build_page
from quadstep.page.flights import ShownFlight
from quadstep.page.identity import identity
from quadstep.page.model import Link
from quadstep.page.story import Story

GROUP, WALK = "Missions", "From the guided walk"


def fly_missions(
    paths: Sequence[Path], engine: Engine = Engine.LANES, story: Story | None = None, grading: Grading = ungraded
) -> str:
    """The page of these mission files, and of those of a story. Raises UserError naming the file."""
    flown = flown_files(paths, engine, grading=grading)
    if story is None:
        return missions_page(flown)
    flown, walk = with_walk(flown, story, engine)
    return build_page(story.title, "", flown, walk=walk)


def flown_files(
    paths: Sequence[Path], engine: Engine, group: str = GROUP, taken: Sequence[str] = (), grading: Grading = ungraded
) -> list[ShownFlight]:
    """Mission files, flown. taken: ids in use. Raises UserError naming the file."""
    flown: list[ShownFlight] = []
    for path in paths:
        mission = read_mission(path)
        plan = plan_mission(mission, path)
        ids = [*taken, *(one.id for one in flown)]
        log = fly(plan, engine)
        measured = mission.flight_metrics(log, grading)
        flown.append(flown_mission(mission, plan, log, path.parent, ids, measured)._replace(group=group))
    names = Counter(one.name for one in flown)
    return [
        one._replace(name=f"{one.name} ({path.stem})") if names[one.name] > 1 else one
        for one, path in zip(flown, paths, strict=True)
    ]


def with_walk(flown: Sequence[ShownFlight], story: Story, engine: Engine) -> tuple[list[ShownFlight], Walk]:
    """Flights of a page and those of a story's own missions behind them. Raises UserError naming the file."""
    own = flown_files(story.missions, engine, WALK, [one.id for one in flown])
    return [*flown, *own], Walk(story, {path: one.id for path, one in zip(story.missions, own, strict=True)})


def write_mission_page(
    path: Path, mission: Mission, plan: FlightPlan, log: FlightLog, folder: Path, measured: tuple[Metrics, list[str]]
) -> None:
    """The page of one flight beside its results; none where the package was installed without the front end. measured: what
    the mission's `flight_metrics` gave for the log.
    """
    with contextlib.suppress(UserError):
        path.write_text(missions_page([flown_mission(mission, plan, log, folder, measured=measured)]), encoding="utf-8")


def missions_page(flown: Sequence[ShownFlight], links: Sequence[Link] = ()) -> str:
    """The page of missions that were flown. Raises UserError."""
    title = flown[0].name if len(flown) == 1 else f"{len(flown)} missions"
    return build_page(title, "", flown, links=links)


def flown_mission(
    mission: Mission, plan: FlightPlan, log: FlightLog, folder: Path, taken: Sequence[str] = (),
    measured: tuple[Metrics, list[str]] | None = None,
) -> ShownFlight:  # fmt: skip
    """A mission as the page takes it. folder: where its files are looked up; taken: ids in use; measured: its metrics and
    warnings, where they are known.
    """
    metrics, found = measured or mission.flight_metrics(log)
    warnings = (*plan.warnings, *found)
    return ShownFlight(
        identity(mission.name, taken), mission.name, GROUP, mission, plan, log, metrics, folder, warnings=warnings
    )

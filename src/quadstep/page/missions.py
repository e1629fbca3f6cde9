"""A page of missions: each is flown once by Python, and again when a slider is moved."""

import contextlib
from collections.abc import Callable, Sequence
from pathlib import Path

from quadstep.errors import UserError
from quadstep.flight.engine import Engine
from quadstep.flight.engines import FlightPlan, fly
from quadstep.flight.log import FlightLog
from quadstep.mission.read import plan_mission, read_mission
from quadstep.mission.schema import Mission
from quadstep.page.build import build_page
from quadstep.page.flights import Flown
from quadstep.page.identity import identity
from quadstep.page.model import Link

GROUP = "Missions"


def fly_missions(paths: Sequence[Path], engine: Engine = Engine.LANES, told: Callable[[int], None] | None = None) -> str:
    """The page of these mission files. told: after each flight, how many are done. Raises UserError naming the file."""
    flown: list[Flown] = []
    for number, path in enumerate(paths):
        mission = read_mission(path)
        plan = plan_mission(mission, path)
        flown.append(flown_mission(mission, plan, fly(plan, engine), path.parent, [one.id for one in flown]))
        if told:
            told(number + 1)
    return missions_page(flown)


def write_mission_page(path: Path, mission: Mission, plan: FlightPlan, log: FlightLog, folder: Path) -> None:
    """The page of one flight beside its results; none where the package was installed without the front end."""
    with contextlib.suppress(UserError):
        path.write_text(missions_page([flown_mission(mission, plan, log, folder)]), encoding="utf-8")


def missions_page(flown: Sequence[Flown], links: Sequence[Link] = ()) -> str:
    """The page of missions that were flown. Raises UserError."""
    title = flown[0].name if len(flown) == 1 else f"{len(flown)} missions"
    return build_page(title, "", flown, links=links)


def flown_mission(mission: Mission, plan: FlightPlan, log: FlightLog, folder: Path, taken: Sequence[str] = ()) -> Flown:
    """A mission as the page takes it. folder: where its files are looked up; taken: ids in use."""
    metrics, found = mission.flight_metrics(log)
    warnings = (*plan.warnings, *found)
    return Flown(identity(mission.name, taken), mission.name, GROUP, mission, plan, log, metrics, folder, warnings=warnings)

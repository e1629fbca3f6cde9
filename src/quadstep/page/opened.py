"""A result on disk as a page: flown live where its metrics.json says how, else as its CSV recorded it."""

from pathlib import Path
from typing import NamedTuple

from quadstep.engines.fly import FlightPlan
from quadstep.interfaces.closed_loop import Outcome
from quadstep.io.errors import UserError
from quadstep.metrics.registry import Metrics
from quadstep.mission.read import check_mission
from quadstep.mission.schema import Mission
from quadstep.page.build import GROUP, build_page
from quadstep.page.flights import ShownFlight, facts, filed
from quadstep.page.folder import manifest, read_log
from quadstep.page.model import Link, identity


class OpenedMission(NamedTuple):
    """A mission read back, or why it cannot be flown again."""

    mission: Mission | None
    plan: FlightPlan | None
    why_not: str


def open_result(folder: Path, links: tuple[Link, ...] = ()) -> str:
    """The page of the flight in `folder`. Raises UserError where there is none."""
    one = flown_in(folder)
    return build_page(one.name, "", [one], links=links)


def open_two(folders: tuple[Path, Path], links: tuple[Link, ...] = ()) -> str:
    """The page of two flights. Raises UserError where there is none."""
    first = flown_in(folders[0])
    second = flown_in(folders[1], (first.id,))
    return build_page(f"{first.name} and {second.name}", "", [first, second], links=links)


def flown_in(folder: Path, taken: tuple[str, ...] = ()) -> ShownFlight:
    """The flight in `folder`. taken: names that others on the page have. Raises UserError where there is none."""
    content = manifest(folder)
    log = read_log(folder / "flight.csv", outcome(content), ended(content))
    planned = plan_again(content.get("mission"))
    name = name_in(content, folder.name)
    found = content.get("warnings")
    warnings = tuple(line for line in found if isinstance(line, str)) if isinstance(found, list) else ()
    metrics = metrics_of(content)
    return ShownFlight(identity(name, taken), name, GROUP, planned.mission, planned.plan, log, metrics,
                  warnings=warnings, why_not=planned.why_not)  # fmt: skip


def name_in(content: dict[str, object], otherwise: str) -> str:
    """The flight's name in a metrics.json."""
    named = content.get("name")
    return named if isinstance(named, str) else otherwise


def plan_again(content: object) -> OpenedMission:
    """The flight that a metrics.json describes; one that needs further files is not planned, so that none is read."""
    if not isinstance(content, dict):
        return OpenedMission(None, None, "its metrics.json does not say how it was flown")
    try:
        if names_files(content):
            return OpenedMission(None, None, "its mission needs further files")
        mission = check_mission(content, "metrics.json")
        return OpenedMission(mission, mission.plan(), "")
    except UserError as error:
        return OpenedMission(None, None, str(error).rstrip("."))
    except (ArithmeticError, ValueError, RecursionError):
        return OpenedMission(None, None, "its metrics.json does not describe a flight")


def names_files(content: object) -> bool:
    """Whether a mission names files to be read."""
    if isinstance(content, dict):
        own = any(isinstance(content.get(key), str) for key in ("file", "weights"))
        return own or any(names_files(part) for part in content.values())
    return isinstance(content, list) and any(names_files(part) for part in content)


def outcome(content: dict[str, object]) -> Outcome:
    """How the flight ended, as far as known."""
    name = content.get("outcome")
    return Outcome[name.upper()] if isinstance(name, str) and name.upper() in Outcome.__members__ else Outcome.COMPLETED


def ended(content: dict[str, object]) -> float:
    """When it ended [s]."""
    time = content.get("ended[s]")
    return float(time) if isinstance(time, int | float) else 0.0


def metrics_of(content: Metrics) -> Metrics:
    """The metrics that the page shows, where they are of the kind expected."""
    try:
        facts(content), filed(content)
    except (TypeError, KeyError, ValueError, AttributeError):
        return {}
    return content

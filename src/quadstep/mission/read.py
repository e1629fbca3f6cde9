"""Reading a mission file: TOML, checked, with one line that says what is wrong, where, and what is allowed."""

import tomllib
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from quadstep.errors import UserError
from quadstep.flight.engines import FlightPlan
from quadstep.mission.check import check
from quadstep.mission.presets import is_airframe
from quadstep.mission.schema import Mission

if TYPE_CHECKING:
    from quadstep.mission.airframe_mission import AirframeMission

AnyMission: TypeAlias = "Mission | AirframeMission"


def read_toml(path: Path) -> dict[str, Any]:
    """The content of a TOML file. Raises UserError naming it."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise UserError(f"{path}: cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise UserError(f"{path}: not a text file in UTF-8") from None
    except (ValueError, RecursionError) as error:  # TOMLDecodeError; numbers of too many digits; lists too deep
        raise UserError(f"{path}: not valid TOML: {error}") from None


def read_mission(path: Path) -> AnyMission:
    """The mission in a TOML file. Raises UserError naming file, key and what is allowed."""
    return check_mission(read_toml(path), str(path), path.parent)


def plan_mission(mission: AnyMission, path: Path) -> FlightPlan:
    """The flight that the mission in file `path` describes. Raises UserError naming the file."""
    try:
        return mission.plan(path.parent)
    except UserError as error:
        raise UserError(f"{path}: {error}") from None


def score_start(mission: AnyMission) -> float:
    """From when on a flight is scored [s]."""
    start: float = getattr(mission, "score_from", 0.0)
    return start


def check_mission(content: dict[str, Any], source: str, folder: Path = Path()) -> AnyMission:
    """The mission in parsed TOML, for a real vehicle if it describes one; `source` names it in the error.

    Files that describe a vehicle are looked up from `folder`.
    """
    if is_airframe(content.get("vehicle")):
        from quadstep.mission.airframe_mission import AirframeMission  # noqa: PLC0415 (loaded only where it is used)

        return check(AirframeMission, content, source, folder)
    return check(Mission, content, source)

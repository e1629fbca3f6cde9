"""Reading a mission file: TOML, checked, with one line that says what is wrong, where, and what is allowed."""

from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from pydantic import BaseModel

from quadstep.documents import read_toml
from quadstep.errors import UserError
from quadstep.flight.engines import FlightPlan
from quadstep.mission.check import check, sections, shorten, types
from quadstep.mission.presets import is_airframe
from quadstep.mission.schema import Mission

if TYPE_CHECKING:
    from quadstep.mission.airframe_mission import AirframeMission

AnyMission: TypeAlias = "Mission | AirframeMission"


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
    real = is_airframe(content.get("vehicle"))
    if not real and not mistaken(content, Mission):
        return check(Mission, content, source)
    from quadstep.mission.airframe_mission import AirframeMission  # noqa: PLC0415 (loaded only where it is used)

    model: type[BaseModel]
    other: type[BaseModel]
    model, other = (AirframeMission, Mission) if real else (Mission, AirframeMission)
    for key in mistaken(content, model):
        if key not in mistaken(content, other):
            raise UserError(f"{source}: {key} {NEEDS_VEHICLE if other is AirframeMission else NEEDS_PAPER}")
    return check(AirframeMission, content, source, folder) if real else check(Mission, content, source)


NEEDS_VEHICLE = (
    'needs a real vehicle, and [vehicle] names none: give it preset = "x500" (`quadstep vehicles` lists the presets), '
    'or file = "my.toml"'
)
NEEDS_PAPER = "needs the paper's plant, and [vehicle] describes a real vehicle: leave out its preset, file, layout and rotor"


def mistaken(content: dict[str, Any], model: type[BaseModel]) -> list[str]:
    """Tables that this kind of mission does not have, and the controller if it has none of its type."""
    unknown = [f"[{key}]" for key in content if key not in model.model_fields]
    kind = content["controller"].get("type") if isinstance(content.get("controller"), dict) else None
    allowed = [name for section in sections(model.model_fields["controller"].annotation) for name in types(section)]
    if isinstance(kind, str) and kind not in allowed:
        unknown.append(f"controller.type = {shorten(kind)}")
    return unknown

"""Reading a mission file: TOML, checked, with one line that says what is wrong, where, and what is allowed."""

from pathlib import Path
from typing import Any

from pydantic import BaseModel

from quadstep.documents import read_toml
from quadstep.errors import UserError
from quadstep.flight.engines import FlightPlan
from quadstep.mission.check import check, sections, shorten, types
from quadstep.mission.kinds import PAPER, REAL, kind, kind_of
from quadstep.mission.schema import Mission


def read_mission(path: Path) -> Mission:
    """The mission in a TOML file. Raises UserError naming file, key and what is allowed."""
    return check_mission(read_toml(path), str(path), path.parent)


def plan_mission(mission: Mission, path: Path) -> FlightPlan:
    """The flight that the mission in file `path` describes. Raises UserError naming the file."""
    try:
        return mission.plan(path.parent)
    except UserError as error:
        raise UserError(f"{path}: {error}") from None


def check_mission(content: dict[str, Any], source: str, folder: Path = Path()) -> Mission:
    """The mission in parsed TOML; `source` names it in the error. Files that it names are looked up from `folder`."""
    own = in_file(source, content, folder)
    wrong = mistaken(content, own)
    if wrong:
        for other, needs in ((REAL, NEEDS_VEHICLE), (PAPER, NEEDS_PAPER)):
            for key in wrong:
                if key not in mistaken(content, kind(other)):
                    raise UserError(f"{source}: {key} {needs}")
    return check(own, content, source, folder)


def in_file(source: str, content: dict[str, Any], folder: Path) -> type[Mission]:
    """The kind of mission in a file. Raises UserError naming it."""
    try:
        return kind_of(content, folder)
    except UserError as error:
        raise UserError(f"{source}: {error}") from None


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

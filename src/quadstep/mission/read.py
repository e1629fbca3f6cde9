"""Reading a mission file: TOML, checked, with one line that says what is wrong, where, and what is allowed."""

from pathlib import Path

from quadstep.engines.fly import FlightPlan
from quadstep.io.documents import read_toml
from quadstep.io.errors import UserError
from quadstep.mission.check import check
from quadstep.mission.kinds import kind_of
from quadstep.mission.looks import MISSION, refuse_others
from quadstep.mission.misplaced import of_another_plant
from quadstep.mission.schema import Mission


def read_mission(path: Path | str) -> Mission:
    """The mission in a TOML file. Files that it names are relative to its folder. Raises UserError naming file, key and what
    is allowed.

    >>> from quadstep import read_mission
    >>> read_mission("examples/figure_eight.toml").path.type
    'figure-eight'
    >>> read_mission("nowhere.toml")
    Traceback (most recent call last):
    quadstep.io.errors.UserError: nowhere.toml: file not found
    """
    path = Path(path)
    return check_mission(read_toml(path), str(path), path.parent)


def plan_mission(mission: Mission, path: Path, folder: Path | None = None) -> FlightPlan:
    """The flight that the mission in file `path` describes. folder: of files that it names, if not the file's own.

    Raises UserError naming the file.
    """
    try:
        return mission.plan(path.parent if folder is None else folder)
    except UserError as error:
        raise UserError(f"{path}: {error}") from None


def check_mission(content: dict[str, object], source: str, folder: Path = Path()) -> Mission:
    """The mission in parsed TOML; `source` names it in the error. Files that it names are looked up from `folder`."""
    try:
        kind = kind_of(content, folder)
    except UserError as error:
        raise UserError(f"{source}: {error}") from None
    refuse_others(content, MISSION, source)
    misplaced = of_another_plant(content, kind)
    if misplaced:
        raise UserError(f"{source}: {misplaced}")
    return check(kind, content, source, folder)

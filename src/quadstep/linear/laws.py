"""One mission under other laws: each controller of its vehicle with declared gains, nets switched off."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from quadstep.control.registry import controllers
from quadstep.io.documents import read_toml
from quadstep.io.errors import UserError
from quadstep.io.user_code.installed import CONTROLLERS
from quadstep.linear.analysis import Analysis, studied
from quadstep.mission.derived import ControllerSection
from quadstep.mission.own_controller import own_section
from quadstep.mission.own_table import unknown_type
from quadstep.mission.read import check_mission
from quadstep.mission.schema import Mission

ALL = "all"


def named(mission: Mission, text: str, folder: Path) -> list[str]:
    """The controllers that `--controllers` names: names separated by commas, or `all`. folder: of the user's own. Raises
    UserError.
    """
    known = list(controllers(mission.measures))
    if text.strip() == ALL:
        return known
    names = [name.strip() for name in text.split(",")]
    for name in names:
        if name not in known and own_section(name, mission.measures, folder) is None:
            raise UserError(f"--controllers: {unknown_type(name, (ALL, *known), CONTROLLERS)}")
    return list(dict.fromkeys(names))


def under_each(path: Path, names: Sequence[str]) -> Iterator[tuple[str, Analysis | str]]:
    """The mission in a file under each law, by name, and its loop, or why there is none."""
    content = read_toml(path)
    for name in names:
        try:
            other, nets = under(content, path, name)
            found: Analysis | str = studied(other).analysis
        except UserError as error:
            yield name, str(error).removeprefix(f"{path}: ")
            continue
        yield f"{name} (nets off)" if nets else name, found


def under(content: dict[str, object], path: Path, name: str) -> tuple[Mission, bool]:
    """A mission under the law of this name with declared gains and nets off, and whether it has nets. Raises UserError."""
    other = check_mission({**content, "controller": {"type": name}}, str(path), path.parent)
    section: ControllerSection = other.controller
    if section.table is None:
        return other, False
    off = section.model_copy(update={"nets": section.table.model_copy(update={"enabled": False})})
    return other.model_copy(update={"controller": off}), True

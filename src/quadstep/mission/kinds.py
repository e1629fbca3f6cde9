"""The kinds of mission, one a plant: the one place that knows which there are. Each is loaded when it is asked for.

Also what each kind of the user's TOML files looks like, so that a command that takes another one says which takes this.
"""

from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from quadstep.io.errors import UserError
from quadstep.mission.presets import is_airframe

MISSION, CAMPAIGN, STUDY = "mission", "campaign", "study"

HINTS = {
    (CAMPAIGN, MISSION): "`quadstep campaign` flies it, `quadstep fly` with --flight N one of its flights",
    (STUDY, MISSION): "`quadstep compare` takes it",
    (MISSION, CAMPAIGN): 'a campaign names one: mission = "FILE.toml"',
    (STUDY, CAMPAIGN): "`quadstep compare` takes it",
    (MISSION, STUDY): "name two or more missions, or a study with tables [paths], [scenarios] and [controllers]",
    (CAMPAIGN, STUDY): "a study has tables [paths], [scenarios] and [controllers]",
}
"""What to do with a file that looks like the first where the second is wanted."""


def look(content: Mapping[str, object]) -> str:
    """What parsed TOML looks like; empty if like none of these."""
    of_mission = {"path", "controller", "vehicle"} & content.keys()
    if "mission" in content:
        return "" if "path" in content else CAMPAIGN
    if {"paths", "scenarios", "controllers"} & content.keys() and not of_mission:
        return STUDY
    return MISSION if of_mission else ""


def refuse_others(content: Mapping[str, object], wanted: str, source: str, hint: str = "") -> None:
    """Raises UserError for content that looks like something else than wanted. hint: instead of that in `HINTS`."""
    found = look(content)
    if found and found != wanted:
        raise UserError(f"{source}: looks like a {found}, not a {wanted}; {hint or HINTS[found, wanted]}")


if TYPE_CHECKING:
    from quadstep.mission.schema import Mission


class MissionKind(NamedTuple):
    """A kind of mission whose vehicle has no `type`.

    place: module and class within this package. needs: what is said of its tables in a mission of another kind.
    """

    place: str
    needs: str

    def load(self) -> "type[Mission]":
        module, name = self.place.split(".")
        loaded: type[Mission] = getattr(import_module(f"quadstep.mission.{module}"), name)
        return loaded


PAPER = MissionKind(
    "lagrange.LagrangeMission",
    "needs the paper's plant, but [vehicle] describes a real vehicle: leave out preset, file, layout and rotor",
)
REAL = MissionKind(
    "multirotor.MultirotorMission",
    'needs a real vehicle, but [vehicle] names none: give preset = "x500" (`quadstep vehicles` lists the presets), '
    'or file = "my.toml"',
)
KINDS = REAL, PAPER


def kind_of(vehicle: object, folder: Path = Path()) -> "type[Mission]":
    """The kind of mission that flies the vehicle of this table. folder: of the mission. Raises UserError."""
    if isinstance(vehicle, Mapping) and isinstance(vehicle.get("type"), str):
        declared: type[Mission] = import_module("quadstep.mission.declared").declared_kind(vehicle["type"], folder)
        return declared
    return (REAL if is_airframe(vehicle) else PAPER).load()

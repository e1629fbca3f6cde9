"""Reading a mission file: TOML, checked, with one line that says what is wrong, where, and what is allowed.

Also the kinds of mission, one a plant: the one place that knows which there are; each is loaded when it is asked for. And what
each kind of the user's TOML files looks like, so that a command that takes another one says which takes this.
"""

from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from quadstep.control.registry import names
from quadstep.io.documents import read_toml
from quadstep.io.errors import LONGEST_VALUE, UserError, cut, errors_in, shorten
from quadstep.mission.check import check, sections, unknown
from quadstep.mission.presets import OWN_KEYS, is_airframe

if TYPE_CHECKING:
    from quadstep.engines.fly import FlightPlan
    from quadstep.mission.schema import Mission

MISSION, CAMPAIGN, STUDY, CLASS = "mission", "campaign", "study", "class"
VEHICLE, DATASHEET, CONTROLLER = "vehicle file", "data sheet", "controller alone"

TAKEN = {
    MISSION: "`quadstep fly` takes it", CAMPAIGN: "`quadstep campaign` takes it", STUDY: "`quadstep compare` takes it",
    CLASS: "`quadstep serve --class` takes it", VEHICLE: 'a mission names it: [vehicle] file = "FILE.toml"',
    DATASHEET: "`quadstep vehicle fit` takes it", CONTROLLER: "`quadstep replay` takes it, after --controller",
}  # fmt: skip
"""What to do with a file that looks like one of these where another is wanted."""

HINTS = {
    (CAMPAIGN, MISSION): "`quadstep campaign` flies it, `quadstep fly` with --flight N one of its flights",
    (MISSION, CAMPAIGN): 'a campaign names one: mission = "FILE.toml"',
    (MISSION, CLASS): 'a class names one: mission = "FILE.toml"',
    (MISSION, STUDY): "name two or more missions, or a study with tables [paths], [scenarios] and [controllers]",
    (CONTROLLER, MISSION): "a mission has a [path] too; `quadstep replay` takes such a file after --controller",
    (CAMPAIGN, STUDY): "a study has tables [paths], [scenarios] and [controllers]",
}
"""The same, where there is more to say of what is wanted."""


def look(content: Mapping[str, object]) -> str:
    """What parsed TOML looks like; empty if like none of these."""
    of_mission = {"path", "controller", "vehicle"} & content.keys()
    if "students" in content:
        return CLASS
    if "mission" in content:
        return "" if "path" in content else CAMPAIGN
    if {"paths", "scenarios", "controllers"} & content.keys() and not of_mission:
        return STUDY
    if of_mission:
        return CONTROLLER if content.keys() <= {"name", "controller"} else MISSION
    return DATASHEET if {"wheelbase", "kv"} & content.keys() else VEHICLE if OWN_KEYS & content.keys() else ""


def refuse_others(content: Mapping[str, object], wanted: str, source: str, hint: str = "") -> None:
    """Raises UserError for content that looks like something else than wanted. hint: instead of that in `HINTS`."""
    found = look(content)
    if found and found != wanted:
        raise UserError(f"{source}: looks like a {found}, not a {wanted}; {hint or HINTS.get((found, wanted), TAKEN[found])}")


class MissionKind(NamedTuple):
    """A kind of mission whose vehicle has no `type`.

    place: module and class within this package. needs: what is said of its tables in a mission of another kind.
    """

    place: str
    needs: str

    def load(self) -> "type[Mission]":
        module, name = self.place.split(".")
        return getattr(import_module(f"quadstep.mission.{module}"), name)


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
        return import_module("quadstep.mission.declared").declared_kind(vehicle["type"], folder)
    if isinstance(vehicle, str):
        raise UserError(f"vehicle: should be a table, not {shorten(vehicle)}")
    return (REAL if is_airframe(vehicle) else PAPER).load()


def read_mission(path: Path | str) -> "Mission":
    """The mission in a TOML file, named after the file unless it says how. Files that it names are relative to its folder.

    Raises UserError naming file, key and what is allowed.

    >>> from quadstep import read_mission
    >>> read_mission("examples/figure_eight.toml").path.type
    'figure-eight'
    >>> read_mission("nowhere.toml")
    Traceback (most recent call last):
    quadstep.io.errors.UserError: nowhere.toml: file not found
    """
    path = Path(path)
    return check_mission(read_toml(path), str(path), path.parent)


def named_after(path: Path) -> dict[str, object]:
    """The name that what is in a file has if it does not say one."""
    return {"name": path.stem} if path.stem.isprintable() else {}


def plan_mission(mission: "Mission", path: Path, folder: Path | None = None) -> "FlightPlan":
    """The flight that the mission in file `path` describes. folder: of files that it names, if not the file's own.

    Raises UserError naming the file.
    """
    with errors_in(path):
        return mission.plan(path.parent if folder is None else folder)


def check_mission(content: object, source: str, folder: Path = Path(), kind: "type[Mission] | None" = None) -> "Mission":
    """The mission of these keys, as a file, an editor or Python gives them: of the kind of its vehicle, checked once.

    source: names it in errors, and is its name where it is a file and the mission has none. folder: from where files that it
    names are looked up. kind: the only one it may be. Raises UserError.
    """
    tables = content if isinstance(content, dict) else {}
    if tables and source.endswith(".toml"):
        content = tables = named_after(Path(source)) | tables
    with errors_in(source):
        kind = kind or kind_of(tables.get("vehicle"), folder)
    controller, clock = tables.get("controller", {}), tables.get("simulation", {})
    usual = kind.usual_clock(controller.get("type"), clock, folder) if isinstance(controller, dict) else clock
    if usual is not clock:
        content = {**tables, "simulation": usual}
    try:
        return check(kind, content, source, folder)
    except UserError:
        refuse_others(tables, MISSION, source)
        misplaced = of_another_plant(tables, kind)
        if misplaced:
            raise UserError(f"{source}: {misplaced}") from None
        raise


def of_another_plant(content: dict[str, object], own: "type[Mission]") -> str:
    """What is said of a table, or of a type of controller, that missions of another plant have; else nothing."""
    wrong = foreign_tables(content, own)
    for other in KINDS if wrong and own in [kind.load() for kind in KINDS] else ():
        theirs = foreign_tables(content, other.load())
        misplaced = [key for key in wrong if key not in theirs]
        if misplaced:
            return misspelt(content) or f"{misplaced[0]} {other.needs}"
    return ""


def misspelt(content: dict[str, object]) -> str:
    """What is said of a table, or of a key of [vehicle], that no kind of mission has: it may be why the kind is not the one
    that was meant.
    """
    fields = [kind.load().model_fields for kind in KINDS]
    vehicle = content.get("vehicle")
    vehicles = [table.model_fields for each in fields for table in sections(each["vehicle"].annotation)]
    places = [("", content, fields), ("vehicle.", vehicle if isinstance(vehicle, dict) else {}, vehicles)]
    for prefix, table, known in places:
        allowed = {name for names in known for name in names}
        for key in table:
            if key not in allowed:
                return f"{prefix}{cut(key, LONGEST_VALUE)}: {unknown(key, allowed)}"
    return ""


def foreign_tables(content: dict[str, object], model: "type[Mission]") -> list[str]:
    """Tables that this kind of mission does not have, and the controller if it has none of its type."""
    unknown = [f"[{key}]" for key in content if key not in model.model_fields]
    controller = content.get("controller")
    named = controller.get("type") if isinstance(controller, dict) else None
    if isinstance(named, str) and named not in names(model.measures):
        unknown.append(f"controller.type = {shorten(named)}")
    return unknown

"""What is said of a table or a controller in a mission whose vehicle is of another kind."""

from typing import TYPE_CHECKING

from quadstep.control.registry import names
from quadstep.io.errors import cut
from quadstep.mission.check import LONGEST, sections, shorten, unknown
from quadstep.mission.kinds import KINDS

if TYPE_CHECKING:
    from quadstep.mission.schema import Mission


def of_another_plant(content: dict[str, object], own: "type[Mission]") -> str:
    """What is said of a table, or of a type of controller, that missions of another plant have; else nothing."""
    wrong = mistaken(content, own)
    for other in KINDS if wrong and own in [kind.load() for kind in KINDS] else ():
        theirs = mistaken(content, other.load())
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
                return f"{prefix}{cut(key, LONGEST)}: {unknown(key, allowed)}"
    return ""


def mistaken(content: dict[str, object], model: "type[Mission]") -> list[str]:
    """Tables that this kind of mission does not have, and the controller if it has none of its type."""
    unknown = [f"[{key}]" for key in content if key not in model.model_fields]
    controller = content.get("controller")
    named = controller.get("type") if isinstance(controller, dict) else None
    if isinstance(named, str) and named not in names(model.measures):
        unknown.append(f"controller.type = {shorten(named)}")
    return unknown

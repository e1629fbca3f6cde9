"""The unit of a mission's key, as the section that holds it says."""

from pydantic import BaseModel

from quadstep.mission.fields import Quantity
from quadstep.report.symbols import prose


def unit(mission: BaseModel, key: str) -> str:
    """The unit of a key of a checked mission; nothing if it has none."""
    section: object = mission
    found = ""
    for name in (part for part in key.split(".") if not part.isdecimal()):
        field = type(section).model_fields.get(name) if isinstance(section, BaseModel) else None
        if field is None:
            return ""
        found = next((note.unit for note in field.metadata if isinstance(note, Quantity)), "")
        section = getattr(section, name)
    return found


def label(mission: BaseModel, key: str) -> str:
    """A key and its unit, as a person reads it."""
    found = unit(mission, key)
    return f"{key} [{prose(found)}]" if found else key

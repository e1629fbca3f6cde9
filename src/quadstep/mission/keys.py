"""Keys of a mission file, dotted as in `path.end.2`: set in a user's text, or in a checked mission; their units."""

import re
from collections.abc import Callable, Mapping
from typing import TypeVar, cast

from pydantic import BaseModel

from quadstep.io.errors import UserError
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


Checked = TypeVar("Checked", bound=BaseModel)


def parts(key: str) -> list[str]:
    """The names and indices that a key consists of. Raises UserError for an empty one."""
    found = key.split(".")
    if not all(found) or any(part.isdigit() and not re.fullmatch("0|[1-9][0-9]{0,5}", part) for part in found):
        raise UserError(f"{key!r:.60} is not a key; keys are dotted, such as vehicle.mass or path.end.2")
    return found


def dotted(table: Mapping[str, object], whole: Callable[[dict[str, object]], bool], prefix: str = "") -> dict[str, object]:
    """Nested tables as one table with dotted keys.

    whole: whether a table counts as a value. Raises ValueError for a key given twice.
    """
    found: dict[str, object] = {}
    for key, value in table.items():
        more = {f"{prefix}{key}": value}
        if isinstance(value, dict) and not whole(value):
            more = dotted(value, whole, f"{prefix}{key}.")
        for name in found.keys() & more.keys():
            raise ValueError(f"{name}: is varied twice")
        found.update(more)
    return found


def with_value(content: Mapping[str, object], key: str, value: object, defaults: object) -> dict[str, object]:
    """A copy of a mission's content in which `key` has this value; absent lists, and the types of
    tables, are taken from `defaults`.

    Raises UserError where the key leads into something that is neither a table nor a list.
    """
    return cast(dict[str, object], placed(content, parts(key), value, defaults, key))


def placed(content: object, rest: list[str], value: object, defaults: object, key: str) -> object:
    """`with_value` from an inner level of the key on."""
    if not rest:
        return value
    name, *below = rest
    if name.isdigit():
        listed = content if isinstance(content, list | tuple) else defaults
        if not isinstance(listed, list | tuple):
            raise UserError(f"{key}: there is no list with an entry {name}; give the list in the mission first")
        place = int(name)
        if place >= len(listed):
            raise UserError(f"{key}: entry {place} does not exist; allowed: 0 to {len(listed) - 1}")
        inside = defaults[place] if isinstance(defaults, list | tuple) and place < len(defaults) else None
        changed = placed(listed[place], below, value, inside, key)
        return [*listed[:place], changed, *listed[place + 1 :]]
    if not isinstance(content, dict | None):
        raise UserError(f"{key}: {name!r} cannot be inside {content!r:.60}")
    known = defaults if isinstance(defaults, dict) else {}
    table = {key: known[key] for key in ("type",) if key in known} if content is None else content
    inside = known.get(name)
    return {**table, name: placed(table.get(name), below, value, inside, key)}


def overridden(section: Checked, key: str, value: object) -> Checked:
    """A checked mission with an entry replaced by something that is not checked: an array in place of a number, or of each
    number of a list.
    """
    return cast(Checked, replaced(section, parts(key), value))


def replaced(section: object, rest: list[str], value: object) -> object:
    """`overridden` from an inner level of the key on. Raises TypeError where there is no number to replace."""
    if not rest:
        if isinstance(section, tuple) and section:  # one number may be written for all entries, as in `k_x = 6`
            return tuple(replaced(entry, rest, value) for entry in section)
        if isinstance(section, bool) or not isinstance(section, float | int):
            raise TypeError(f"no number: {section!r:.60}")
        return value
    name, *below = rest
    if isinstance(section, tuple):
        place = int(name)
        return (*section[:place], replaced(section[place], below, value), *section[place + 1 :])
    if isinstance(section, BaseModel):
        changed = section.model_copy(update={name: replaced(getattr(section, name), below, value)})
        changed.__dict__.pop("modelled", None)  # a mission caches its vehicle once that is built; this is another
        return changed
    raise TypeError(f"nothing inside {section!r:.60}")

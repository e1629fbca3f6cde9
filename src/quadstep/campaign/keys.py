"""Keys of a mission file, dotted as in `path.end.2`: set in a user's text, or in a checked mission."""

import re
from collections.abc import Callable
from typing import Any

from pydantic import BaseModel

from quadstep.errors import UserError


def parts(key: str) -> list[str]:
    """The names and places that a key consists of. Raises UserError for an empty one."""
    found = key.split(".")
    if not all(found) or any(part.isdigit() and not re.fullmatch("0|[1-9][0-9]{0,5}", part) for part in found):
        raise UserError(f"{key!r:.60} is not a key; keys are dotted, such as vehicle.mass or path.end.2")
    return found


def dotted(table: Any, whole: Callable[[dict[str, Any]], bool], prefix: str = "") -> Any:
    """Tables within a table as one table with dotted keys; anything else stays as it is.

    whole: whether a table is a value. Raises ValueError for a key given twice.
    """
    if not isinstance(table, dict):
        return table
    found: dict[str, Any] = {}
    for key, value in table.items():
        nested = isinstance(value, dict) and not whole(value)
        more = dotted(value, whole, f"{prefix}{key}.") if nested else {f"{prefix}{key}": value}
        for name in found.keys() & more.keys():
            raise ValueError(f"{name}: varies twice")
        found.update(more)
    return found


def with_value(content: Any, key: str, value: Any, defaults: Any) -> Any:
    """A copy of a mission's content in which `key` has this value; lists that are not there, and the type of
    tables, are taken from `defaults`.

    Raises UserError where the key leads into something that is neither a table nor a list.
    """
    return placed(content, parts(key), value, defaults, key)


def placed(content: Any, rest: list[str], value: Any, defaults: Any, key: str) -> Any:
    """`with_value` from some way down the key."""
    if not rest:
        return value
    name, *below = rest
    if name.isdigit():
        listed = content if isinstance(content, list | tuple) else defaults
        if not isinstance(listed, list | tuple):
            raise UserError(f"{key}: there is no list to take entry {name} of; give it in the mission first")
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


def overridden(section: Any, key: str, value: Any) -> Any:
    """A checked mission with an entry replaced by something that is not checked: an array in place of a number."""
    return replaced(section, parts(key), value)


def replaced(section: Any, rest: list[str], value: Any) -> Any:
    """`overridden` from some way down the key. Raises TypeError where there is no number to replace."""
    if not rest:
        if isinstance(section, bool) or not isinstance(section, float | int):
            raise TypeError(f"no number: {section!r:.60}")
        return value
    name, *below = rest
    if isinstance(section, tuple):
        place = int(name)
        return (*section[:place], replaced(section[place], below, value), *section[place + 1 :])
    if isinstance(section, BaseModel):
        changed = section.model_copy(update={name: replaced(getattr(section, name), below, value)})
        changed.__dict__.pop("modelled", None)  # a mission keeps its vehicle once that is built; this is another
        return changed
    raise TypeError(f"nothing inside {section!r:.60}")

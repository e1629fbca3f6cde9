"""Kinds of values in a mission file; its keys, dotted as in `path.end.2`: set in a user's text, or in a checked mission; their
units.
"""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import PurePath
from typing import Annotated, TypeVar, cast

import numpy as np
from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field

from quadstep.io.errors import UserError
from quadstep.numbers import Vector, total
from quadstep.report.units import prose

Numbers = TypeVar("Numbers")


class Section(BaseModel):
    """A table of the mission file: unknown keys and wrong types are refused."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)

    def as_numbers(self, kind: Callable[..., Numbers], **others: object) -> Numbers:
        """The structure of laws whose fields have the names of these keys. others: those that have other names."""
        same = {name: one for name, one in kind.__annotations__.items() if name not in others and hasattr(self, name)}
        values = {name: getattr(self, name) for name in same}
        return kind(**{name: Vector(value) if same[name] is Vector else value for name, value in values.items()}, **others)


def plain(value: object) -> object:
    """Keys given in Python as TOML would give them: tuples and arrays as lists, NumPy's numbers as Python's, paths as text."""
    if isinstance(value, dict):
        return {key: plain(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [plain(entry) for entry in value]
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    return str(value) if isinstance(value, PurePath) else value


def as_tuple(value: object) -> object:
    """TOML has lists, the models hold tuples."""
    return tuple(value) if isinstance(value, list) else value


def list_of(count: int, words: str) -> BeforeValidator:
    """Refuses what is no list with so many entries."""

    def listed(value: object) -> tuple[object, ...]:
        if not isinstance(value, list | tuple) or len(value) != count:
            raise ValueError(f"should be {words}, not {value!r:.60}")
        return tuple(value)

    return BeforeValidator(listed)


def as_diagonal(value: object) -> tuple[object, ...]:
    """One number stands for three equal ones."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        return (value, value, value)
    if not isinstance(value, list | tuple) or len(value) != 3:
        raise ValueError(f"should be a number or a list of three, not {value!r:.60}")
    return tuple(value)


EVERY = "every entry must be"
"""Begins what is said of lists whose numbers have a range."""


def non_negative(values: tuple[float, ...]) -> tuple[float, ...]:
    if min(values) < 0.0:
        raise ValueError(f"{EVERY} zero or more")
    return values


def positive(values: tuple[float, ...]) -> tuple[float, ...]:
    """Refuses an entry that is not above zero."""
    if min(values) <= 0.0:
        raise ValueError(f"{EVERY} greater than 0")
    return values


LEAST, MOST = 1e-9, 1e9
"""Magnitudes a flight can be computed with: they may be squared, divided by, and counted in steps."""


def at_least(least: float, unit: str = "") -> AfterValidator:
    """Refuses a value above zero but below this. unit: after a blank."""

    def large_enough(value: float) -> float:
        if 0.0 < value < least:
            raise ValueError(f"should be at least {least:g}{unit}, not {value:g}")
        return value

    return AfterValidator(large_enough)


def in_radians(values: tuple[float, ...]) -> tuple[float, ...]:
    """Refuses angles of more than a turn, which are meant in degrees."""
    for value in values:
        if abs(value) > 2.0 * math.pi:
            radians = math.radians(value)
            raise ValueError(f"angles are in rad, and {value:g} is more than a turn; {value:g} degrees are {radians:.4g} rad")
    return values


Entry = TypeVar("Entry")
Several = Annotated[tuple[Entry, ...], BeforeValidator(as_tuple)]
"""A list in TOML, of any length."""

Finite = Annotated[float, Field(ge=-MOST, le=MOST, allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0.0, le=MOST, allow_inf_nan=False), at_least(LEAST)]
Duration = Annotated[float, Field(gt=0.0, le=1e6, allow_inf_nan=False), at_least(1e-3, " s")]
"""Seconds that something takes; shorter is a slip of the pen, and its powers leave the range of numbers."""

NonNegative = Annotated[float, Field(ge=0.0, le=MOST, allow_inf_nan=False), at_least(LEAST)]

Triple = Annotated[tuple[Finite, Finite, Finite], list_of(3, "a list of three numbers")]
Pair = Annotated[tuple[Finite, Finite], list_of(2, "a list of two numbers")]
Angles = Annotated[Triple, AfterValidator(in_radians)]
Diagonal = Annotated[tuple[Finite, Finite, Finite], BeforeValidator(as_diagonal)]
PositiveDiagonal = Annotated[Diagonal, AfterValidator(positive)]
NonNegativeDiagonal = Annotated[Diagonal, AfterValidator(non_negative)]


def printable(name: str) -> str:
    """Refuses line breaks and other control characters."""
    if not name.isprintable():
        raise ValueError("must be printable text in one line")
    return name


Name = Annotated[str, Field(max_length=200), AfterValidator(printable)]

LEAST_COEFFICIENT = 1e-15

PositiveCoefficient = Annotated[float, Field(gt=0.0, le=MOST, allow_inf_nan=False), at_least(LEAST_COEFFICIENT)]
Coefficient = Annotated[float, Field(ge=0.0, le=MOST, allow_inf_nan=False), at_least(LEAST_COEFFICIENT)]
"""What multiplies a square of a speed, or an inertia: smaller than other numbers, never squared itself."""

Share = Annotated[float, Field(ge=0.0, le=1.0, allow_inf_nan=False)]
PositiveTriple = Annotated[Triple, AfterValidator(positive)]
NonNegativeTriple = Annotated[Triple, AfterValidator(non_negative)]


def check_rigid(inertia: Sequence[float]) -> None:
    """Refuses a diagonal that no rigid body has. Raises ValueError."""
    for value in inertia:
        others = total(inertia) - value
        if value > others * (1.0 + 1e-12):
            raise ValueError(
                f"inertia breaks the triangle inequality: {value:g} is more than the sum of the other two, {others:g}; "
                "no rigid body has it"
            )


@dataclass(frozen=True)
class Quantity:
    """What a key means and its unit, for lists of parameters: `mass: Annotated[Positive, Quantity("kg", "mass")]`."""

    unit: str
    meaning: str


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


SAID = {
    "wind.mean": "mean wind",
    "wind.turbulence.wind_20": "wind at 20 ft",
    "controller.nets.enabled": "nets",
    "sensors.latency": "sensor latency",
    "drag.rotor": "rotor drag",
    "drag.flapping": "blade flapping",
    "imu.tilt": "IMU tilt",
}
"""What keys mean in words, where their names do not say it."""

ALONG = {
    **dict.fromkeys(
        ("mean", "swing", "position", "velocity", "force", "start", "end", "centre", "centre_of_gravity"), "along"
    ),
    **{"inertia": "about", "tilt": "about", "rotor": "along"},
}
"""Last names of keys with numbers for x, y and z, and how these are said."""


def words(key: str) -> str:
    """A key as a sentence has it.

    >>> words("wind.mean.0"), words("sensors.gyro_noise"), words("controller.k_x"), words("events.1.share")
    ('mean wind along x', 'gyro noise', 'k_x', 'events.1.share')
    """
    names = key.split(".")
    *names, place = names if names[-1].isdecimal() else [*names, ""]
    if any(one.isdecimal() for one in names):
        return key
    gain = names[0] == "controller" and (names[2:] or re.match(r"[a-zA-Z]_|[A-Z]", names[-1]))
    inner = names[1:] if names[1:] and (names[0] == "sensors" or gain) else names
    said = SAID.get(".".join(names), re.sub(r"(?<=[a-z]{2})_(?=[a-z]{2})", " ", " ".join(inner)))
    if place and names[-1] == "attitude" and int(place) < 3:
        return said.replace("attitude", ("yaw", "pitch", "roll")[int(place)])
    if place and names[-1] in ALONG and int(place) < 3:
        return f"{said} {ALONG[names[-1]]} {'xyz'[int(place)]}"
    return f"{said}[{place}]" if place else said


def label(mission: BaseModel, key: str) -> str:
    """A key in words, and its unit."""
    found = unit(mission, key)
    return f"{words(key)} [{prose(found)}]" if found else words(key)


Checked = TypeVar("Checked", bound=BaseModel)


def key_parts(key: str) -> list[str]:
    """The names and indices that a key consists of. Raises UserError for an empty one."""
    found = key.split(".")
    if not all(found) or any(part.isdigit() and not re.fullmatch("0|[1-9][0-9]{0,5}", part) for part in found):
        raise UserError(f"{key!r:.60} is not a key; keys are dotted, such as vehicle.mass or path.end.2")
    return found


def dotted(table: Mapping[str, object], whole: Callable[..., bool] = lambda _: False, prefix: str = "") -> dict[str, object]:
    """Nested tables as one table with dotted keys.

    whole: whether a table counts as a value; none does by default. Raises ValueError for a key given twice.
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
    return cast(dict[str, object], placed(content, key_parts(key), value, defaults, key))


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
    return cast(Checked, replaced(section, key_parts(key), value))


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

"""An axis of a map: `KEY=a:b:n` or `KEY=v1,v2,v3` as a user types it."""

import math
import re
from collections.abc import Sequence
from typing import NamedTuple, TypeAlias

from quadstep.io.errors import UserError
from quadstep.mission.fields import MOST
from quadstep.numbers.functions import evenly_spaced
from quadstep.studies.campaign.schema import NOT_FLOWN

Value: TypeAlias = float | int | bool | str

MOST_CELLS = 1_000_000
MOST_PANELS = 12

HOW = "give KEY=a:b:n (n numbers from a to b) or KEY=v1,v2,... (numbers, true and false, or words)"
KEY = re.compile(r"[A-Za-z0-9_-]+(\.[A-Za-z0-9_-]+)*")
WORDS = {"true": True, "false": False}


class Axis(NamedTuple):
    """One direction of the map. option: where the user gave it. ranged: evenly spaced numbers, not a list."""

    option: str
    key: str
    values: tuple[Value, ...]
    ranged: bool

    @property
    def whole(self) -> bool:
        """Whether all values are whole numbers."""
        return all(isinstance(value, float) and value.is_integer() for value in self.values)


def parse_axis(option: str, text: str, most: int) -> Axis:
    """An axis from what was typed after `option`, of at most so many values. Raises UserError."""
    key, equals, given = (part.strip() for part in text.partition("="))
    if not equals or not KEY.fullmatch(key):
        raise UserError(f"{option}: {text!r:.60} cannot be parsed; {HOW}")
    key = ".".join(str(int(part)) if part.isdecimal() else part for part in key.split("."))
    if key.partition(".")[0] in NOT_FLOWN:
        raise UserError(f"{option} {key}: {NOT_FLOWN[key.partition('.')[0]]}")
    where, ranged = f"{option} {key}", ":" in given
    values = spaced(where, given, most) if ranged else listed(where, given)
    if len(values) > most:
        raise UserError(f"{where}: {len(values)} values; allowed are at most {most}")
    return Axis(option, key, values, ranged and len(values) > 1)


def spaced(where: str, given: str, most: int) -> tuple[float, ...]:
    """The numbers of a:b:n. Raises UserError."""
    parts = given.split(":")
    if len(parts) != 3:
        raise UserError(f"{where}: {given!r:.60} cannot be parsed; {HOW}")
    low, high = (number(where, part) for part in parts[:2])
    if not re.fullmatch(r"\s*[+-]?[0-9]{1,18}\s*", parts[2], re.ASCII):
        raise UserError(f"{where}: n in a:b:n should be a whole number, not {parts[2]!r:.60}")
    count = int(parts[2])
    if not 1 <= count <= most:
        raise UserError(f"{where}: n in a:b:n should be from 1 to {most}, not {count}")
    if low >= high:
        raise UserError(f"{where}: a in a:b:n should be below b, not {low:g} and {high:g}")
    return tuple(evenly_spaced(low, high, count))


def listed(where: str, given: str) -> tuple[Value, ...]:
    """The values of v1,v2,v3. Raises UserError."""
    parts = [part.strip() for part in given.split(",")]
    if not all(parts):
        raise UserError(f"{where}: a value is missing in {given!r:.60}; {HOW}")
    values = tuple(value(where, part) for part in parts)
    if len({type(one) for one in values}) > 1:
        raise UserError(f"{where}: values should be all numbers, all true or false, or all words, not {given!r:.60}")
    twice = [part for part, one in zip(parts, values, strict=True) if values.count(one) > 1] if len(values) <= 1000 else []
    if twice or len(set(values)) < len(values):
        raise UserError(f"{where}: {(twice or ['a value'])[0]} is given twice")
    return values


def value(where: str, text: str) -> Value:
    """One value of a list. Raises UserError."""
    if text in WORDS:
        return WORDS[text]
    try:
        float(text)
    except ValueError:
        return text
    return number(where, text)


def number(where: str, text: str) -> float:
    """A number that flights can be computed with. Raises UserError."""
    try:
        found = float(text)
    except ValueError:
        raise UserError(f"{where}: {text!r:.60} is not a number; {HOW}") from None
    if not math.isfinite(found) or abs(found) > MOST:
        raise UserError(f"{where}: should be a number from {-MOST:g} to {MOST:g}, not {text.strip()!r:.60}")
    return found


def check_axes(axes: Sequence[Axis], varied: Sequence[str], source: str) -> None:
    """Refuse a key that is given twice or is inside another. varied: the keys that the file `source` varies already."""
    known: dict[str, str] = dict.fromkeys(varied, f"what varies in {source}")
    for axis in axes:
        for key, where in known.items():
            if key == axis.key:
                raise UserError(f"{axis.option} {axis.key}: is {where} too; a key can be given only once")
            outer, inner = sorted((key, axis.key), key=len)
            if inner.startswith(f"{outer}."):
                raise UserError(f"{axis.option} {axis.key}: {inner} is inside {outer} ({where}), which varies as a whole")
        known[axis.key] = axis.option


def as_typed(one: Value) -> str:
    """A value as a user would type it."""
    return str(one).lower() if isinstance(one, bool) else one if isinstance(one, str) else f"{one:.6g}"

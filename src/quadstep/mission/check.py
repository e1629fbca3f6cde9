"""Checking sections: one line that says what is wrong, where, and what is allowed."""

import contextlib
import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from types import UnionType
from typing import Any, TypeVar, Union, get_args, get_origin

from pydantic import BaseModel, ValidationError

from quadstep.io import documents
from quadstep.io.errors import LONGEST_VALUE, UserError, cut, listed, meant_of, shorten, unknown_name
from quadstep.mission.fields import EVERY, Quantity
from quadstep.mission.presets import origin

RANGES = "greater_than", "greater_than_equal", "less_than", "less_than_equal"
"""Types of errors that a quantity's unit is said of."""

PLAIN = {"bool_": "true or false", "int_": "a whole number", "float_": "a number"}
"""What a value should be, by how the type of pydantic's error begins."""

REQUIRED = "missing", "union_tag_not_found"
"""Types of errors that say of a key, without a colon, that it is required."""

NOT_NUMBERS = "float_parsing", "float_type"
"""Types of errors of which the unit of the number is said."""

INSIDE = "inside"
"""Type of an error that is within a table of another model: its context has that model and its problems."""

MOST_NAMED = 10
"""Mistakes that are named."""

Checked = TypeVar("Checked", bound=BaseModel)


def check(model: type[Checked], content: object, source: str, folder: Path = Path()) -> Checked:
    """Parsed TOML as a model; files it names are looked up from `folder`. Raises UserError: one line on what is wrong."""
    try:
        checked: Checked = model.__pydantic_validator__.validate_python(content, context={"folder": folder})
    except (ValidationError, UserError) as error:
        raise explained(model, content, error, source, folder) from None
    documents.check(content, source, finite=True)  # in tables that another model will check, or that are drawn from
    return checked


def explained(
    model: type[BaseModel], content: object, error: ValidationError | UserError, source: str, folder: Path = Path()
) -> UserError:
    """What is wrong with the content of a model, a line for each key: its problems, or the fault of a vehicle's file."""
    vehicle = "vehicle." if "vehicle" in model.model_fields else ""  # where a table may start from another file
    if isinstance(error, UserError):
        return UserError(f"{source}: {vehicle}file: {error}")
    every = sorted(mistakes(model, error.errors(include_url=False)), key=lambda one: one[1]["type"] != "extra_forbidden")
    found: dict[str, str] = {}
    meant: set[str] = set()  # keys that misspelt ones stand for, which are not missing besides
    for inner, problem, table in every:
        key, said = describe(inner, problem)
        line = ".".join((*map(str, table), (" " if problem["type"] in REQUIRED else ": ").join(filter(None, (key, said)))))
        key = ".".join(filter(None, (*map(str, table), key)))
        file = blamed_file(content, (*table, *problem["loc"]), folder)
        if file:
            line = f"{vehicle}file: {file}: {re.sub('^vehicle(: |[.])', '', line) if vehicle else line}"
        if problem["type"] == "extra_forbidden":
            meant |= {key[: key.rfind(".") + 1] + name for name in re.findall("did you mean (.*?)[?]", said)}
        if problem["type"] != "missing" or key not in meant:
            found.setdefault(re.sub(r"\[\d+\]$", "", key), line)  # of a list, the first entry
    lines = [f"{source}: {line}" for line in found.values()]
    more = len(lines) - MOST_NAMED
    return UserError(*lines[:MOST_NAMED], *([f"{source}: and {more} more"] if more > 0 else []))


def mistakes(
    model: type[BaseModel], every: Iterable[Any], table: tuple[int | str, ...] = ()
) -> Iterator[tuple[type[BaseModel], Any, tuple[int | str, ...]]]:
    """Model, problem and place of the model's table, of each that pydantic found; also in tables of the user's own keys."""
    for one in every:
        if one["type"] == INSIDE:
            yield from mistakes(one["ctx"]["model"], one["ctx"]["problems"], (*table, *one["loc"]))
        else:
            yield model, one, table


def blamed_file(content: object, location: tuple[int | str, ...], folder: Path) -> Path | None:
    """The file that a vehicle starts from where a problem at `location` comes from there."""
    table, keys = content, location
    if isinstance(content, dict) and "vehicle" in content:
        table, keys = content["vehicle"], location[1:]
        if location[:1] != ("vehicle",):
            return None
    if not isinstance(table, dict) or not isinstance(table.get("file"), str):
        return None
    with contextlib.suppress(UserError, ValueError):  # no such file: that is the problem then
        return origin(table, keys, folder) or origin(table, (), folder)
    return None


def describe(model: type[BaseModel], problem: Any) -> tuple[str, str]:
    """One problem in the user's words: its key, and what is wrong and what is allowed."""
    kind, given, context = problem["type"], problem["input"], problem.get("ctx", {})
    models, keys, options = walk(model, problem["loc"])
    key = cut(".".join(cut(part, LONGEST_VALUE) for part in keys), 3 * LONGEST_VALUE)
    if options and kind in ("union_tag_not_found", "union_tag_invalid"):
        names = [name for option in options for name in types(option)]
        missing = f"is required; allowed: {', '.join(names)}"
        return f"{key}.type", missing if kind == "union_tag_not_found" else unknown_name("value", context["tag"], names)
    field = models[-1].model_fields.get(keys[-1].partition("[")[0]) if keys else None
    note = next((one for one in (field.metadata if field else ()) if isinstance(one, Quantity)), Quantity("", ""))
    unit = "" if note.unit == "-" else note.unit
    meaning = f": {note.meaning}{unit and f' [{unit}]'}" if note.meaning else ""
    few = context.get("min_length")
    said = {
        "extra_forbidden": unknown(keys[-1] if keys else "", models[-1].model_fields),
        "missing": f"is required{meaning}",
        "model_type": f"should be a table, not {shorten(given)}",
        "model_attributes_type": f"should be a table, not {shorten(given)}",
        "dict_type": f"should be a table, not {shorten(given)}{meaning}",
        "string_type": f"should be text, not {shorten(given)}{meaning}",
        "too_short": f"should have at least {few} {'entry' if few == 1 else 'entries'}, not {context.get('actual_length')}",
        "too_long": f"should have at most {context.get('max_length')} entries, not {context.get('actual_length')}",
    }.get(kind)
    if said is None:
        text = problem["msg"].removeprefix("Value error, ").removeprefix("Input ").replace("valid tuple", "list")
        text = next((f"should be {plain}" for start, plain in PLAIN.items() if kind.startswith(start)), text)
        text = f"should be a number in {unit}" if kind in NOT_NUMBERS and unit else text
        entries = text.startswith(EVERY)
        unit = f" {unit}" if unit and (entries or kind in RANGES) else ""
        said = f"{text}, not {shorten(given)}{unit}" if entries or kind != "value_error" else text
        said = text if isinstance(given, dict) else said
    return key, said


def unknown(key: str, allowed: Iterable[str]) -> str:
    """What is said of a key that is none of these: the one that was probably meant, and all of them."""
    names = sorted(allowed)
    return f"unknown key{meant_of(key, names, f'allowed here: {listed(names)}')}"


def walk(
    model: type[BaseModel], location: tuple[int | str, ...]
) -> tuple[list[type[BaseModel]], list[str], tuple[type[BaseModel], ...]]:
    """The sections on the way to a problem, its key as the user wrote it (without pydantic's union tags), and the sections
    that it may be.
    """
    models = [model]
    options: tuple[type[BaseModel], ...] = ()
    keys: list[str] = []
    named = tagged = False  # whether the next part is a name of the user's own, or pydantic's of one of several types
    for part in location:
        if isinstance(part, int):
            keys[-1] += f"[{part}]"
            continue
        chosen = [option for option in options if part in types(option)]
        if chosen:
            models.append(chosen[0])
        if chosen or tagged:
            options, tagged = (), False
            continue
        keys.append(part)
        if not named:
            field = models[-1].model_fields.get(part)
            kind = field.annotation if field else None
            options, named = sections(kind), get_origin(kind) is dict
            tagged = get_origin(kind) in (Union, UnionType) and len({*get_args(kind)} - {type(None)}) > 1
        else:
            named = False
        if len(options) == 1 and not named and not tagged:
            models.append(options[0])
            options = ()
    return models, keys, options


def sections(annotation: object) -> tuple[type[BaseModel], ...]:
    """The sections a field may hold."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return (annotation,)
    return tuple(model for argument in get_args(annotation) for model in sections(argument))


def types(option: type[BaseModel]) -> tuple[str, ...]:
    """What a section's `type` may be; nothing where it has none."""
    return get_args(option.model_fields["type"].annotation) if "type" in option.model_fields else ()

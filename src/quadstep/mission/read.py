"""Reading a mission file: TOML, checked, with one line that says what is wrong, where, and what is allowed."""

import tomllib
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel, ValidationError

from quadstep.errors import UserError
from quadstep.flight.engines import FlightPlan
from quadstep.mission.schema import Mission


def read_mission(path: Path) -> Mission:
    """The mission in a TOML file. Raises UserError naming file, key and what is allowed."""
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise UserError(f"{path}: cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise UserError(f"{path}: not a text file in UTF-8") from None
    except (ValueError, RecursionError) as error:  # TOMLDecodeError; numbers of too many digits; lists too deep
        raise UserError(f"{path}: not valid TOML: {error}") from None
    return check_mission(content, str(path))


def plan_mission(mission: Mission, path: Path) -> FlightPlan:
    """The flight that the mission in file `path` describes. Raises UserError naming the file."""
    try:
        return mission.plan(path.parent)
    except UserError as error:
        raise UserError(f"{path}: {error}") from None


def check_mission(content: dict[str, Any], source: str) -> Mission:
    """The mission in parsed TOML; `source` names it in the error."""
    try:
        return Mission.model_validate(content)
    except ValidationError as error:
        problems = sorted(error.errors(), key=lambda problem: problem["type"] != "extra_forbidden")
        more = f" (and {len(problems) - 1} more)" if len(problems) > 1 else ""
        raise UserError(f"{source}: {describe(problems[0])}{more}") from None


def describe(problem: Any) -> str:
    """One problem in the user's words: key, what is wrong, what is allowed."""
    kind, given, context = problem["type"], problem["input"], problem.get("ctx", {})
    models, keys = walk(problem["loc"])
    key = ".".join(keys)
    if kind == "extra_forbidden":
        return f"{key}: unknown key; allowed here: {', '.join(sorted(models[-1].model_fields))}"
    if kind == "missing":
        return f"{key}: missing; it is needed"
    if kind == "union_tag_not_found":
        return f"{key}.type: missing; allowed: {context_tags(problem)}"
    if kind == "union_tag_invalid":
        return f"{key}.type: {context['tag']!r} is not known; allowed: {context_tags(problem)}"
    text = problem["msg"].removeprefix("Value error, ").removeprefix("Input ").replace("valid tuple", "list")
    shown = "" if kind == "value_error" or isinstance(given, dict) else f", not {shorten(given)}"
    return f"{key or 'mission'}: {text}{shown}"


def context_tags(problem: Any) -> str:
    """The allowed types of a path or controller."""
    models, keys = walk(problem["loc"])
    options = get_args(models[-1].model_fields[keys[-1]].annotation)
    return ", ".join(get_args(option.model_fields["type"].annotation)[0] for option in options)


def walk(location: tuple[int | str, ...]) -> tuple[list[type[BaseModel]], list[str]]:
    """The sections on the way to a problem, and its key as the user wrote it (without pydantic's union tags)."""
    models: list[type[BaseModel]] = [Mission]
    options: tuple[type[BaseModel], ...] = ()
    keys: list[str] = []
    for part in location:
        if isinstance(part, int):
            keys[-1] += f"[{part}]"
            continue
        chosen = [option for option in options if get_args(option.model_fields["type"].annotation) == (part,)]
        options = ()
        if chosen:
            models.append(chosen[0])
            continue
        keys.append(part)
        field = models[-1].model_fields.get(part)
        inside = sections(field.annotation) if field else ()
        if len(inside) == 1:
            models.append(inside[0])
        else:
            options = inside
    return models, keys


def sections(annotation: Any) -> tuple[type[BaseModel], ...]:
    """The sections a field may hold."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return (annotation,)
    return tuple(model for argument in get_args(annotation) for model in sections(argument))


def shorten(value: Any) -> str:
    """A given value, cut to fit a line."""
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."

"""A section checked: one line that says what is wrong, where, and what is allowed."""

from pathlib import Path
from typing import Any, TypeVar, get_args

from pydantic import BaseModel, ValidationError

from quadstep.errors import UserError

Checked = TypeVar("Checked", bound=BaseModel)


def check(model: type[Checked], content: dict[str, Any], source: str, folder: Path = Path()) -> Checked:
    """Parsed TOML as a model; files it names are looked up from `folder`. Raises UserError: one line on what is wrong."""
    try:
        return model.model_validate(content, context={"folder": folder})
    except ValidationError as error:
        problems = sorted(error.errors(), key=lambda problem: problem["type"] != "extra_forbidden")
        more = f" (and {len(problems) - 1} more)" if len(problems) > 1 else ""
        raise UserError(f"{source}: {describe(model, problems[0])}{more}") from None


def describe(model: type[BaseModel], problem: Any) -> str:
    """One problem in the user's words: key, what is wrong, what is allowed."""
    kind, given, context = problem["type"], problem["input"], problem.get("ctx", {})
    models, keys = walk(model, problem["loc"])
    key = ".".join(keys)
    if kind in ("union_tag_not_found", "union_tag_invalid"):
        wrong = "missing" if kind == "union_tag_not_found" else f"{context['tag']!r} is not known"
        return f"{key}.type: {wrong}; allowed: {context_tags(model, problem)}"
    said = {
        "extra_forbidden": f"unknown key; allowed here: {', '.join(sorted(models[-1].model_fields))}",
        "missing": "missing; it is needed",
        "model_type": f"should be a table, not {shorten(given)}",
        "model_attributes_type": f"should be a table, not {shorten(given)}",
        "dict_type": f"should be a table, not {shorten(given)}",
        "too_short": f"should have at least {context.get('min_length')} entries, not {context.get('actual_length')}",
        "too_long": f"should have at most {context.get('max_length')} entries, not {context.get('actual_length')}",
    }.get(kind)
    if said is None:
        text = problem["msg"].removeprefix("Value error, ").removeprefix("Input ").replace("valid tuple", "list")
        said = text if kind == "value_error" or isinstance(given, dict) else f"{text}, not {shorten(given)}"
    return f"{key}: {said}" if key else said


def context_tags(model: type[BaseModel], problem: Any) -> str:
    """The allowed types of a path or controller."""
    models, keys = walk(model, problem["loc"])
    options = sections(models[-1].model_fields[keys[-1].partition("[")[0]].annotation)
    return ", ".join(get_args(option.model_fields["type"].annotation)[0] for option in options)


def walk(model: type[BaseModel], location: tuple[int | str, ...]) -> tuple[list[type[BaseModel]], list[str]]:
    """The sections on the way to a problem, and its key as the user wrote it (without pydantic's union tags)."""
    models = [model]
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

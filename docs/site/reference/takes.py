"""What a key may hold, in words, from the annotations of the models that check files."""

import types
from enum import Enum
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import annotated_types
from pydantic import AfterValidator, BaseModel
from pydantic.fields import FieldInfo

from docs.site.reference.markdown import code
from quadstep.mission.fields import as_diagonal, non_negative, positive

Model = type[BaseModel]


def opened(kind: Any) -> tuple[Any, list[Any]]:
    """A type without its annotations, and these, outermost last."""
    notes: list[Any] = []
    while True:
        if get_origin(kind) is Annotated:
            kind, *more = get_args(kind)
            notes = [*more, *notes]
        elif get_origin(kind) is not None and "SerializeAsAny" in str(get_origin(kind)):
            (kind,) = get_args(kind)
        else:
            return kind, [one for note in notes for one in (note.metadata if isinstance(note, FieldInfo) else [note])]


def models_in(kind: Any) -> list[Model]:
    """Every table that a key may hold."""
    kind, _ = opened(kind)
    if isinstance(kind, type) and get_origin(kind) is None:
        return [kind] if issubclass(kind, BaseModel) else []
    return [found for one in get_args(kind) if not isinstance(one, str) for found in models_in(one)]


ENDS = ((annotated_types.Gt, "gt", "above"), (annotated_types.Ge, "ge", "from"), (annotated_types.Lt, "lt", "below"))

SIGNS = {"above 0": "positive ", "from 0": "non-negative "}
"""Of numbers whose range has but one end, at 0: said before them."""


def ends(notes: list[Any]) -> str:
    """A range in words; nothing where there is none that matters."""
    found = {
        word: max(getattr(note, key) for note in notes if isinstance(note, kind))
        for kind, key, word in ENDS
        if any(isinstance(note, kind) for note in notes)
    }
    if len({"above", "from"} & found.keys()) == 2:
        del found["from" if found["from"] <= found["above"] else "above"]  # the stricter says it
    found = {word: end for word, end in found.items() if abs(end) < 1e9}
    most = [
        note.le
        for note in notes
        if isinstance(note, annotated_types.Le) and isinstance(note.le, int | float) and note.le < 1e6
    ]
    if list(found) == ["from"] and most:
        return f"from {found['from']:g} to {min(most):g}"
    return " and ".join([*(f"{word} {end:g}" for word, end in found.items()), *(f"at most {min(most):g}" for _ in most[:1])])


WORDS = {bool: "`true`, `false`", int: "a whole number", float: "a number", str: "text"}

ANY = "values of any kind"

COUNTS = {2: "two", 3: "three", 4: "four", 5: "five", 6: "six"}

SEVERAL = {bool: "`true` or `false`", int: "whole numbers", float: "numbers", str: "strings"}


def several(kind: Any, count: str = "") -> str:
    """What a list or a table of such entries takes; count: how many, in words."""
    kind, notes = opened(kind)
    origin, arguments = get_origin(kind), get_args(kind)
    if origin is Literal:
        return f"{count}values, each {' or '.join(code(repr(one)) for one in arguments)}"
    if origin in (tuple, list):
        return f"{count}lists of {several(arguments[0])}"
    if isinstance(kind, type) and issubclass(kind, BaseModel):
        return f"{count}[tables](#{anchor(kind)})"
    within = ends(notes)
    sign = SIGNS.get(within, "")
    return f"{count}{sign}{SEVERAL.get(kind, ANY)}{f' {within}' if within and not sign else ''}"


def of_entries(kind: Any, notes: list[Any]) -> str:
    """What a list takes."""
    inner = get_args(kind)
    checks = [note.func for note in notes if isinstance(note, AfterValidator)]
    each = "positive " if positive in checks else "non-negative " if non_negative in checks else ""
    least = max((note.min_length for note in notes if isinstance(note, annotated_types.MinLen)), default=0)
    most = min((note.max_length for note in notes if isinstance(note, annotated_types.MaxLen)), default=None)
    if len(inner) == 2 and inner[1] is Ellipsis:
        exactly = f"{COUNTS.get(least, least)} " if least == most else f"at least {least} " if least > 1 else ""
        return f"a list of {several(inner[0], exactly)}"
    words = COUNTS.get(len(inner), str(len(inner)))
    alone = "one or " if any(getattr(note, "func", None) is as_diagonal for note in notes) else ""
    return f"{alone}{words} {each}numbers" if each else f"{alone}{several(inner[0], f'{words} ')}"


def takes(kind: Any, notes: tuple[Any, ...] = ()) -> str:
    """What a key may hold, in words."""
    kind, inner = opened(kind)
    said, origin, arguments = [*inner, *notes], get_origin(kind), get_args(kind)
    if origin in (Union, types.UnionType):
        parts = [takes(one, tuple(said)) for one in arguments if one is not type(None)]
        text = " or ".join(dict.fromkeys(parts))
    elif origin is Literal:
        text = ", ".join(code(f'"{one}"' if isinstance(one, str) else repr(one)) for one in arguments)
    elif origin is tuple:
        text = of_entries(kind, said)
    elif origin is dict:
        text = f"a table of {several(arguments[1])}".removesuffix(f" of {ANY}")
    elif origin is list:
        text = f"a list of {several(arguments[0])}"
    elif isinstance(kind, type) and issubclass(kind, Enum):
        text = ", ".join(code(f'"{one.value}"') for one in kind)
    elif isinstance(kind, type) and issubclass(kind, BaseModel):
        text = f"[{kind_name(kind)}](#{anchor(kind)})"
    else:
        within = ends(said)
        sign = SIGNS.get(within) if kind is float else None
        text = f"a {sign}number" if sign else f"{WORDS.get(kind, 'anything')} {within}".strip()
    return text


def kind_name(model: Model) -> str:
    """How a table is called: by its type where it has one, else by its class."""
    field = model.model_fields.get("type")
    if field is not None and get_origin(field.annotation) is Literal:
        return " or ".join(map(str, get_args(field.annotation)))
    return "a table"


def anchor(model: Model) -> str:
    """Where a table stands on its page."""
    return model.__name__.lower()

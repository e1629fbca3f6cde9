"""Structures of numbers as structs of C, and as inputs of a law that is being recorded."""

from collections.abc import Callable, Mapping
from typing import NamedTuple, cast

from quadstep.c99.writing import bare
from quadstep.errors import UserError
from quadstep.numbers import Matrix, Structure, Table, Vector, flatten, leaf_names
from quadstep.numbers.c_text import literal
from quadstep.numbers.rows import FEWEST_ROWS, RowMatrix, RowRecord, RowVector
from quadstep.numbers.script import ScriptTable

INDENT = "    "


class Array(NamedTuple):
    """An array of C. sizes: from the outside in. entries: its numbers, in order."""

    sizes: tuple[int, ...]
    entries: tuple[object, ...]


def as_array(value: Structure) -> Array | None:
    """A vector, a matrix, a table or a plain tuple of these as an array; None for what is none."""
    if isinstance(value, Table):
        return Array((value.size,), tuple(value.values))
    if isinstance(value, Vector):
        return Array((len(value),), tuple(value))
    if isinstance(value, Matrix):
        rows = [as_array(row) for row in value]
    elif isinstance(value, tuple) and not hasattr(value, "_fields") and not any(hasattr(one, "_fields") for one in value):
        rows = [as_array(one) or Array((), (one,)) for one in value]
    else:
        return None
    known = [row for row in rows if row is not None]
    if len({row.sizes for row in known}) > 1:
        raise TypeError("a tuple of vectors of different lengths has no array of C")
    return Array((len(known), *(known[0].sizes if known else ())), tuple(entry for row in known for entry in row.entries))


def fields_of(value: Structure) -> Mapping[str, Structure]:
    """The fields of a NamedTuple."""
    names: tuple[str, ...] = getattr(value, "_fields", ())
    return {name: getattr(value, name) for name in names}


def has_numbers(value: Structure) -> bool:
    """Whether a structure holds any: a struct of C cannot be empty."""
    return bool(flatten(value))


def as_structs(value: Structure) -> tuple[Structure, ...]:
    """A NamedTuple, or a tuple of alike ones, as these; none for anything else."""
    if hasattr(value, "_fields"):
        return (value,)
    if not isinstance(value, tuple) or not value or not all(hasattr(one, "_fields") for one in value):
        return ()
    if len({tuple(leaf_names(one)) for one in value}) > 1:
        raise TypeError("a tuple of structures of different shapes has no array of C")
    return value


def members(value: Structure, comment: Callable[[str], str], path: str = "", depth: int = 1) -> list[str]:
    """The members of a struct. comment: of a member, by dotted name."""
    lines = []
    for name, field in fields_of(value).items():
        if not has_numbers(field):
            continue
        place, indent = f"{path}{name}", INDENT * depth
        array, structs = as_array(field), as_structs(field)
        if structs:
            inner = members(structs[0], comment, f"{place}.", depth + 1)
            size = "" if hasattr(field, "_fields") else f"[{len(structs)}]"
            lines += [f"{indent}struct", f"{indent}{{", *inner, f"{indent}}} {name}{size};"]
            continue
        sizes = "".join(f"[{size}]" for size in array.sizes) if array else ""
        said = comment(place)
        lines.append(f"{indent}real {name}{sizes};{f' /* {said} */' if said else ''}")
    return lines


def initialiser(value: Structure, precise: bool, path: str = "", depth: int = 1) -> list[str]:
    """The numbers of a struct, member by member. Raises UserError naming a number that does not fit."""
    lines = []
    for name, field in fields_of(value).items():
        if not has_numbers(field):
            continue
        indent, array, structs = INDENT * depth, as_array(field), as_structs(field)
        if structs:
            brackets = ("{", "}") if hasattr(field, "_fields") else ("{{", "}}")
            texts = ["\n".join(initialiser(one, precise, f"{path}{name}.", depth + 1)) for one in structs]
            lines += [f"{indent}.{name} =", indent + brackets[0], f"\n{indent}}},{{\n".join(texts), f"{indent}{brackets[1]},"]
        elif array is None:
            lines.append(f"{indent}.{name} = {said(f'{path}{name}', Array((), (field,)), precise)},")
        else:
            lines.append(f"{indent}.{name} = {said(f'{path}{name}', array, precise)},")
    return lines


def said(path: str, array: Array, precise: bool) -> str:
    """A number, or an array's in braces. Raises UserError naming it where one does not fit."""
    try:
        return braced(array, precise) if array.sizes else number(array.entries[0], precise)
    except UserError as error:
        raise UserError(f"{path}: {error}") from None


def braced(array: Array, precise: bool) -> str:
    """An array's numbers in braces."""
    if len(array.sizes) == 1:
        return "{" + ", ".join(number(entry, precise) for entry in array.entries) + "}"
    size, inner = len(array.entries) // array.sizes[0], array.sizes[1:]
    rows = (Array(inner, array.entries[at : at + size]) for at in range(0, len(array.entries), size))
    return "{" + ", ".join(braced(row, precise) for row in rows) + "}"


def number(value: object, precise: bool) -> str:
    """A number without brackets."""
    return bare(literal(float(cast(float, value)), precise))


def found(record: RowRecord, value: Structure, text: str) -> Structure:  # noqa: PLR0911 (one for each kind)
    """The structure as a law finds it in memory under this name (`memory->`): long arrays stay there."""
    if isinstance(value, Table):
        return ScriptTable(record, text, value.size)
    if isinstance(value, Matrix | Vector) and len(value) >= FEWEST_ROWS * (1 if isinstance(value, Matrix) else 2):
        array = record.array(text)
        if isinstance(value, Vector):
            return RowVector.found(record, len(value), array)
        return RowMatrix.found(record, (len(value), len(value.rows[0])), array)
    if isinstance(value, Vector | Matrix):
        entries = value.entries if isinstance(value, Vector) else value.rows
        return type(value)([found(record, entry, f"{text}[{i}]") for i, entry in enumerate(entries)])
    if isinstance(value, tuple) and not hasattr(value, "_fields"):
        return tuple(found(record, one, f"{text}[{i}]") for i, one in enumerate(value))
    if isinstance(value, tuple):
        start = text if text.endswith(">") else f"{text}."
        return value._make(found(record, field, start + name) for name, field in fields_of(value).items())  # type: ignore[attr-defined]
    return record.input(text)

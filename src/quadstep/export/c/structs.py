"""Structures of numbers as C structs, and as inputs of a law that is being recorded; literals, and templates with words to
fill in.
"""

import math
import re
from collections import namedtuple
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple, cast

import numpy as np

from quadstep.io.errors import UserError, errors_in
from quadstep.numbers import Matrix, Number, Structure, Table, Vector, flatten, leaf_names
from quadstep.program.assignments import INPUT
from quadstep.program.recorded import RecordedNumber
from quadstep.program.rows import FEWEST_ROWS, LEFT, LoopBody, RowMatrix, RowRecord, RowVector

TEXTS = Path(__file__).parent / "texts"


def filled(path: Path, words: Mapping[str, str]) -> str:
    """A template with each of these words replaced, where it stands alone or begins a name."""
    text = path.read_text(encoding="utf-8")
    known = "|".join(map(re.escape, sorted(words, key=len, reverse=True)))
    return re.sub(rf"\b(?:{known})", lambda found: words[found[0]], text)


def literal(value: float, precise: bool) -> str:
    """A number as C reads it: f64 where precise, else the nearest f32. Raises UserError where an f32 cannot hold it."""
    if value != value:  # noqa: PLR0124 (NaN)
        return "((real)NAN)"
    if math.isinf(value):
        return "((real)INFINITY)" if value > 0.0 else "(-(real)INFINITY)"
    text = repr(float(value)) if precise else str(in_single(value))
    text += "" if "." in text or "e" in text else ".0"
    text += "" if precise else "f"
    return f"({text})" if text.startswith("-") else text


def in_single(value: float) -> np.float32:
    """The nearest f32. Raises UserError if that is infinite, or zero for a nonzero number."""
    with np.errstate(all="ignore"):
        single = np.float32(value)
    if np.isinf(single) or (single == 0.0 and value != 0.0):
        raise UserError(f"{value:g} does not fit f32; export with --precision f64, or change it")
    return single


def unbracketed(text: str) -> str:
    """An expression without its outer brackets."""
    if not text.startswith("("):
        return text
    depth = 0
    for place, sign in enumerate(text):
        depth += (sign == "(") - (sign == ")")
        if depth == 0:
            return text[1:-1] if place == len(text) - 1 else text
    return text


INDENT = "    "


class Array(NamedTuple):
    """A C array. sizes: from the outside in. entries: its numbers, in order."""

    sizes: tuple[int, ...]
    entries: tuple[object, ...]


def as_array(value: Structure) -> Array | None:
    """A vector, a matrix, a table or a plain tuple of these as an array; None for anything else."""
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
        raise TypeError("a tuple of vectors of different lengths does not fit a C array")
    return Array((len(known), *(known[0].sizes if known else ())), tuple(entry for row in known for entry in row.entries))


def fields_of(value: Structure) -> Mapping[str, Structure]:
    names: tuple[str, ...] = getattr(value, "_fields", ())
    return {name: getattr(value, name) for name in names}


def has_numbers(value: Structure) -> bool:
    """Whether a structure holds any: a struct of C cannot be empty."""
    return bool(flatten(value))


def as_structs(value: Structure) -> tuple[Structure, ...]:
    """A NamedTuple, or a tuple of alike ones, as these; none for anything else."""
    if hasattr(value, "_fields"):
        return (value,)
    return value if isinstance(value, tuple) and value and all(hasattr(one, "_fields") for one in value) else ()


def as_struct(value: Structure, name: str) -> Structure:
    """A structure with named fields; a value without any becomes the only field, with this name."""
    if hasattr(value, "_fields"):
        return value
    if isinstance(value, tuple) and not value:
        return namedtuple("Nothing", ())()
    return namedtuple("Named", (name,))(cast(Any, value))


def from_struct(value: Structure, like: Structure) -> Structure:
    """The inverse of `as_struct` for something of this shape."""
    return value if hasattr(like, "_fields") or not value else cast("tuple[Structure, ...]", value)[0]


def has_mixed_shapes(value: Structure) -> bool:
    """Whether a tuple has parts of different shapes, each of which then becomes a separate member."""
    if not isinstance(value, tuple) or hasattr(value, "_fields"):
        return False
    return len({tuple(leaf_names(one)) for one in value}) > 1


def parts_of(value: Structure) -> Mapping[str, Structure]:
    """The members of a struct: fields, and parts that are separate members, `chains_0` and so on."""
    parts: dict[str, Structure] = {}
    for name, field in fields_of(value).items():
        parts |= (
            {f"{name}_{i}": one for i, one in enumerate(cast("tuple[Structure, ...]", field))}
            if has_mixed_shapes(field)
            else {name: field}
        )
    return parts


def members(value: Structure, comment: Callable[[str], str], path: str = "", depth: int = 1) -> list[str]:
    """The members of a struct. comment: of a member, by dotted name."""
    lines = []
    for name, field in parts_of(value).items():
        if not has_numbers(field):
            continue
        place, indent = f"{path}{name}", INDENT * depth
        array, structs = as_array(field), as_structs(field)
        if structs:
            inner = members(structs[0], comment, f"{place}.", depth + 1)
            size = "" if hasattr(field, "_fields") else f"[{len(structs)}]"
            lines += [f"{indent}struct", f"{indent}{{", *inner, f"{indent}}} {name}{size};{end_comment(comment(place))}"]
            continue
        sizes = "".join(f"[{size}]" for size in array.sizes) if array else ""
        lines.append(f"{indent}real {name}{sizes};{end_comment(comment(place))}")
    return lines


def end_comment(text: str) -> str:
    """A comment at the end of a line; nothing for no text."""
    return f" /* {text} */" if text else ""


def initialiser(value: Structure, precise: bool, path: str = "", depth: int = 1) -> list[str]:
    """The numbers of a struct, member by member. Raises UserError naming a number that does not fit."""
    lines = []
    for name, field in parts_of(value).items():
        if not has_numbers(field):
            continue
        indent, array, structs = INDENT * depth, as_array(field), as_structs(field)
        if structs:
            brackets = ("{", "}") if hasattr(field, "_fields") else ("{{", "}}")
            texts = ["\n".join(initialiser(one, precise, f"{path}{name}.", depth + 1)) for one in structs]
            lines += [f"{indent}.{name} =", indent + brackets[0], f"\n{indent}}},{{\n".join(texts), f"{indent}{brackets[1]},"]
        else:
            lines.append(f"{indent}.{name} = {array_literal(f'{path}{name}', array or Array((), (field,)), precise)},")
    return lines


def array_literal(path: str, array: Array, precise: bool) -> str:
    """A number, or an array's in braces. Raises UserError naming it where one does not fit."""
    with errors_in(path):
        return braced(array, precise) if array.sizes else number(array.entries[0], precise)


def braced(array: Array, precise: bool) -> str:
    if len(array.sizes) == 1:
        return "{" + ", ".join(number(entry, precise) for entry in array.entries) + "}"
    size, inner = len(array.entries) // array.sizes[0], array.sizes[1:]
    rows = (Array(inner, array.entries[at : at + size]) for at in range(0, len(array.entries), size))
    return "{" + ", ".join(braced(row, precise) for row in rows) + "}"


def number(value: object, precise: bool) -> str:
    return unbracketed(literal(float(cast(float, value)), precise))


def structure_in_memory(record: RowRecord, value: Structure, text: str, after: tuple[int, ...] = ()) -> Structure:
    """The structure as a law finds it in memory under this name (`memory->`): long arrays stay in memory.

    after: places of the numbers that produce it there; none if it exists beforehand.
    """
    if isinstance(value, Table):
        return record.table(text, value.size)
    if isinstance(value, Matrix | Vector) and is_long(value):
        array = place_in_memory(record, text, after)
        if isinstance(value, Vector):
            return RowVector.in_memory(record, len(value), array)
        return RowMatrix.in_memory(record, (len(value), len(value.rows[0])), array)
    if isinstance(value, Vector | Matrix):
        entries = value.entries if isinstance(value, Vector) else value.rows
        made = [structure_in_memory(record, entry, f"{text}[{i}]", after) for i, entry in enumerate(entries)]
        return type(value)(cast(Any, made))  # numbers or vectors
    if isinstance(value, tuple):
        return inner(value, lambda one, at: structure_in_memory(record, one, at, after), text)
    return RecordedNumber(record, place_in_memory(record, text, after))


def is_long(value: Matrix | Vector) -> bool:
    return len(value) >= FEWEST_ROWS * (1 if isinstance(value, Matrix) else 2)


def place_in_memory(record: RowRecord, text: str, after: tuple[int, ...]) -> int:
    """The place of the number in memory under this name."""
    return record.place(LEFT, *after, text=text) if after else record.memory_place(INPUT, text=text)


def inner(value: tuple[Structure, ...], made: Callable[[Structure, str], Structure], text: str) -> Structure:
    """A tuple with a function applied to each part and its name in memory."""
    if hasattr(value, "_fields"):
        start = text if text[-1] in ">." else f"{text}."
        return value._make(made(field, start + name) for name, field in fields_of(value).items())  # type: ignore[attr-defined]
    at = "_{}" if has_mixed_shapes(value) else "[{}]"
    return tuple(made(one, text + at.format(i)) for i, one in enumerate(value))


class StructOutput(NamedTuple):
    """target: what the result is assigned to, as text. place: of the number, or of the loop that makes an array."""

    target: str
    place: int


class StoredStructures(NamedTuple):
    """The assignments that store structures in memory: numbers, and arrays by the loops that make them."""

    numbers: list[StructOutput]
    arrays: list[StructOutput]


def stored(record: RowRecord, results: Sequence[tuple[str, Structure]]) -> StoredStructures:
    """Store structures at places in memory. The inputs of every array are read before any array is stored."""
    numbers: list[StructOutput] = []
    waiting: list[tuple[str, RowMatrix | RowVector]] = []

    def walk(value: Structure, target: str) -> Structure:
        if isinstance(value, RowMatrix | RowVector):
            waiting.append((target, value))
        elif isinstance(value, Matrix) and is_long(value) and same(value):
            waiting.append((target, RowMatrix(record, (len(value), len(value.rows[0])), lambda _: value.rows[0])))
        elif isinstance(value, Vector | Matrix):
            for i, entry in enumerate(value.entries if isinstance(value, Vector) else value.rows):
                walk(entry, f"{target}[{i}]")
        elif isinstance(value, tuple):
            inner(value, walk, target)
        elif not isinstance(value, Table):
            numbers.append(StructOutput(target, record.at(cast(Number, value))))
        return ()

    for target, value in results:
        walk(value, target)
    targets = {target for target, _ in waiting}
    settled = [(target, read_first(record, array, targets - {target})) for target, array in waiting]
    kept = [(target, array) for target, array in settled if array.array is None or record.nodes[array.array].text != target]
    return StoredStructures(numbers, [StructOutput(target, row_loop(record, array)) for target, array in kept])


def read_first(record: RowRecord, array: RowMatrix | RowVector, others: set[str]) -> RowMatrix | RowVector:
    """The array; one not yet computed while others are stored, or stored where another goes, is computed now."""
    if array.array is not None and record.nodes[array.array].text not in others:
        return array
    if array.array is None and not others:
        return array
    place = row_loop(record, array)
    if isinstance(array, RowVector):
        return RowVector.in_memory(record, len(array), place)
    return RowMatrix.in_memory(record, array.shape, place)


def same(value: Matrix) -> bool:
    """Whether all entries are one constant."""
    entries = flatten(value)
    return all(isinstance(one, float | int) and one == entries[0] for one in entries)


def row_loop(record: RowRecord, value: RowMatrix | RowVector) -> int:
    """A loop that makes the rows of an array."""
    index = record.index()
    row = value.row(index) if isinstance(value, RowMatrix) else [value.entry(index)]
    return record.loop(LoopBody(len(value), index, tuple(map(record.at, row))))

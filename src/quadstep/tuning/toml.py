"""A TOML file with a few values changed and all else left as it is: its comments, its order, its blanks.

A value is replaced where it stands, or where the table it is in is written in one line; a new key goes below its table's last.
Where that does not give the content that is wanted, the file is written anew.
"""

import json
import re
import tomllib
from collections.abc import Iterator
from typing import Any, NamedTuple

PART = r"""(?:[A-Za-z0-9_-]+|"(?:[^"\\]|\\.)*"|'[^']*')"""
KEY = re.compile(rf"[ \t]*({PART}(?:[ \t]*\.[ \t]*{PART})*)[ \t]*=[ \t]*")
HEADER = re.compile(rf"[ \t]*\[[ \t]*({PART}(?:[ \t]*\.[ \t]*{PART})*)[ \t]*\]")
LIST_HEADER = re.compile(r"[ \t]*\[\[")
BARE = re.compile(r"[A-Za-z0-9_-]+")
QUOTES = ('"""', "'''", '"', "'")

Path = tuple[str, ...]


class Value(NamedTuple):
    """Where the value of a key stands in the text."""

    path: Path
    start: int
    end: int


class Place(NamedTuple):
    """A table's header, or the file's beginning, and where the line after its last key starts."""

    path: Path
    end: int


def edited(text: str, old: dict[str, Any], new: dict[str, Any]) -> str:
    """The text of `old` made that of `new`."""
    changed = text
    for path, value in changes(old, new):
        changed = with_value(changed, path, value, new)
    try:
        good = tomllib.loads(changed) == new
    except tomllib.TOMLDecodeError:
        good = False
    return changed if good else document(new)


def changes(old: dict[str, Any], new: dict[str, Any], path: Path = ()) -> Iterator[tuple[Path, Any]]:
    """Every value that is not as it was."""
    for name, value in new.items():
        before = old.get(name)
        if isinstance(value, dict) and (isinstance(before, dict) or before is None):
            yield from changes(before or {}, value, (*path, name))
        elif name not in old or value != before:
            yield (*path, name), value


def with_value(text: str, path: Path, value: Any, new: dict[str, Any]) -> str:
    """The text with one more value in place."""
    values, places = scanned(text)
    holders = [one for one in values if path[: len(one.path)] == one.path]
    if holders:
        _, start, end = max(holders, key=lambda one: len(one.path))
        whole: Any = new
        for name in max(holders, key=lambda one: len(one.path)).path:
            whole = whole[name]
        return text[:start] + written(whole) + text[end:]
    tables = [one for one in places if one.path and path[: len(one.path)] == one.path and len(one.path) < len(path)]
    if tables:
        table = max(tables, key=lambda one: len(one.path))
        before = text[: table.end]
        newline = "" if before.endswith("\n") else "\n"
        return f"{before}{newline}{key(path[len(table.path) :])} = {written(value)}\n{text[table.end :]}"
    newline = "" if text.endswith("\n") or not text else "\n"
    return f"{text}{newline}\n[{key(path[:-1])}]\n{key(path[-1:])} = {written(value)}\n"


def scanned(text: str) -> tuple[list[Value], list[Place]]:
    """Every value and every table of the text; those in lists of tables are left out."""
    values: list[Value] = []
    places = [Place((), 0)]
    table: Path | None = ()
    position = 0
    while position < len(text):
        line_end = end_of_line(text, position)
        header, found = HEADER.match(text, position), KEY.match(text, position)
        if LIST_HEADER.match(text, position):
            table = None
        elif header:
            table = path_of(header.group(1))
            places.append(Place(table, line_end))
        elif found:
            end = end_of_value(text, found.end())
            line_end = end_of_line(text, end)
            if table is not None:
                values.append(Value((*table, *path_of(found.group(1))), found.end(), end))
                places[-1] = Place(table, line_end)
        position = line_end
    return values, places


def end_of_line(text: str, position: int) -> int:
    """Where the next line starts."""
    found = text.find("\n", position)
    return len(text) if found < 0 else found + 1


def end_of_value(text: str, start: int) -> int:
    """Where the value that starts here ends."""
    depth, position, end = 0, start, start
    while position < len(text):
        char = text[position]
        quote = next((one for one in QUOTES if text.startswith(one, position)), None)
        if quote:
            position = end = end_of_string(text, position, quote)
            continue
        if char == "#":
            position = end_of_line(text, position) - 1 if depth else len(text)
            continue
        if char == "\n" and depth == 0:
            break
        depth += (char in "[{") - (char in "]}")
        position += 1
        end = end if char.isspace() else position
    return end


def end_of_string(text: str, start: int, quote: str) -> int:
    """Behind the closing quote."""
    position = start + len(quote)
    while position < len(text) and not text.startswith(quote, position):
        position += 2 if text[position] == "\\" and quote[0] == '"' else 1
    position += len(quote)
    while len(quote) == 3 and text.startswith(quote[0], position):  # one or two quotes right before the closing ones
        position += 1
    return position


def path_of(dotted: str) -> Path:
    """The names in a dotted key."""
    inside: Any = tomllib.loads(f"{dotted} = 0")
    names: list[str] = []
    while isinstance(inside, dict):
        name = next(iter(inside))
        names.append(name)
        inside = inside[name]
    return tuple(names)


def key(path: Path) -> str:
    """Names as a dotted key."""
    return ".".join(name if BARE.fullmatch(name) else quoted(name) for name in path)


def quoted(text: str) -> str:
    """A string; what JSON says is TOML but for one character."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def written(value: Any) -> str:
    """A value in one line."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return quoted(value)
    if isinstance(value, dict):
        inside = ", ".join(f"{key((name,))} = {written(one)}" for name, one in value.items())
        return f"{{ {inside} }}" if inside else "{}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(written, value))}]"
    return repr(value) if isinstance(value, int | float) else str(value)


def document(content: dict[str, Any], path: Path = ()) -> str:
    """A whole file."""
    lines = [f"{key((name,))} = {written(value)}" for name, value in content.items() if not isinstance(value, dict)]
    text = "\n".join(lines) + "\n" if lines else ""
    for name, value in content.items():
        if isinstance(value, dict):
            below = (*path, name)
            text += f"\n[{key(below)}]\n{document(value, below)}"
    return text.lstrip("\n") if not path else text

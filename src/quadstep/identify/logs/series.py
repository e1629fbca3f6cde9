"""Columns of logs with many topics: each has its own samples and is named topic.field.

ULog and ArduPilot's .BIN pack messages one after the other, and declare their layout. Such a log is walked once. Where a
header is not one, the walk goes on at the next message that is wanted, and the place counts as damaged: time grows with the
size of the file, whatever is in it.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from quadstep.identify.logs.flight import Floats
from quadstep.io import files
from quadstep.io.errors import UserError, cut, shorten
from quadstep.io.grouping import by_first

MOST_ROWS = 500_000
FEWEST_ROWS = 20


def header_of(path: Path) -> list[str]:
    """The names of a CSV file's columns. Raises UserError."""
    with files.rows(path, files.LOG, "log") as table:
        return first_of(path, table)


def first_of(path: Path, table: Iterator[tuple[int, list[str]]]) -> list[str]:
    """The first row of a table. Raises UserError where it names no columns."""
    header = [name.strip() for name in next(table, (0, []))[1]]
    if not any(name.strip("\0") for name in header):
        raise UserError(f"{path}: is empty; the first line of a log names its columns")
    return header


def read_columns(path: Path, columns: list[str]) -> dict[str, Floats]:
    """Columns of a CSV file by name, one number per row; NaN where a field is empty or nan.

    Raises UserError for a missing column, a field that is not a number, truncated rows, too few rows or too many.
    """
    with files.rows(path, files.LOG, "log") as table:
        return collected(path, table, columns)


def collected(path: Path, table: Iterator[tuple[int, list[str]]], columns: list[str]) -> dict[str, Floats]:
    """`read_columns` for rows, each with its line number."""
    header = first_of(path, table)
    for name in columns:
        if name not in header:
            have = ", ".join(cut(one, 30) for one in header[:8]) + (", ..." if len(header) > 8 else "")
            raise UserError(f"{path}: column {shorten(name)} is missing; the file has: {have}")
        if header.count(name) > 1:
            raise UserError(f"{path}: column {shorten(name)} appears more than once in the header")
    places = [header.index(name) for name in columns]
    last = max(places)
    found: list[list[float]] = []
    for line, row in table:
        if len(found) == MOST_ROWS:
            raise UserError(f"{path}: more than {MOST_ROWS} rows, the most that a log may have")
        if len(row) <= last:
            raise UserError(f"{path}: line {line}: {len(row)} fields, the header has {len(header)}; the file is cut short")
        try:
            found.append([float(row[place] or "nan") for place in places])
        except ValueError:
            raise wrong_field(path, line, row, places, header) from None
    if len(found) < FEWEST_ROWS:
        raise UserError(f"{path}: {len(found)} rows of data; a log needs at least {FEWEST_ROWS}")
    array = np.array(found)
    if np.isinf(array).any():
        row_number, place = np.argwhere(np.isinf(array))[0]
        raise UserError(f"{path}: row {row_number + 1}, column {shorten(columns[place])}: infinite")
    return dict(zip(columns, array.T, strict=True))


def wrong_field(path: Path, line: int, row: list[str], places: list[int], header: list[str]) -> UserError:
    for place in places:
        text = row[place].strip()
        try:
            float(text or math.nan)
        except ValueError:
            return UserError(f"{path}: line {line}, column {shorten(header[place])}: {shorten(text)} is not a number")
    raise ValueError(row)


MOST_SAMPLES = 20_000_000
"""Most numbers taken from a log, in all."""


class Series(NamedTuple):
    """Samples of a column: time [s] and value, both (n,)."""

    time: Floats
    value: Floats


Columns = dict[str, Series]


class Topics(NamedTuple):
    """What is read of a log. damaged: how many stretches of it are not what its format says, and were skipped. parameters: of
    the autopilot, by name, as last logged; empty where the format has none. changed: those that were something else before.
    """

    columns: Columns
    damaged: int
    parameters: Mapping[str, float] = {}
    changed: tuple[str, ...] = ()

    @classmethod
    def with_history(cls, columns: Columns, damaged: int, parameters: Mapping[str, Sequence[float]]) -> "Topics":
        """Of a log with all that parameters were, by name, in order."""
        changed = tuple(name for name, values in parameters.items() if len(set(values)) > 1)
        return cls(columns, damaged, {name: values[-1] for name, values in parameters.items()}, changed)


def by_topic(names: Iterable[str]) -> dict[str, list[str]]:
    """Fields by topic; the topic's name ends at the first dot."""
    parts = (name.partition(".") for name in names)
    return by_first((topic, field) for topic, _, field in parts if field)


def refuse_many(path: Path, rows: Mapping[str, int], fields: Mapping[str, list[str]]) -> None:
    """Raises UserError where so many rows of each topic are more numbers than a log may have."""
    if sum(count * (1 + len(fields[topic])) for topic, count in rows.items()) > MOST_SAMPLES:
        raise UserError(f"{path}: more than {MOST_SAMPLES} numbers; cut the log")


LARGEST = 65535
"""Bytes of a message."""


class PackedMessages(NamedTuple):
    """Messages of one topic. content: their bytes, one message after the other."""

    layout: np.dtype[np.void]
    content: bytearray


def layout_of(fields: Sequence[tuple[str, str | np.dtype[np.void], int]]) -> np.dtype[np.void]:
    """The layout of name, type and count of each field, without gaps. Raises ValueError for one that no message can have."""
    if not fields or any(count > LARGEST for _, _, count in fields):
        raise ValueError("no message layout")
    found = np.dtype([(name, kind, (count,)) if count else (name, kind) for name, kind, count in fields])
    if found.itemsize > LARGEST:
        raise ValueError("no message layout")
    return found


def unpacked(rows: NDArray[np.void], field: str) -> Floats | None:
    """The numbers of a field: Roll, q[0] or esc[1].rpm; None where there is no such field."""
    found = rows
    for part in field.split("."):
        name, _, place = part.partition("[")
        index = place.removesuffix("]")
        if found.dtype.names is None or name not in found.dtype.names:
            return None
        found = cast(NDArray[np.void], found[name])
        if place:
            if found.ndim < 2 or not index.isdecimal() or int(index) >= found.shape[-1]:
                return None
            found = found[..., int(index)]
    if found.ndim != 1 or found.dtype.kind not in "iufb":
        return None
    with np.errstate(invalid="ignore"):  # a signalling NaN is a NaN
        numbers: Floats = found.astype(np.float64)
    return numbers


def rows_of(packed: PackedMessages) -> NDArray[np.void]:
    return np.frombuffer(packed.content, packed.layout)


def refuse_backward(path: Path, columns: Columns, names: Iterable[str]) -> None:
    """Raises UserError for a column whose time goes backward."""
    for name in names:
        if (np.diff(columns[name].time) < 0.0).any():
            raise UserError(f"{path}: {name}: time goes backward; the log is damaged, or its clock was set back")


def columns_of(path: Path, rows: Mapping[str, tuple[Floats, NDArray[np.void]]], fields: Mapping[str, list[str]]) -> Columns:
    """Columns of the fields of each topic, from its times [s] and its messages. Raises UserError for too many numbers."""
    refuse_many(path, {topic: len(time) for topic, (time, _) in rows.items()}, fields)
    found: Columns = {}
    for topic, (time, messages) in rows.items():
        for field in fields[topic]:
            values = unpacked(messages, field)
            if values is not None and len(time):
                found[f"{topic}.{field}"] = Series(time, values)
    return found

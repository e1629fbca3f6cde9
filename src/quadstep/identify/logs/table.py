"""Logs as tables: CSV files by a mapping."""

import csv
import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from quadstep.identify.logs.flight import Floats
from quadstep.io import files
from quadstep.io.errors import UserError, cut, shorten

MOST_ROWS = 500_000
FEWEST_ROWS = 20


def header_of(path: Path) -> list[str]:
    """The names of a CSV file's columns. Raises UserError."""
    with files.table(path, files.LOG) as lines:
        try:
            header = [name.strip() for name in next(csv.reader(lines), [])]
        except (OSError, ValueError, csv.Error):
            raise unreadable(path) from None
    check_header(path, header)
    return header


def check_header(path: Path, header: list[str]) -> None:
    """Refuses a table without names of columns. Raises UserError."""
    if not any(name.strip("\0") for name in header):
        raise UserError(f"{path}: is empty; the first line of a log names its columns")


def unreadable(path: Path) -> UserError:
    return UserError(f"{path}: cannot be read as a log: not a text file of comma-separated values")


def read_columns(path: Path, wanted: list[str]) -> dict[str, Floats]:
    """Columns of a CSV file by name, one number per row; NaN where a field is empty or nan.

    Raises UserError for a missing column, a field that is not a number, truncated rows, too few rows or too many.
    """
    with files.table(path, files.LOG) as lines:
        table = csv.reader(lines)
        try:
            return collected(path, ((table.line_num, row) for row in table if row), wanted)
        except (OSError, ValueError, csv.Error):
            raise unreadable(path) from None


def collected(path: Path, table: Iterator[tuple[int, list[str]]], wanted: list[str]) -> dict[str, Floats]:
    """`read_columns` for rows, each with its line number."""
    header = [name.strip() for name in next(table, (0, []))[1]]
    check_header(path, header)
    for name in wanted:
        if name not in header:
            have = ", ".join(cut(one, 30) for one in header[:8]) + (", ..." if len(header) > 8 else "")
            raise UserError(f"{path}: column {shorten(name)} is missing; the file has: {have}")
        if header.count(name) > 1:
            raise UserError(f"{path}: column {shorten(name)} appears more than once in the header")
    places = [header.index(name) for name in wanted]
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
        raise UserError(f"{path}: row {row_number + 1}, column {shorten(wanted[place])}: infinite")
    return dict(zip(wanted, array.T, strict=True))


def wrong_field(path: Path, line: int, row: list[str], places: list[int], header: list[str]) -> UserError:
    for place in places:
        text = row[place].strip()
        try:
            float(text or math.nan)
        except ValueError:
            return UserError(f"{path}: line {line}, column {shorten(header[place])}: {shorten(text)} is not a number")
    return unreadable(path)

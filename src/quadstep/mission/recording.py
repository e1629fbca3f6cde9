"""Reading a recorded path: a CSV of t, x, y, z and perhaps psi, with the flaws that real logs have named one by one."""

import csv
import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from quadstep.io import files
from quadstep.io.errors import UserError, cut, shorten
from quadstep.mission.fields import MOST

ANGLE_UNITS = {"rad": 1.0, "deg": math.pi / 180.0}

FEWEST_ROWS = 4
MOST_ROWS = 200_000
"""Of data; the path is fitted to them one by one."""

SHORTEST = 1e-6
"""Least time between two rows [s]."""


def read_recording(
    path: Path, columns: dict[str, str | None], angle_unit: float, shortest: float = 0.0
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Times from zero (n,) [s] and points (n, 4) [m, m, m, rad], yaw unwrapped (zero where there is no such column).

    columns: header name for each of t, x, y, z, psi. A unit in brackets after a header name is ignored. psi is read where
    its column is named, or where one called psi is there. shortest: how long a recording must be at least [s].

    Raises UserError for a missing file or column, a field that is no finite number, times that repeat or go backward, a
    recording that is too short, fewer than four rows and too many.
    """
    with files.table(path, files.RECORDING) as lines:
        table = csv.reader(lines)
        try:
            return read_table(path, ((table.line_num, row) for row in table if row), columns, angle_unit, shortest)
        except (OSError, ValueError, csv.Error):
            raise UserError(f"{path}: cannot be read as a path: not a text file of comma-separated values") from None


def read_table(
    path: Path, table: Iterator[tuple[int, list[str]]], columns: dict[str, str | None], angle_unit: float, shortest: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """`read_recording` of the rows of a file, each with the number of its line."""
    header = [name.partition("[")[0].strip() for name in next(table, (0, []))[1]]
    named = {key: name.partition("[")[0].strip() for key, name in columns.items() if name is not None}
    if columns["psi"] is None and "psi" in header:
        named["psi"] = "psi"
    twice = [name for name in named.values() if header.count(name) > 1]
    if twice:
        raise UserError(f"{path}: column {shorten(twice[0])} appears more than once in the header")
    missing = [name for name in named.values() if name not in header]
    if missing:
        have = ", ".join(cut(name, 30) for name in header[:12]) + (", ..." if len(header) > 12 else "")
        raise UserError(f"{path}: column {shorten(missing[0])} is missing; the file has: {have or 'nothing'}")
    places = [header.index(name) for name in named.values()]
    numbered: list[int] = []
    found: list[list[float]] = []
    for line, row in table:
        if len(found) == MOST_ROWS:
            raise UserError(f"{path}: more than {MOST_ROWS} rows of data, the most that a path may have; leave some out")
        numbered.append(line)
        found.append([number(path, line, row, place, header) for place in places])
    if len(found) < FEWEST_ROWS:
        raise UserError(f"{path}: {len(found)} rows of data; a path needs at least {FEWEST_ROWS}")
    data = dict(zip(named, np.array(found).T, strict=True))
    times = data["t"]
    stuck = np.flatnonzero(np.diff(times) < SHORTEST)
    if len(stuck):
        line = numbered[int(stuck[0]) + 1]
        before, after = times[stuck[0]], times[stuck[0] + 1]
        how = "repeats" if after == before else "goes backward" if after < before else "hardly moves"
        raise UserError(
            f"{path}: line {line}: time {how} ({before:.9g} s, then {after:.9g} s); steps must be at least {SHORTEST:g} s"
        )
    span = times[-1] - times[0]
    if span < shortest:
        raise UserError(
            f"{path}: line {numbered[-1]}: the recording ends after {span:g} s; with this smoothing it must last at least "
            f"{shortest:g} s"
        )
    yaw = unwrapped(data["psi"] * angle_unit) if "psi" in data else np.zeros(len(times))
    return times - times[0], np.column_stack([data["x"], data["y"], data["z"], yaw])


def unwrapped(angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Angles [rad] without jumps of more than half a turn, as whole turns are added."""
    turns = -np.cumsum(np.rint(np.diff(angles, prepend=angles[0]) / (2.0 * math.pi)))
    result: NDArray[np.float64] = angles + (2.0 * math.pi) * turns
    return result


def number(path: Path, line: int, row: list[str], place: int, header: list[str]) -> float:
    """The finite number in one field. Raises UserError."""
    text = row[place].strip() if place < len(row) else ""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if math.isfinite(value) and abs(value) <= MOST and "_" not in text:
        return value
    wrong = f"{shorten(text or 'nothing')} is not a finite number"
    if MOST < abs(value) < math.inf:
        wrong = f"{cut(text, 30)} is beyond {MOST:g}"
    raise UserError(f"{path}: line {line}, column {shorten(header[place])}: {wrong}")

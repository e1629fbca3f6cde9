"""Reading a recorded path: a CSV of t, x, y, z and perhaps psi, with the flaws that real logs have named one by one."""

import csv
import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from quadstep.errors import UserError
from quadstep.mission.fields import MOST

ANGLE_UNITS = {"rad": 1.0, "deg": math.pi / 180.0}

FEWEST_ROWS = 4
SHORTEST = 1e-6
"""Least time between two rows [s]."""


def read_recording(
    path: Path, columns: dict[str, str | None], angle_unit: float, shortest: float = 0.0
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Times from zero (n,) [s] and points (n, 4) [m, m, m, rad], yaw unwrapped (zero where there is no such column).

    columns: header name for each of t, x, y, z, psi. A unit in brackets after a header name is ignored. psi is read where
    its column is named, or where one called psi is there. shortest: how long a recording must be at least [s].

    Raises UserError for a missing file or column, a field that is no finite number, times that repeat or go backward, a
    recording that is too short, and fewer than four rows.
    """
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            reader = csv.reader(file)
            numbered = [(reader.line_num, row) for row in reader if row]
    except (OSError, ValueError, csv.Error) as error:
        reason = (
            error.strerror if isinstance(error, OSError) and error.strerror else "not a text file of comma-separated values"
        )
        raise UserError(f"{path}: cannot be read as a path: {reason}") from None
    table = [row for _, row in numbered]
    header = [name.partition("[")[0].strip() for name in table[0]] if table else []
    named = {key: name.partition("[")[0].strip() for key, name in columns.items() if name is not None}
    if columns["psi"] is None and "psi" in header:
        named["psi"] = "psi"
    twice = [name for name in named.values() if header.count(name) > 1]
    if twice:
        raise UserError(f"{path}: column {twice[0]!r} stands more than once in the header")
    missing = [name for name in named.values() if name not in header]
    if missing:
        have = ", ".join(header[:12]) + (", ..." if len(header) > 12 else "")
        raise UserError(f"{path}: column {missing[0]!r} is missing; the file has: {have or 'nothing'}")
    if len(table) - 1 < FEWEST_ROWS:
        raise UserError(f"{path}: {len(table) - 1} rows of data; a path needs at least {FEWEST_ROWS}")
    places = {key: header.index(name) for key, name in named.items()}
    data = {key: np.array([number(path, line, row, place, header) for line, row in numbered[1:]])
            for key, place in places.items()}  # fmt: skip
    times = data["t"]
    stuck = np.flatnonzero(np.diff(times) < SHORTEST)
    if len(stuck):
        line = numbered[int(stuck[0]) + 2][0]
        before, after = times[stuck[0]], times[stuck[0] + 1]
        how = "repeats" if after == before else "goes backward" if after < before else "hardly moves"
        raise UserError(
            f"{path}: line {line}: time {how} ({before:.9g} s, then {after:.9g} s); times must rise by {SHORTEST:g} s or more"
        )
    span = times[-1] - times[0]
    if span < shortest:
        raise UserError(
            f"{path}: line {numbered[-1][0]}: the recording ends after {span:g} s; with this smoothing it must last at least "
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
    """The finite number in one field."""
    text = row[place].strip() if place < len(row) else ""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value) or "_" in text:
        raise UserError(f"{path}: line {line}, column {header[place]!r}: {text or 'nothing'!r} is not a finite number")
    if abs(value) > MOST:
        raise UserError(f"{path}: line {line}, column {header[place]!r}: {text} is beyond {MOST:g}")
    return value

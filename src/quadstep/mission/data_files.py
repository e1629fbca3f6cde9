"""Files that a mission names: a recorded path, a CSV of t, x, y, z and perhaps psi, with the flaws that real logs have named
one by one; an autopilot's parameters, as part of the table [controller].
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from operator import attrgetter
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadstep.interfaces.controller import Controller
from quadstep.io import files
from quadstep.io.errors import UserError, cut, did_you_mean, number_in, shorten
from quadstep.io.parameter_files import AutopilotParameters, read_parameters
from quadstep.mission.fields import MOST
from quadstep.report.units import listed

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
    with files.rows(path, files.RECORDING, "path") as table:
        return read_table(path, table, columns, angle_unit, shortest)


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
    return angles + (2.0 * math.pi) * turns


def number(path: Path, line: int, row: list[str], place: int, header: list[str]) -> float:
    """The finite number in one field. Raises UserError."""
    text = row[place].strip() if place < len(row) else ""
    value = number_in(text)
    if math.isfinite(value) and abs(value) <= MOST and "_" not in text:
        return value
    wrong = f"{shorten(text or 'nothing')} is not a finite number"
    if MOST < abs(value) < math.inf:
        wrong = f"{cut(text, 30)} is beyond {MOST:g}"
    raise UserError(f"{path}: line {line}, column {shorten(header[place])}: {wrong}")


KEY = "parameters"
"""Names the file. It goes when the mission is read: what the file says is then in the mission."""

FEW = 5
"""Of many names, those that a line has."""


class CompletedTable(NamedTuple):
    """table: with what the file says where the table itself says nothing. notes: what is to be said of the rest. left: the
    parameters that the law does without.
    """

    table: dict[str, object]
    notes: tuple[str, ...] = ()
    left: tuple[str, ...] = ()


def completed(law: type[Controller], table: Mapping[str, object], folder: Path) -> CompletedTable:
    """The table of a law. folder: where the file is looked up. Raises ValueError for a file that cannot be used."""
    name = table.get(KEY)
    if not law.parameter_file or not isinstance(name, str):
        return CompletedTable(dict(table))
    try:
        found = read_parameters(folder / name, law.parameter_file)
    except UserError as error:
        raise ValueError(f"{KEY}: {error}") from None
    refuse_unknown(law, found, name)
    merged = {key: one for key, one in table.items() if key != KEY}
    known = {key: value for key, value in found.values.items() if key in law.by_key()}
    if found.whole and not known:
        raise ValueError(
            f"{KEY}: {name}: has none of {law.source}'s parameters that {law.name} uses, such as {next(iter(law.by_key()))}; "
            "save those of a multirotor"
        )
    groups = {group(key) for key in law.by_key()}
    left = found.values.keys() - law.by_key().keys() - law.supported.keys()
    near_first = tuple(sorted(left, key=lambda one: (group(one) not in groups, one)))
    return CompletedTable(under(merged, known), tuple(notes(law, found, name, near_first)), near_first)


def refuse_unknown(law: type[Controller], parameters: AutopilotParameters, name: str) -> None:
    """Raises ValueError for a parameter in one of the law's groups that the firmware does not have, or has under another name,
    and for a value with which the law does not fly.
    """
    keys = law.by_key()
    groups = {group(key) for key in keys if "." in key}
    for one, value in parameters.values.items():
        if one not in keys and one not in law.unmodelled and group(one) in groups:
            raise ValueError(f"{KEY}: {name}: {one} is not a parameter of {law.source}{did_you_mean(one, list(keys))}")
        if one in law.renamed:
            raise ValueError(f"{KEY}: {name}: {one} is from another release; {law.source} calls it {law.renamed[one]}")
        if value not in law.supported.get(one, (value,)):
            flown = listed([f"{number:g}" for number in law.supported[one]], "or")
            raise ValueError(f"{KEY}: {name}: {one} is {value:g}, and {law.name} flies only {flown}")


def group(name: str) -> str:
    """Of a parameter: what stands before its last dot, or up to the first underscore."""
    return name.rpartition(".")[0] if "." in name else name.partition("_")[0]


def notes(law: type[Controller], parameters: AutopilotParameters, name: str, left: tuple[str, ...]) -> list[str]:
    """Of another release, of what the law does without, and of defaults that are not its own."""
    keys, said = law.by_key(), []
    if parameters.version and parameters.version not in law.source:
        said.append(f"{name}: is from version {parameters.version}; {law.name} is {law.source}'s")
    if left:
        many = f"{len(left)} of {len(parameters.values)} parameters: " if len(left) > FEW else ""
        said.append(f"{name}: {law.name} does not use {many}{briefly(left)}")
    if other := sorted(
        key for key, one in parameters.defaults.items() if key in keys and keys[key][1].fixed not in (None, one)
    ):
        said.append(
            f"{name}: is from another firmware or vehicle than {law.source}: it has other defaults for {briefly(other)}"
        )
    return said


def briefly(names: Sequence[str]) -> str:
    """Names, of many the first."""
    return ", ".join(names) if len(names) <= FEW else f"{', '.join(names[:FEW])} and {len(names) - FEW} more"


def check_order(law: type[Controller], section: object) -> None:
    """Raises ValueError for two parameters of which the autopilot can keep only one."""
    for text in law.ordered:
        lower, relation, upper = text.split()
        least, most = (attrgetter(key)(section) for key in (lower, upper))
        if least and most and not (least < most or (relation == "<=" and least == most)):
            raise ValueError(f"{lower} = {least:g} and {upper} = {most:g} contradict each other: {law.source} needs {text}")


def out_of_range_note(law: type[Controller], section: object) -> Iterator[str]:
    """What is said of parameters beyond the ranges that the autopilot documents, but takes all the same."""
    for key, (_, gain) in law.by_key().items():
        value = attrgetter(key)(section)
        low, high = (one if one is not None else value for one in (gain.low, gain.high))
        if value is not None and not low <= value <= high:
            ends = f"from {low:g} to {high:g}" if None not in (gain.low, gain.high) else f"up to {high:g}"
            yield f"controller.{key} = {value:g} is outside the range documented by {law.source}, {ends}"


def under(table: dict[str, object], values: Mapping[str, float]) -> dict[str, object]:
    """A table with these values, by dotted key, where it has none."""
    merged = dict(table)
    for key, value in values.items():
        group, _, inner = key.rpartition(".")
        inside = merged.get(group, {}) if group else merged
        if isinstance(inside, Mapping) and inner not in inside:
            merged = {**merged, group: {**inside, inner: value}} if group else {**merged, inner: value}
    return merged

"""Reading logs of every kind into `FlightRecord`s."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from quadstep.identify.logs.flight import FlightRecord, Floats
from quadstep.identify.logs.grid import LogRows, gridded
from quadstep.identify.logs.mapping import Mapping, commanded, converted, fitting, load_mapping, mapping_names, read_mapping
from quadstep.identify.logs.table import header_of, read_columns
from quadstep.identify.logs.topics import READERS, of_topics, read_topics, refuse_empty
from quadstep.io.errors import UserError

USUAL = {".ulg": ("px4", "px4-outputs"), ".ulog": ("px4", "px4-outputs"), ".bin": ("ardupilot",), ".mcap": ()}
"""The package's mappings for logs of many topics, in the order in which they are tried, by file extension."""


def read_log(path: Path, mapping: str | None = None) -> FlightRecord:
    """Read a log file. mapping: name or file of a mapping; not needed for a table whose columns fit one of the package's.

    Raises UserError for a file that is not a log, fits no mapping, or is broken.
    """
    kind = path.suffix.lower()
    if of_topics(path):
        return read_many(path, [read_mapping(mapping)] if mapping else [load_mapping(name) for name in USUAL.get(kind, ())])
    if kind != ".csv":
        raise UserError(f"{path}: unsupported log format; allowed: .csv, {', '.join(f'.{one}' for one in READERS.names)}")
    return read_table(path, read_mapping(mapping) if mapping else found_mapping(path))


def read_many(path: Path, mappings: list[Mapping]) -> FlightRecord:
    """A log of many topics, by the first mapping whose motor columns it has. Raises UserError."""
    if not mappings:
        refuse_empty(path)
        raise UserError(f"{path}: topics have no fixed names; give --mapping FILE that assigns the columns (docs/logs.md)")
    columns, damaged = read_topics(path, list(dict.fromkeys(name for mapping in mappings for name in mapping.names())))
    chosen = next((one for one in mappings if all(name in columns for name in one.motors.columns)), mappings[0])
    return recorded(path, chosen, gridded(path, columns, chosen), damaged)


def found_mapping(path: Path) -> Mapping:
    """The mapping of the package that fits a table. Raises UserError."""
    name = fitting(header_of(path))
    if name is None:
        raise UserError(
            f"{path}: its columns match none of the mappings {', '.join(mapping_names())}; name with --mapping a file that "
            "says what each column holds (docs/logs.md)"
        )
    return load_mapping(name)


def read_table(path: Path, mapping: Mapping) -> FlightRecord:
    """A CSV file by a mapping. Raises UserError."""
    columns = read_columns(path, mapping.names())
    time = columns[mapping.time.column] * {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}[mapping.time.unit]
    period = check_time(path, time, mapping.time.column)
    logged = np.stack([columns[name] for name in mapping.motors.columns], axis=1)
    check_motors(path, logged, mapping)
    channels = {
        name: converted(mapping, name, np.stack([columns[one] for one in channel.columns], axis=1))
        for name, channel in mapping.columns.items()
    }
    return recorded(path, mapping, LogRows(time, period, logged, channels))


def recorded(path: Path, mapping: Mapping, rows: LogRows, damaged: int = 0) -> FlightRecord:
    """The flight of some rows, whose motors' commands are still as logged. damaged: as in `FlightRecord`."""
    channels = {name: values for name, values in rows.channels.items() if np.isfinite(values).any()}
    if mapping.columns.get("velocity") and mapping.columns["velocity"].axes == "body" and "attitude" in channels:
        channels["velocity"] = turned(channels["attitude"], channels["velocity"])
    motors, lost = commanded(mapping, rows.motors)
    speeds = mapping.motors.unit != "share"
    return completed(FlightRecord(path.stem, rows.time, rows.period, motors, speeds, channels, (), lost, damaged))


def check_time(path: Path, time: Floats, column: str) -> float:
    """The period of a log [s]. Raises UserError for times that are missing or go backward."""
    missing = np.flatnonzero(~np.isfinite(time))
    if len(missing):
        raise UserError(f"{path}: row {missing[0] + 1}, column {column}: the time is missing")
    steps = np.diff(time)
    back = np.flatnonzero(steps < 0.0)
    if len(back):
        place = int(back[0])
        step = f"{time[place]:.6f} s, then {time[place + 1]:.6f} s"
        raise UserError(f"{path}: row {place + 2}: time goes backward ({step}); a log must be in order")
    period = float(np.median(steps))
    if not period > 0.0:
        raise UserError(f"{path}: column {column}: most rows repeat the time of the row before")
    if not 1e-4 <= period <= 0.1:
        raise UserError(
            f"{path}: column {column}: {period:g} s from row to row; a log needs 0.0001 to 0.1 s (is the unit correct?)"
        )
    return period


def check_motors(path: Path, logged: Floats, mapping: Mapping) -> None:
    """Refuses missing or negative commands. Raises UserError."""
    for place, name in enumerate(mapping.motors.columns):
        bad = np.flatnonzero(~np.isfinite(logged[:, place]))
        if len(bad):
            raise UserError(f"{path}: row {bad[0] + 1}, column {name}: the motor's command is missing (NaN)")
        if (logged[:, place] < mapping.motors.zero - 1e-9).any():
            raise UserError(f"{path}: column {name}: commands below {mapping.motors.zero:g}; is it the correct column?")


def completed(record: FlightRecord) -> FlightRecord:
    """The record with velocity and rates added, from positions and attitudes, if they were not logged."""
    channels, derived = dict(record.channels), list(record.derived)
    if "position" in channels and "velocity" not in channels:
        channels["velocity"] = np.gradient(channels["position"], record.time, axis=0)
        derived.append("velocity")
    if "attitude" in channels and "rates" not in channels:
        channels["rates"] = rates_of(channels["attitude"], record.time)
        derived.append("rates")
    return replace(record, channels=channels, derived=tuple(derived))


def rates_of(attitude: Floats, time: Floats) -> Floats:
    """Body rates [rad/s] from quaternions (n, 4) by central differences: 2 q* dq/dt."""
    signs = np.cumprod(np.where(np.sum(attitude[1:] * attitude[:-1], axis=1) < 0.0, -1.0, 1.0))
    q = attitude * np.concatenate([[1.0], signs])[:, None]
    d = np.gradient(q, time, axis=0)
    w, x, y, z = q.T
    a, b, c, e = d.T
    return 2.0 * np.stack(
        [w * b - x * a - y * e + z * c, w * c + x * e - y * a - z * b, w * e - x * c + y * b - z * a], axis=1
    )


def turned(attitude: Floats, body: Floats) -> Floats:
    """Body vectors in world axes, (n, 3)."""
    w, v = attitude[:, :1], attitude[:, 1:]
    t = 2.0 * np.cross(v, body)
    result: Floats = body + w * t + np.cross(v, t)
    return result

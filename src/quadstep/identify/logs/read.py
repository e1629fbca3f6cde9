"""Reading logs of every kind into `FlightRecord`s."""

from dataclasses import replace
from pathlib import Path
from typing import NamedTuple, cast

import numpy as np

from quadstep.control.mixers import command_of_thrust
from quadstep.identify.logs.flight import Flags, FlightRecord, Floats
from quadstep.identify.logs.mapping import (
    Mapping,
    commanded,
    converted,
    fitting,
    load_mapping,
    mapping_names,
    product,
    read_mapping,
)
from quadstep.identify.logs.series import FEWEST_ROWS, Columns, Series, Topics, header_of, read_columns, refuse_backward
from quadstep.io import files
from quadstep.io.doors import Door, needed_by
from quadstep.io.errors import UserError

READERS = Door("quadstep.log_readers", {
    "ulg": "quadstep.identify.logs.ulog:read",
    "ulog": "quadstep.identify.logs.ulog:read",
    "bin": "quadstep.identify.logs.ardupilot:read",
    "mcap": "quadstep.identify.logs.mcap_file:read",
    "bbl": "quadstep.identify.logs.blackbox:read",
    "bfl": "quadstep.identify.logs.blackbox:read",
})  # fmt: skip
"""What reads a kind of file, by file extension: given a path and the wanted columns, TOPIC.FIELD, it returns `Topics`."""

KINDS = {"ulg": "a ULog", "ulog": "a ULog", "bin": "an ArduPilot log", "mcap": "an MCAP file"} | dict.fromkeys(
    ("bbl", "bfl"), "a blackbox log of Betaflight"
)


def of_topics(path: Path) -> bool:
    """Whether there is a reader for the file."""
    return path.suffix.lower().removeprefix(".") in READERS


def refuse_empty(path: Path) -> None:
    """Raises UserError for a log that is empty or cannot be opened."""
    with files.opened(path, files.LOG) as file:
        if not file.read(1):
            raise UserError(f"{path}: is empty")


def read_topics(path: Path, columns: list[str]) -> Topics:
    """The requested columns that a log has. Raises UserError if it is not a log, or if a package is not installed."""
    extension = path.suffix.lower().removeprefix(".")
    kind = KINDS.get(extension, f"a .{extension} file")
    refuse_empty(path)
    found: Topics
    with needed_by(f"reading {kind}"):
        try:
            found = READERS.load(extension)(path, columns)
        except (UserError, ModuleNotFoundError):
            raise
        except Exception as error:
            said = str(error) or type(error).__name__
            raise UserError(f"{path}: cannot be read as {kind}: damaged, or another kind of file ({said})") from None
    return found


PERIOD = 0.01
"""Period of the rows, if the log is that fast [s]."""

LOGGED = {".bin": ": set bit 10 of LOG_BITMASK (RC output)"}
"""What makes an autopilot log its motors' commands."""

THRUSTS = "actuator_motors."
"""What begins the names of PX4's commands before its model of the motors: thrusts, not yet what the motors are told."""

STALE = 0.1
"""Age above which a sample is stale [s], or three of its own periods if these are longer."""

LONGEST = 3600.0 * 6


class LogRows(NamedTuple):
    """Rows of a log: time [s] (n,), their period [s], the motors' commands as logged (n, rotors), and channels in SI."""

    time: Floats
    period: float
    motors: Floats
    channels: dict[str, Floats]


def gridded(path: Path, columns: Columns, mapping: Mapping) -> LogRows:
    """A log by a mapping. Raises UserError if the motors, or everything else, are missing, or time goes backward."""
    refuse_backward(path, columns, columns)
    missing = [name for name in mapping.motors.columns if name not in columns or len(columns[name].time) < 2]
    if missing:
        have = ", ".join(sorted({name.partition(".")[0] for name in columns}))
        if not have:
            raise UserError(f"{path}: has none of the columns of its mapping, such as {missing[0]}; damaged, or without data")
        set_it = LOGGED.get(path.suffix.lower(), "")
        raise UserError(f"{path}: {missing[0]}: this motor command is not in the log; it has {have}{set_it}")
    told = columns[mapping.motors.columns[0]].time
    if told[-1] - told[0] > LONGEST:
        raise UserError(f"{path}: longer than six hours; cut the log")
    period = max(PERIOD, float(np.median(np.diff(told))))
    time = np.arange(np.ceil(told[0] / period) * period, told[-1], period)  # the same rows of a log and of a part of it
    if len(time) < FEWEST_ROWS:
        raise UserError(f"{path}: {len(time)} rows of {period:g} s with motor commands; a log needs at least {FEWEST_ROWS}")
    logged = np.stack([latest_samples(columns[name], time) for name in mapping.motors.columns], axis=1)
    channels = {}
    for name, channel in mapping.columns.items():
        needed = (*channel.columns, *channel.where)
        if not all(one in columns for one in needed):
            continue
        taken = np.logical_and.reduce([columns[one].value == value for one, value in channel.where.items()] or [True])
        stamps = columns[channel.columns[0]].time
        taken = np.broadcast_to(taken, stamps.shape)
        if taken.sum() > 1:
            samples = np.stack([columns[one].value[taken] for one in channel.columns], axis=1)
            channels[name] = interpolated(stamps[taken], converted(mapping, name, samples), time)
    return LogRows(time - time[0], period, logged, channels)


def stale(stamps: Floats, time: Floats) -> Flags:
    """Whether no sample is near in time."""
    oldest = max(STALE, 3.0 * float(np.median(np.diff(stamps))))
    before = np.clip(np.searchsorted(stamps, time, side="right") - 1, 0, len(stamps) - 1)
    after = np.clip(before + 1, 0, len(stamps) - 1)
    return (np.abs(time - stamps[before]) > oldest) | (np.abs(stamps[after] - time) > oldest)


def latest_samples(series: Series, time: Floats) -> Floats:
    """The latest sample at each time, NaN where it is stale."""
    place = np.searchsorted(series.time, time, side="right") - 1
    values = np.where(place >= 0, series.value[np.maximum(place, 0)], np.nan)
    return np.where(stale(series.time, time), np.nan, values)


def interpolated(stamps: Floats, values: Floats, time: Floats) -> Floats:
    """Values by linear interpolation, (n, width), NaN where samples are stale; quaternions without jumps of sign."""
    if values.shape[1] == 4:
        turns = np.sum(values[1:] * values[:-1], axis=1) < 0.0
        values = values * np.cumprod(np.concatenate([[1.0], np.where(turns, -1.0, 1.0)]))[:, None]
    found = np.stack([np.interp(time, stamps, column) for column in values.T], axis=1)
    if values.shape[1] == 4:
        found /= np.linalg.norm(found, axis=1, keepdims=True)
    found[stale(stamps, time)] = np.nan
    return found


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
    return read_table(path, read_mapping(mapping) if mapping else mapping_for(path))


def read_many(path: Path, mappings: list[Mapping]) -> FlightRecord:
    """A log of many topics, by the first mapping whose motor columns it has. Raises UserError."""
    if not mappings:
        refuse_empty(path)
        raise UserError(f"{path}: topics have no fixed names; give --mapping FILE that assigns the columns (docs/logs.md)")
    columns, damaged, told, _ = read_topics(
        path, list(dict.fromkeys(name for mapping in mappings for name in mapping.names()))
    )
    chosen = next((one for one in mappings if all(name in columns for name in one.motors.columns)), mappings[0])
    rows = gridded(path, columns, chosen)
    factor = told.get("THR_MDL_FAC", 0.0)
    if chosen.motors.columns[0].startswith(THRUSTS) and 0.0 < factor <= 1.0:
        rows = rows._replace(motors=np.asarray(command_of_thrust(cast(float, np.maximum(rows.motors, 0.0)), factor)))
    return recorded(path, chosen, rows, damaged)


def mapping_for(path: Path) -> Mapping:
    """The mapping of the package that fits a table. Raises UserError."""
    name = fitting(header_of(path))
    if name is None:
        raise UserError(
            f"{path}: its columns match none of the mappings {', '.join(mapping_names())}; give --mapping FILE, which "
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
    return 2.0 * product(q * np.array([1.0, -1.0, -1.0, -1.0]), np.gradient(q, time, axis=0))[:, 1:]


def turned(attitude: Floats, body: Floats) -> Floats:
    """Body vectors in world axes, (n, 3)."""
    w, v = attitude[:, :1], attitude[:, 1:]
    t = 2.0 * np.cross(v, body)
    return body + w * t + np.cross(v, t)

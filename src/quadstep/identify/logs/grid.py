"""Samples of many topics resampled to evenly spaced rows."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from quadstep.identify.logs.flight import Flags, Floats
from quadstep.identify.logs.mapping import Mapping, converted
from quadstep.identify.logs.series import Columns, Series
from quadstep.identify.logs.table import FEWEST_ROWS
from quadstep.io.errors import UserError

PERIOD = 0.01
"""Period of the rows, if the log is that fast [s]."""

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
    for name, series in columns.items():
        if len(series.time) > 1 and (np.diff(series.time) < 0.0).any():
            raise UserError(f"{path}: {name}: time goes backward")
    missing = [name for name in mapping.motors.columns if name not in columns or len(columns[name].time) < 2]
    if missing:
        have = ", ".join(sorted({name.partition(".")[0] for name in columns}))
        if not have:
            raise UserError(f"{path}: has none of the columns of its mapping, such as {missing[0]}; damaged, or without data")
        raise UserError(f"{path}: {missing[0]}: the motors' commands are not in the log; it has {have}")
    told = columns[mapping.motors.columns[0]].time
    if told[-1] - told[0] > LONGEST:
        raise UserError(f"{path}: longer than six hours; cut the log")
    period = max(PERIOD, float(np.median(np.diff(told))))
    time = np.arange(told[0], told[-1], period)
    if len(time) < FEWEST_ROWS:
        raise UserError(f"{path}: {len(time)} rows of {period:g} s with motor commands; a log needs at least {FEWEST_ROWS}")
    logged = np.stack([held(columns[name], time) for name in mapping.motors.columns], axis=1)
    channels = {}
    for name, channel in mapping.columns.items():
        if all(one in columns and len(columns[one].time) > 1 for one in channel.columns):
            samples = np.stack([columns[one].value for one in channel.columns], axis=1)
            stamps = columns[channel.columns[0]].time
            channels[name] = between(stamps, converted(mapping, name, samples), time)
    return LogRows(time - time[0], period, logged, channels)


def stale(stamps: Floats, time: Floats) -> Flags:
    """Whether no sample is near in time."""
    oldest = max(STALE, 3.0 * float(np.median(np.diff(stamps))))
    before = np.clip(np.searchsorted(stamps, time, side="right") - 1, 0, len(stamps) - 1)
    after = np.clip(before + 1, 0, len(stamps) - 1)
    far: Flags = (np.abs(time - stamps[before]) > oldest) | (np.abs(stamps[after] - time) > oldest)
    return far


def held(series: Series, time: Floats) -> Floats:
    """The latest sample at each time, NaN where it is stale."""
    place = np.searchsorted(series.time, time, side="right") - 1
    values = np.where(place >= 0, series.value[np.maximum(place, 0)], np.nan)
    return np.where(stale(series.time, time), np.nan, values)


def between(stamps: Floats, values: Floats, time: Floats) -> Floats:
    """Values by linear interpolation, (n, width), NaN where samples are stale; quaternions without jumps of sign."""
    if values.shape[1] == 4:
        turns = np.sum(values[1:] * values[:-1], axis=1) < 0.0
        values = values * np.cumprod(np.concatenate([[1.0], np.where(turns, -1.0, 1.0)]))[:, None]
    found = np.stack([np.interp(time, stamps, column) for column in values.T], axis=1)
    if values.shape[1] == 4:
        found /= np.linalg.norm(found, axis=1, keepdims=True)
    found[stale(stamps, time)] = np.nan
    return found

"""Betaflight's blackbox (https://betaflight.com/docs/development/Blackbox), decoded by the package betaflight-chirp-core."""

import math
from pathlib import Path

import numpy as np
from betaflight_chirp_core.decoder import FlightLogParser, split_sessions

from quadstep.identify.logs.flight import Floats
from quadstep.identify.logs.series import Series, Topics, by_topic, refuse_many
from quadstep.io import files
from quadstep.io.errors import UserError

TOPIC = "main"
"""What the frames of every loop are called here: main.gyroADC[0]."""

SUMS = "axisSum"
"""What P, I, D and feed-forward of an axis make together, main.axisSum[0]: Betaflight logs them one by one."""

PARTS = "axisP", "axisI", "axisD", "axisF"

MODES, ACRO = "flightModeFlags", "acro"
"""A field of Betaflight; and a parameter here, 1 where no mode was on in which the attitude is held, 0 otherwise."""

HOLDING = 0b11111110
"""Bits of these modes: angle, horizon and others that come before those of the radio."""

INTERVALS, LONGEST_INTERVAL = ("frameIntervalI", "frameIntervalPNum", "frameIntervalPDenom"), 10_000
"""Headers of the intervals between frames, in loops."""

AXES = "roll", "pitch", "yaw"

FINE, TENTHS = ("gyroADC", "gyroUnfilt", "rcCommand", "setpoint"), "blackbox_high_resolution"
"""Logged in tenths where that header is 1, but for the throttle's setpoint[3]."""


def read(path: Path, wanted: list[str]) -> Topics:
    """Columns of the longest flight of a log, times in seconds, rates in deg/s. Parameters: the headers that are numbers, of
    lists with their places, rollPID[0]; gains as p_roll; `ACRO`. Raises UserError where there is no such flight.
    """
    fields = by_topic(wanted).get(TOPIC, [])
    content = files.read_bytes(path, files.LOG)
    sessions = [FlightLogParser(content, *ends) for ends in split_sessions(content)]
    for one in sessions:
        one.parse_header()
        if not all(0 < one.sys_config[name] <= LONGEST_INTERVAL for name in INTERVALS):  # the decoder counts through them
            raise UserError(f"{path}: its headers give an interval between frames that is outside 1 to {LONGEST_INTERVAL}")
        one.parse_data()
    session = max(sessions, key=lambda one: len(one.main_frames), default=None)
    if session is None or not session.main_frames:
        raise UserError(f"{path}: contains no Betaflight blackbox flight")
    if session.sys_config["firmwareType"] != "betaflight":
        raise UserError(
            f"{path}: should be from Betaflight, not {session.sys_config.get('Firmware revision', 'another firmware')!s:.40}"
        )
    refuse_many(path, {TOPIC: len(session.main_frames)}, {TOPIC: session.main_field_names})
    rows: Floats = np.array(session.main_frames, dtype=np.float64)
    places = {name: place for place, name in enumerate(session.main_field_names)}
    rows = rows[np.concatenate([[True], np.diff(rows[:, places["time"]]) > 0.0])]
    time = 1e-6 * rows[:, places["time"]]
    columns = {}
    for field in fields:
        name, _, axis = field.partition("[")
        parts = [f"{one}[{axis}" for one in PARTS] if name == SUMS else [field]
        found = [rows[:, places[one]] for one in parts if one in places]
        if found:
            unit = math.degrees(1e6 * session.sys_config["gyroScale"]) if name == "gyroADC" else 1.0
            if session.sys_config.get(TENTHS) == 1 and name in FINE and field != "setpoint[3]":
                unit *= 0.1
            columns[f"{TOPIC}.{field}"] = Series(time, unit * np.sum(found, axis=0))
    damaged = int(session.stats["total_corrupt_frames"])
    return Topics(columns, damaged, parameters(session))


def parameters(session: FlightLogParser) -> dict[str, float]:
    """The numbers of the headers."""
    found: dict[str, float] = {}
    for name, value in session.sys_config.items():
        several = value if isinstance(value, list) else [value]
        for place, one in enumerate(several):
            if isinstance(one, int | float):
                found[f"{name}[{place}]" if isinstance(value, list) else name] = float(one)
    for axis in AXES:
        found |= {f"{one}_{axis}": found.get(f"{axis}PID[{place}]", 0.0) for place, one in enumerate("pid")}
    names = session.frame_defs.get("S", {}).get("name", [])
    if MODES in names:
        place = names.index(MODES)
        found[ACRO] = float(not any(int(row[place]) & HOLDING for row in session.slow_frames))
    return found

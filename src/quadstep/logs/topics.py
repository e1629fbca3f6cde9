"""Logs of many topics, each with samples of its own: PX4 ULog, ArduPilot .BIN, MCAP. A column is called topic.field."""

import json
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from quadstep import files
from quadstep.errors import UserError
from quadstep.extras import needed_by
from quadstep.logs.flight import Floats

MOST_SAMPLES = 20_000_000
"""Numbers that are taken from a log, in all."""


class Series(NamedTuple):
    """Samples of a column: time [s] and value, both (n,)."""

    time: Floats
    value: Floats


Columns = dict[str, Series]
READERS = {".ulg": "ULog", ".ulog": "ULog", ".bin": "ArduPilot log", ".mcap": "MCAP file"}


def read_topics(path: Path, wanted: list[str]) -> Columns:
    """Those of the wanted columns that a log has. Raises UserError for what is no log, or a package that is not installed."""
    kind = READERS[path.suffix.lower()]
    files.opened(path, files.LOG).close()
    read = {"ULog": ulog, "ArduPilot log": ardupilot, "MCAP file": mcap}[kind]
    with needed_by(f"reading a {kind}"):
        try:
            found = read(path, wanted)
        except (UserError, ModuleNotFoundError):
            raise
        except Exception as error:
            raise UserError(f"{path}: cannot be read as a {kind}: {str(error) or type(error).__name__}") from None
    if sum(len(one.time) for one in found.values()) > MOST_SAMPLES:
        raise UserError(f"{path}: more than {MOST_SAMPLES} numbers; cut the log")
    return found


def by_topic(wanted: Iterable[str]) -> dict[str, list[str]]:
    """Fields by topic, which ends at the first dot."""
    found: dict[str, list[str]] = {}
    for name in wanted:
        topic, _, field = name.partition(".")
        if field:
            found.setdefault(topic, []).append(field)
    return found


def ulog(path: Path, wanted: list[str]) -> Columns:
    """Columns of a ULog: the first instance of each topic, times in seconds."""
    from pyulog import ULog  # noqa: PLC0415 (optional)

    topics = by_topic(wanted)
    log = ULog(str(path), list(topics))
    found: Columns = {}
    for data in log.data_list:
        if data.multi_id or data.name not in topics:
            continue
        stamps = data.data.get("timestamp_sample", data.data["timestamp"])
        stamps = data.data["timestamp"] if not np.any(stamps) else stamps
        for field in topics[data.name]:
            if field in data.data:
                time = np.asarray(stamps, dtype=float) * 1e-6
                found[f"{data.name}.{field}"] = Series(time, np.asarray(data.data[field], dtype=float))
    return found


def ardupilot(path: Path, wanted: list[str]) -> Columns:
    """Columns of an ArduPilot log, of the first instance of each message (I, or C for the filter's core, is 0)."""
    from pymavlink.DFReader import DFReader_binary  # noqa: PLC0415 (optional)

    topics = by_topic(wanted)
    rows: dict[str, list[list[float]]] = {topic: [] for topic in topics}
    log = DFReader_binary(str(path))
    while (message := log.recv_match(type=list(topics))) is not None:
        if getattr(message, "I", getattr(message, "C", 0)):
            continue
        topic = message.get_type()
        values = [float(getattr(message, field, np.nan)) for field in topics[topic]]
        rows[topic].append([float(message.TimeUS) * 1e-6, *values])
    found: Columns = {}
    for topic, fields in topics.items():
        if rows[topic]:
            time, *columns = np.array(rows[topic]).T
            found.update({f"{topic}.{field}": Series(time, column) for field, column in zip(fields, columns, strict=True)})
    return found


def mcap(path: Path, wanted: list[str]) -> Columns:
    """Columns of an MCAP file with messages of ROS 2 or in JSON, at the time of their logging."""
    from mcap.reader import make_reader  # noqa: PLC0415 (optional)
    from mcap_ros2.decoder import DecoderFactory  # noqa: PLC0415 (optional)

    topics = by_topic(wanted)
    factory = DecoderFactory()
    rows: dict[str, list[list[float]]] = {topic: [] for topic in topics}
    with path.open("rb") as file:
        for schema, channel, message in make_reader(file).iter_messages(topics=list(topics)):
            if channel.message_encoding == "json":
                content: object = json.loads(message.data)
            else:
                decode = factory.decoder_for(channel.message_encoding, schema)
                if decode is None:
                    raise UserError(f"{path}: {channel.topic}: messages in {channel.message_encoding} are not known")
                content = decode(message.data)
            values = [entry(content, field) for field in topics[channel.topic]]
            rows[channel.topic].append([message.log_time * 1e-9, *values])
    found: Columns = {}
    for topic, fields in topics.items():
        if rows[topic]:
            time, *columns = np.array(rows[topic]).T
            found.update({f"{topic}.{field}": Series(time, column) for field, column in zip(fields, columns, strict=True)})
    return found


def entry(content: object, field: str) -> float:
    """A number inside a message: pose.position.x, or control[2]; NaN where there is none."""
    for part in field.split("."):
        name, _, place = part.partition("[")
        content = content.get(name) if isinstance(content, dict) else getattr(content, name, None)
        if place and content is not None:
            content = content[int(place.rstrip("]"))]
    return float(content) if isinstance(content, int | float) else float("nan")

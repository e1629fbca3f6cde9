"""MCAP: messages of ROS 2, or in JSON."""

import json
from pathlib import Path

import numpy as np
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

from quadstep.errors import UserError
from quadstep.logs.series import Columns, Series, by_topic


def read(path: Path, wanted: list[str]) -> Columns:
    """Columns of an MCAP file with messages of ROS 2 or in JSON, at the time they were logged."""
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

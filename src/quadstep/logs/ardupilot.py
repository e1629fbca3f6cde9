"""ArduPilot's .BIN."""

from pathlib import Path

import numpy as np
from pymavlink.DFReader import DFReader_binary

from quadstep.logs.series import Columns, Series, by_topic


def read(path: Path, wanted: list[str]) -> Columns:
    """Columns of an ArduPilot log, of the first instance of each message (I, or C for the filter's core, is 0)."""
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

"""PX4's ULog."""

from pathlib import Path

import numpy as np
from pyulog import ULog

from quadstep.logs.series import Columns, Series, by_topic


def read(path: Path, wanted: list[str]) -> Columns:
    """Columns of a ULog: the first instance of each topic, times in seconds."""
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

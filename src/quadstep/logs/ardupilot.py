"""ArduPilot's .BIN."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from pymavlink.DFReader import DFReader_binary

from quadstep.logs.series import Columns, Series, by_topic


def read(path: Path, wanted: list[str]) -> Columns:
    """Columns of an ArduPilot log, of the first instance of each message (I, or C for the filter's core, is 0).

    The reader prints a line for every byte that it skips; here errors are reported once, by the caller.
    """
    with errors_unprinted():
        return columns(path, wanted)


@contextmanager
def errors_unprinted() -> Iterator[None]:
    """Silences standard error in this block, for compiled code too."""
    kept = os.dup(2)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 2)
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nowhere)


def columns(path: Path, wanted: list[str]) -> Columns:
    """The same, without silencing the reader."""
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
            time, *values_of = np.array(rows[topic]).T
            found.update({f"{topic}.{field}": Series(time, column) for field, column in zip(fields, values_of, strict=True)})
    return found

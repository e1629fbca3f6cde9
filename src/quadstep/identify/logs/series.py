"""Columns of logs with many topics: each has its own samples and is named topic.field."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import NamedTuple

from quadstep.identify.logs.flight import Floats
from quadstep.io.errors import UserError

MOST_SAMPLES = 20_000_000
"""Most numbers taken from a log, in all."""


class Series(NamedTuple):
    """Samples of a column: time [s] and value, both (n,)."""

    time: Floats
    value: Floats


Columns = dict[str, Series]


class Topics(NamedTuple):
    """What is read of a log. damaged: how many stretches of it are not what its format says, and were skipped."""

    columns: Columns
    damaged: int


def by_topic(wanted: Iterable[str]) -> dict[str, list[str]]:
    """Fields by topic; the topic's name ends at the first dot."""
    found: dict[str, list[str]] = {}
    for name in wanted:
        topic, _, field = name.partition(".")
        if field:
            found.setdefault(topic, []).append(field)
    return found


def refuse_many(path: Path, rows: Mapping[str, int], fields: Mapping[str, list[str]]) -> None:
    """Raises UserError where so many rows of each topic are more numbers than a log may have."""
    if sum(count * (1 + len(fields[topic])) for topic, count in rows.items()) > MOST_SAMPLES:
        raise UserError(f"{path}: more than {MOST_SAMPLES} numbers; cut the log")

"""Columns of logs with many topics: each has its own samples and is named topic.field."""

from collections.abc import Iterable
from typing import NamedTuple

from quadstep.logs.flight import Floats


class Series(NamedTuple):
    """Samples of a column: time [s] and value, both (n,)."""

    time: Floats
    value: Floats


Columns = dict[str, Series]


def by_topic(wanted: Iterable[str]) -> dict[str, list[str]]:
    """Fields by topic; the topic's name ends at the first dot."""
    found: dict[str, list[str]] = {}
    for name in wanted:
        topic, _, field = name.partition(".")
        if field:
            found.setdefault(topic, []).append(field)
    return found

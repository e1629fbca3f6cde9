"""What tests cost: `make durations` measures the processor's time of each and writes durations.json, which marks slow ones.

A test function is slow where one of its cases takes `SLOW` seconds or more, child processes included; the time on a clock
would depend on what else the machine does.
"""

import json
import resource
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests import forked

PLACE = Path(__file__).with_suffix(".json")
SLOW = 0.5
"""[s] of a processor."""

PROPERTY = "processor seconds"


def function(nodeid: str) -> str:
    """The test function that a case belongs to."""
    return nodeid.partition("[")[0]


def recorded() -> dict[str, float]:
    """Slow test functions and the time of their slowest case."""
    return json.loads(PLACE.read_text(encoding="utf-8"))


def spent() -> float:
    """Processor's time of this process, of its children that have ended, and of commands that were forked elsewhere."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in used) + sum(forked.spent)


class Recorder:
    """Plugin that measures; in a run of several processes each measures, and the first one writes."""

    def __init__(self) -> None:
        self.seconds: defaultdict[str, float] = defaultdict(float)

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_call(self, item: pytest.Item) -> Iterator[None]:
        return (yield from self.measured(item))

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_teardown(self, item: pytest.Item) -> Iterator[None]:
        """Where the processes of a file's tests end, and what they took is known."""
        return (yield from self.measured(item))

    def measured(self, item: pytest.Item) -> Iterator[None]:
        before = spent()
        try:
            return (yield)
        finally:
            item.user_properties.append((PROPERTY, spent() - before))

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.when in ("call", "teardown"):
            name, times = function(report.nodeid), [seconds for key, seconds in report.user_properties if key == PROPERTY]
            self.seconds[name] = max(self.seconds[name], sum(times))

    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        if not hasattr(session.config, "workerinput"):
            write(recorded() | self.seconds)


def write(seconds: dict[str, float]) -> None:
    """Write the slow ones of these."""
    slow = {name: round(one, 1) for name, one in sorted(seconds.items()) if one >= SLOW}
    PLACE.write_text(json.dumps(slow, indent=0) + "\n", encoding="utf-8")

"""Progress on standard error: bars on a terminal, else a line now and then."""

import contextlib
import math
import sys
import time
from collections.abc import Iterator

from rich.progress import BarColumn, ProgressColumn, Task, TextColumn, TimeRemainingColumn
from rich.progress import Progress as Drawn
from rich.text import Text

from quadstep.report.progress import Progress
from quadstep.report.screen import complain, console

WIDE, ROOM = 60, 50
"""Columns from which on there is a bar beside the numbers, and what the rest of its line needs."""


EVERY = 60.0
"""Seconds from one line of progress to the next, where there is no terminal."""


class AmountColumn(ProgressColumn):
    """The amount done, and the total once known."""

    def render(self, task: Task) -> Text:
        of = "" if task.total is None else f"/{task.total:,.0f}"
        return Text(f"{task.completed:,.0f}{of} {task.fields['unit']}".rstrip(), no_wrap=True)


class RateColumn(ProgressColumn):
    """Units per second, where at least one."""

    def render(self, task: Task) -> Text:
        speed = task.finished_speed or task.speed or 0.0
        return Text(f"{speed:,.0f}/s" if speed >= 1.0 else "", no_wrap=True)


class Bar(Progress):
    """A bar that is being shown, or lines where standard error is no terminal that can draw one."""

    def __init__(self, progress: Drawn, doing: str, unit: str, total: float | None) -> None:
        self.progress, self.unit, self.lines = progress, unit, Lines(doing, unit) if progress.disable else None
        self.task = progress.add_task(doing, total=total, unit=unit, note="")

    def to(self, done: float, total: float | None = None, note: str = "") -> None:
        """Set the progress. total: as far as known. note: shown beside it."""
        self.progress.update(self.task, completed=done, total=total, note=note)
        if self.lines:
            self.lines.to(done, total)

    def doing(self, what: str, unit: str | None = None) -> None:
        """Set the description to the current stage. unit: of what is counted in it, if another."""
        self.unit = unit or self.unit
        self.progress.update(self.task, description=what, unit=self.unit)
        if self.lines:
            self.lines = Lines(what, self.unit, self.lines.last)


class Lines:
    """A stage told in lines, the first after `EVERY` seconds. last: when the last one was."""

    def __init__(self, doing: str, unit: str, last: float | None = None) -> None:
        self.doing, self.unit, self.began = doing, unit, time.monotonic()
        self.last, self.first = self.began if last is None else last, math.nan

    def to(self, done: float, total: float | None) -> None:
        """Say how far it is, and how long it will take, if the last line is old enough."""
        now = time.monotonic()
        if math.isnan(self.first):
            self.first = done
        if now - self.last < EVERY:
            return
        self.last = now
        of = "" if total is None else f" of {total:,.0f}"
        left = ""
        if total is not None and done > self.first:
            left = f", about {minutes((total - done) * (now - self.began) / (done - self.first))} left"
        complain(f"{self.doing}: {done:,.0f}{of} {self.unit}".rstrip() + left)


def minutes(seconds: float) -> str:
    return f"{seconds / 3600.0:.1f} h" if seconds >= 5400.0 else f"{max(1.0, seconds / 60.0):.0f} min"


@contextlib.contextmanager
def bar(doing: str, unit: str = "", total: float | None = None) -> Iterator[Bar]:
    """A progress bar while the block runs. unit: of the count."""
    screen = console(sys.stderr)
    narrow = screen.width < WIDE
    drawn = [] if narrow else [BarColumn(bar_width=min(40, screen.width - ROOM))]
    columns = [TextColumn("{task.description}"), *drawn, AmountColumn(), TextColumn("{task.fields[note]}")]
    if not narrow:
        columns += [RateColumn(), TimeRemainingColumn()]
    shown = screen.is_terminal and not screen.is_dumb_terminal
    with Drawn(*columns, console=screen, transient=True, disable=not shown) as progress:
        yield Bar(progress, doing, unit, total)

"""Progress bars on standard error."""

import contextlib
import sys
from collections.abc import Iterator

from rich.progress import BarColumn, Progress, ProgressColumn, Task, TextColumn, TimeRemainingColumn
from rich.text import Text

from quadstep.terminal.screen import console

WIDE, ROOM = 60, 50
"""Columns from which on there is a bar beside the numbers, and what the rest of its line needs."""


class Count(ProgressColumn):
    """The amount done, and the total once known."""

    def render(self, task: Task) -> Text:
        of = "" if task.total is None else f"/{task.total:,.0f}"
        return Text(f"{task.completed:,.0f}{of} {task.fields['unit']}".rstrip(), no_wrap=True)


class Rate(ProgressColumn):
    """Units per second, where at least one."""

    def render(self, task: Task) -> Text:
        speed = task.finished_speed or task.speed or 0.0
        return Text(f"{speed:,.0f}/s" if speed >= 1.0 else "", no_wrap=True)


class Bar:
    """A bar that is being shown, or nothing where standard error is no terminal that can draw one."""

    def __init__(self, progress: Progress, doing: str, unit: str, total: float | None) -> None:
        self.progress = progress
        self.task = progress.add_task(doing, total=total, unit=unit, note="")

    def to(self, done: float, total: float | None = None, note: str = "") -> None:
        """Set the progress. total: as far as known. note: shown beside it."""
        self.progress.update(self.task, completed=done, total=total, note=note)

    def doing(self, what: str) -> None:
        """Set the description to the current stage."""
        self.progress.update(self.task, description=what)


@contextlib.contextmanager
def bar(doing: str, unit: str = "", total: float | None = None) -> Iterator[Bar]:
    """A progress bar while the block runs. unit: of the count."""
    screen = console(sys.stderr)
    narrow = screen.width < WIDE
    drawn = [] if narrow else [BarColumn(bar_width=min(40, screen.width - ROOM))]
    columns = [TextColumn("{task.description}"), *drawn, Count(), TextColumn("{task.fields[note]}")]
    if not narrow:
        columns += [Rate(), TimeRemainingColumn()]
    shown = screen.is_terminal and not screen.is_dumb_terminal
    with Progress(*columns, console=screen, transient=True, disable=not shown) as progress:
        yield Bar(progress, doing, unit, total)

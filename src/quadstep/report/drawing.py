"""Drawing figures in processes of their own, on all cores, while the flights are still being computed."""

import multiprocessing
import os
import signal
import threading
import warnings
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadstep.report.interrupts import interrupts_held
from quadstep.report.panel import Panel


class FigureJob(NamedTuple):
    """A figure to be drawn. name: file name without ending; panels share the time axis t [s], filled column by column."""

    name: str
    title: str
    t: NDArray[np.float64]
    panels: list[Panel]
    columns: int = 1

    def draw(self, folder: Path) -> None:
        """Write name.png and name.svg into a folder."""
        from quadstep.report.figures import save  # noqa: PLC0415 (matplotlib loads only where figures are drawn)

        save(folder / self.name, self.title, self.t, self.panels, self.columns)


def warm_up() -> None:
    """Load matplotlib ahead of the first figure; leave Ctrl-C to the main process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=end_with_parent, daemon=True).start()
    warnings.filterwarnings("ignore", "Glyph")  # a name in a script that the font lacks
    import quadstep.report.figures  # noqa: F401, PLC0415


def end_with_parent() -> None:
    """Waits for the main process; if that is killed, nothing else would end this one."""
    parent = multiprocessing.parent_process()
    if parent:
        parent.join()
        os._exit(1)


@contextmanager
def drawing_pool() -> Iterator[ProcessPoolExecutor]:
    """Processes that draw; started at once, stopped without waiting if the block fails."""
    workers = max(1, min(4, os.cpu_count() or 1))
    pool = ProcessPoolExecutor(workers, multiprocessing.get_context("spawn"), initializer=warm_up)
    try:
        with interrupts_held():
            for _ in range(workers):
                pool.submit(os.getpid)
        yield pool
        pool.shutdown()
    finally:
        pool.shutdown(wait=False, cancel_futures=True)

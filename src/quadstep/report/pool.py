"""Figures as jobs for other processes, which draw them on all cores while the main one goes on, forked from a server
that has matplotlib loaded.

Loads nothing heavy itself, so that a command can start the server before anything else.
"""

import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import contextmanager
from types import ModuleType
from typing import ParamSpec, TypeVar

from quadstep.io.errors import UserError, interrupts_held
from quadstep.io.user_code import warn_of_users_only
from quadstep.report.writable import provide_writable

try:
    from multiprocessing import forkserver, resource_tracker
except ImportError:  # a Python that starts no processes, that of a browser
    forkserver = None  # type: ignore[assignment]

PRELOADED = "quadstep.report.preloaded"
MOST_WORKERS = 4

Given = ParamSpec("Given")
Result = TypeVar("Result")


class DrawingPool(ProcessPoolExecutor):
    """Drawing processes, each started when it is first needed."""

    def __init__(self, workers: int | None = None) -> None:
        if workers is None:
            workers = max(1, min(MOST_WORKERS, len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else 2))
        super().__init__(workers, multiprocessing.get_context("forkserver"), initializer=prepare_worker)

    def submit(self, function: Callable[Given, Result], /, *args: Given.args, **kwargs: Given.kwargs) -> Future[Result]:
        """Run a function in a process of the pool. Raises UserError where no process can be started for it."""
        with failures_named(), starting():
            return super().submit(function, *args, **kwargs)

    def close_results(self) -> None:
        """Once all processes are killed: what one of them had written half ends here, where the rest would be waited for."""
        results = getattr(self, "_result_queue", None)  # of the executor, which has no way of its own to say so
        writer = getattr(results, "_writer", None)
        if writer is not None and not writer.closed:
            writer.close()


def start_server() -> None:
    """Load matplotlib in the background, so that the first figure need not wait for it. Raises UserError."""
    provide_writable()
    with failures_named():
        if forkserver is None:
            raise OSError("this Python has none")
        multiprocessing.get_context("forkserver").set_forkserver_preload([PRELOADED])
        resource_tracker.ensure_running()  # which the server needs, and which would let Ctrl-C through again
        with starting():
            forkserver.ensure_running()


@contextmanager
def failures_named() -> Iterator[None]:
    """Raises UserError where a process cannot be started in this block."""
    try:
        yield
    except (OSError, EOFError) as error:
        raise UserError(f"could not start a process to draw figures: {error}; nothing was written") from None


@contextmanager
def starting() -> Iterator[None]:
    """Processes started in this block never see Ctrl-C, run nothing of the main module, and take no module from the folder."""
    main, safe = sys.modules["__main__"], os.environ.get("PYTHONSAFEPATH")
    with interrupts_held():
        sys.modules["__main__"] = ModuleType("__main__")
        os.environ["PYTHONSAFEPATH"] = "1"
        try:
            yield
        finally:
            sys.modules["__main__"] = main
            if safe is None:
                del os.environ["PYTHONSAFEPATH"]
            else:
                os.environ["PYTHONSAFEPATH"] = safe


def prepare_worker() -> None:
    """Leave Ctrl-C to the main process, and end with it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=end_with_parent, daemon=True).start()
    warn_of_users_only()


def end_with_parent() -> None:
    """Waits for the main process; if that is killed, nothing else would end this one."""
    parent = multiprocessing.parent_process()
    if parent:
        parent.join()
        os._exit(1)


@contextmanager
def drawing_pool(workers: int | None = None) -> Iterator[DrawingPool]:
    """A pool for as long as the block takes; if the block fails, its processes are gone before its results are.

    workers: how many processes; as many as there are cores, and few, where figures are all that they do.

    Raises UserError where none can be started.
    """
    start_server()
    others = multiprocessing.active_children()
    with failures_named(), interrupts_held():  # or a semaphore stays that nobody knows of
        pool = DrawingPool(workers)
    try:
        yield pool
        pool.shutdown()
    except BaseException:
        for worker in multiprocessing.active_children():
            if worker not in others:
                worker.kill()
        pool.close_results()
        pool.shutdown(cancel_futures=True)
        raise

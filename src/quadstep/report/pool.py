"""Figures as jobs for other processes, which draw them on all cores while the main one goes on, forked from a server
that has matplotlib loaded.

Loads nothing heavy itself, so that a command can start the server before anything else. What Matplotlib and multiprocessing
must write has a folder even for users without a home or a folder for temporary files: so it is in a container with a bare user
id on a read-only system.
"""

import multiprocessing
import os
import shutil
import signal
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import contextmanager, suppress
from multiprocessing.util import Finalize
from pathlib import Path
from types import ModuleType
from typing import ParamSpec, TypeVar

from quadstep.io.errors import UserError, interrupts_deferred
from quadstep.io.user_code import warn_of_users_only

SHARED_MEMORY = Path("/dev/shm")
"""Can be written where nothing else can, as in a read-only container."""

LAST = -200
"""When the folder goes at the end of the process: after multiprocessing has removed its own in it (at -100)."""


def provide_writable() -> None:
    """Makes a folder where one is lacking, names it to this process and those it starts, and removes it in the end.

    Matplotlib's list of fonts is made once, as $MPLCONFIGDIR is the same for all processes; Fontconfig, which it asks, is told
    by $XDG_CACHE_HOME, multiprocessing by $TMPDIR. Call it before Matplotlib is imported. Where nothing can be written at
    all, nothing is done, and whoever needs to write says so.
    """
    at_home = bool(os.environ.get("MPLCONFIGDIR")) or all(map(writable, places()))
    temporary = has_temporary()
    if at_home and temporary:
        return
    for parent in (None,) if temporary else (SHARED_MEMORY, None):
        with suppress(OSError):
            made = tempfile.mkdtemp(prefix="quadstep-", dir=parent)
            Finalize(None, shutil.rmtree, (made,), {"ignore_errors": True}, exitpriority=LAST)
            if not at_home:
                os.environ["MPLCONFIGDIR"] = made
                if not writable(places()[-1]):
                    os.environ["XDG_CACHE_HOME"] = made
            if not temporary:
                os.environ["TMPDIR"] = tempfile.tempdir = made
            return


def has_temporary() -> bool:
    """Whether there is a folder for temporary files that is not the current one, which Python takes as a last resort."""
    with suppress(FileNotFoundError):
        return Path(tempfile.gettempdir()) != Path.cwd()
    return False


def places() -> list[Path | None]:
    """Where Matplotlib keeps settings and lists of a user; None where there is no home."""
    with suppress(RuntimeError):
        if os.uname().sysname not in ("Linux", "FreeBSD"):
            return [Path.home() / ".matplotlib"]
        homes = (("XDG_CONFIG_HOME", ".config"), ("XDG_CACHE_HOME", ".cache"))
        return [Path(os.environ.get(name) or Path.home() / usual) / "matplotlib" for name, usual in homes]
    return [None]


def writable(folder: Path | None) -> bool:
    """Whether a folder can be written, or made."""
    if folder is None:
        return False
    with suppress(OSError):  # inside one that cannot be searched
        there = next(path for path in (folder, *folder.absolute().parents) if path.exists())
        return there.is_dir() and os.access(there, os.W_OK | os.X_OK)
    return False


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
    with interrupts_deferred():
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
    with failures_named(), interrupts_deferred():  # or a semaphore stays that nobody knows of
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

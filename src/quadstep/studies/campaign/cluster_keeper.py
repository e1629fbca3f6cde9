"""A Ray cluster of this machine's cores, for one driver: a program of its own, which ends the cluster when the driver is gone.

Run by `cluster_connection.py`, which sets the environment that keeps Ray on the loopback interface and behind a token. It
answers with one line of JSON, `{"address": "127.0.0.1:PORT"}` or `{"error": "..."}`, and runs until its standard input is
closed: by a driver that is done, or by the kernel after the driver was killed. Needs nothing but Ray.
"""

import contextlib
import fcntl
import json
import logging
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from functools import partial
from pathlib import Path
from typing import NoReturn, TextIO

PREFIX = "quadstep-ray-"
ROOM = "r"
"""The folder within it that Ray is given, and makes accessible to everybody."""

LONGEST = 14
"""Longest path of the folder for temporary files: the paths of Ray's sockets below it must not exceed 103 characters."""

REMOVAL = """
import os, shutil, signal, sys
os.killpg(int(sys.argv[1]), signal.SIGKILL)
while os.path.exists(sys.argv[2]):  # a process that is ending may still write
    shutil.rmtree(sys.argv[2], ignore_errors=True)
"""
"""Ends a group of processes and removes a folder."""

PATIENCE = 10.0
"""How long Ray may take to end by itself, or for a start that nobody waits for any more [s]."""


def main() -> None:
    """Start, answer, wait, end."""
    driver = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # what Ray prints must not be taken for the answer
    signal.signal(signal.SIGTERM, lambda *_: sys.exit())  # as Ray has it too, once it is started
    folder, _ = locked_folder()
    over = threading.Event()
    threading.Thread(target=watch, args=(over, folder, driver), daemon=True).start()
    try:
        answer(driver, address=start(folder))
        over.wait()
    except (Exception, SystemExit) as error:
        answer(driver, error=f"{type(error).__name__}: {error}")
    finally:
        shut_down()
        end(folder, driver)


def start(folder: Path) -> str:
    """The address of a new cluster. Raises whatever Ray raises, RuntimeError for one that would listen on a network."""
    import ray  # noqa: PLC0415 (slow, and may fail)

    where: str = ray.util.get_node_ip_address()  # type: ignore[no-untyped-call]
    if where not in ("127.0.0.1", "::1"):
        raise RuntimeError(f"Ray would listen on {where}")
    begin = partial(
        ray.init,
        address="local",
        include_dashboard=False,
        log_to_driver=False,
        logging_level=logging.CRITICAL,
        _temp_dir=str(folder / ROOM),
    )
    try:
        begin()
    except Exception as error:  # Ray knows no kind of its own
        if "timed out" not in str(error):
            raise
        shut_down()  # it gives its processes 30 s, which is not enough on a busy machine; what they have loaded is cached now
        begin()
    address: str = ray.get_runtime_context().gcs_address
    return address


def answer(driver: TextIO, **said: str) -> None:
    """One line for the driver, if it still listens."""
    with contextlib.suppress(OSError):
        driver.write(json.dumps(said) + "\n")
        driver.flush()


def watch(over: threading.Event, folder: Path, driver: TextIO) -> None:
    """Wait for the driver's end; make sure that this program ends soon after, wherever Ray may be stuck."""
    sys.stdin.buffer.read()
    over.set()
    time.sleep(PATIENCE)
    end(folder, driver)


def shut_down() -> None:
    """Have Ray end its processes."""
    if "ray" in sys.modules:
        with contextlib.suppress(Exception, SystemExit):
            sys.modules["ray"].shutdown()


def end(folder: Path, driver: TextIO) -> NoReturn:
    """End what is left of the cluster, including this program, and remove its folder: Ray's agents would stay for a minute.

    A process of another group does it, since what still runs here would write to the folder again. The driver's pipe stays
    open until it has done so.
    """
    command = [sys.executable, "-I", "-S", "-c", REMOVAL, str(os.getpid()), str(folder)]
    subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=driver, stderr=subprocess.DEVNULL, start_new_session=True)
    while True:
        signal.pause()


def locked_folder() -> tuple[Path, int]:
    """A new folder for Ray's session that only this user can read, and the handle whose lock marks it as in use.

    Removes this user's folders that are not in use: left behind by processes that were killed.
    """
    place = short_place()
    for old in Path(place).glob(PREFIX + "*"):
        with contextlib.suppress(OSError):  # somebody else's, in use, or gone by now
            remove_unused(old)
    while True:
        folder = Path(tempfile.mkdtemp(prefix=PREFIX, dir=place))
        handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
        fcntl.flock(handle, fcntl.LOCK_EX)
        if folder.exists():
            return folder, handle
        os.close(handle)  # another start took it for unused before it was locked


def short_place() -> str:
    """The folder for temporary files, /tmp if that is too long."""
    place = tempfile.gettempdir()
    return place if len(place) <= LONGEST else "/tmp"


def remove_unused(folder: Path) -> None:
    """Remove a folder if nobody has it locked. Raises OSError where it is in use, a link, or another user's."""
    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    try:
        if os.fstat(handle).st_uid == os.getuid():
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            shutil.rmtree(folder, ignore_errors=True)
    finally:
        os.close(handle)


if __name__ == "__main__":
    main()

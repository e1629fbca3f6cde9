"""A folder for Matplotlib's list of fonts where the user has none: a container's bare user id, a read-only home."""

import atexit
import os
import shutil
import tempfile
from contextlib import suppress
from pathlib import Path

SHARED_MEMORY = Path("/dev/shm")


def provide_home() -> None:
    """Names a folder in $MPLCONFIGDIR where Matplotlib would find none, and removes it at the end of this process.

    Fontconfig, which it asks for fonts, is told by $XDG_CACHE_HOME. Processes started from here share the folder: left alone,
    each would make its own list, and say so in several lines. Call it before Matplotlib is imported. Where nothing can be
    written at all, Matplotlib says so itself.
    """
    if os.environ.get("MPLCONFIGDIR") or all(map(writable, places())):
        return
    for parent in (SHARED_MEMORY, None):  # None: the usual one for temporary files, which may be the current folder
        with suppress(OSError):
            made = tempfile.mkdtemp(prefix="quadstep-", dir=parent)
            os.environ["MPLCONFIGDIR"] = made
            if not writable(places()[-1]):
                os.environ["XDG_CACHE_HOME"] = made
            atexit.register(shutil.rmtree, made, ignore_errors=True)
            return


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
    there = next(path for path in (folder, *folder.absolute().parents) if path.exists())
    return there.is_dir() and os.access(there, os.W_OK | os.X_OK)

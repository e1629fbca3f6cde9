"""A folder for what Matplotlib and multiprocessing must write, for users without a home or a folder for temporary files.

So it is in a container with a bare user id on a read-only system.
"""

import os
import shutil
import tempfile
from contextlib import suppress
from multiprocessing.util import Finalize
from pathlib import Path

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
    there = next(path for path in (folder, *folder.absolute().parents) if path.exists())
    return there.is_dir() and os.access(there, os.W_OK | os.X_OK)

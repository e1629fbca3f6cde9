"""Compiled code kept between runs, so that only the first flight of a kind waits for the compiler.

What is read here is executed. So the folder, everything above it and every entry must be out of other users' reach: theirs
would be code that runs as this user. Otherwise nothing is read or written, and a warning says why.
"""

import contextlib
import hashlib
import logging
import os
import shlex
import stat
from pathlib import Path

from quadstep.io.files import replace_file

MOST_ENTRIES = 1024
"""Beyond this number (about 70 kB each), those are deleted that were not used for longest: an eighth, so that a full cache is
not searched for them at every write.
"""

log = logging.getLogger(__name__)
warned: set[str] = set()
"""Warnings already given in this process."""


def folder() -> Path | None:
    """The cache folder: $QUADSTEP_CACHE, else quadstep/ in the user's cache folder; None for a user without a home."""
    chosen = os.environ.get("QUADSTEP_CACHE")
    if chosen:
        return Path(chosen)
    try:
        home = Path(os.environ.get("XDG_CACHE_HOME", ""))
        if not home.is_absolute():  # unset, or to be ignored by the XDG Base Directory Specification
            home = Path("~/.cache").expanduser()
    except RuntimeError:  # neither $HOME nor an entry in the list of users, as in a container with a bare user id
        return None
    return home / "quadstep"


def key(*parts: str) -> str:
    """A name for the code generated from these texts."""
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()


def read(name: str) -> bytes | None:
    """The code cached under `name`, or None; a damaged entry, or one that another user could have written, counts as none."""
    try:
        place = trusted_folder()
        content = own_content(place / name) if place else b""
    except OSError:
        return None
    digest, code = content[:32], content[32:]
    if place is None or signature(name, code) != digest:
        return None
    with contextlib.suppress(OSError):  # of a folder that cannot be written
        os.utime(place / name, follow_symlinks=False)
    return code


def write(name: str, code: bytes) -> None:
    """Cache `code` under `name`. A cache that cannot be written is not an error: the next run compiles again."""
    with contextlib.suppress(OSError):
        place = trusted_folder(make=True)
        if place is None:
            return
        replace_file(place / name, signature(name, code) + code, mode=0o600)
        entries = [path for path in place.iterdir() if len(path.name) == 64]
        if len(entries) > MOST_ENTRIES:
            for old in sorted(entries, key=lambda path: path.stat().st_mtime)[: -(7 * MOST_ENTRIES // 8)]:
                old.unlink(missing_ok=True)


def signature(name: str, code: bytes) -> bytes:
    """Digest of an entry and its name, so that neither damage nor a changed name goes unnoticed."""
    return hashlib.sha256(name.encode() + b"\0" + code).digest()


def trusted_folder(make: bool = False) -> Path | None:
    """The folder with every link resolved, or None where another user may change it. make: whether to make it if absent.

    Resolved once: no folder on the resolved path can be replaced by another user between this check and the use.
    Raises OSError where the folder is absent or cannot be made.
    """
    chosen = folder()
    if chosen is None:
        return None
    place = Path(os.path.realpath(chosen))
    absent = [path for path in (place, *place.parents) if not path.exists()] if make else []
    for path in reversed(absent):
        path.mkdir(mode=0o700, exist_ok=True)
    for path in (place, *place.parents):
        status = path.lstat()  # never the target of a link put there in the meantime
        reason = exposure(status, sticky_is_safe=path != place)
        if reason:
            cure = f"run `chmod go-w {shlex.quote(str(path))}` or " if status.st_uid == os.geteuid() else ""
            text = f"compiled code is not cached: {path} {reason}, who could plant code that you would run; {cure}set "
            if text not in warned:
                warned.add(text)
                log.warning("quadstep: warning: %sQUADSTEP_CACHE to a folder of your own", text)
            return None
    return place


def exposure(status: os.stat_result, sticky_is_safe: bool = False) -> str:
    """Why someone other than root and this user could change a file of this status; empty if nobody could.

    sticky_is_safe: whether a folder like /tmp will do, where everyone may add files but not rename other users' files.
    """
    if status.st_uid not in (0, os.geteuid()):
        return f"belongs to another user (id {status.st_uid})"
    exposed = status.st_mode & (stat.S_IWGRP | stat.S_IWOTH)  # with an access list, the group's bit covers all it names
    if exposed and not (sticky_is_safe and status.st_mode & stat.S_ISVTX):
        return f"may be written by {'all users' if exposed & stat.S_IWOTH else 'its group'}"
    return ""


def own_content(path: Path) -> bytes:
    """An entry's content. Raises OSError if it is absent, not a plain file, or one that another user could have written."""
    handle = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
    with os.fdopen(handle, "rb") as file:
        status = os.fstat(handle)
        if not stat.S_ISREG(status.st_mode) or exposure(status):
            raise PermissionError(path)
        return file.read()

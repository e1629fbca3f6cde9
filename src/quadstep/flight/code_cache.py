"""Compiled code kept between runs, so that only the first flight of a kind waits for the compiler."""

import contextlib
import hashlib
import os
import tempfile
from pathlib import Path

MOST_ENTRIES = 64
"""Older entries are deleted beyond this number (about 100 kB each)."""


def folder() -> Path:
    """Where code is kept: $QUADSTEP_CACHE, else quadstep/ in the user's cache folder."""
    chosen = os.environ.get("QUADSTEP_CACHE")
    if chosen:
        return Path(chosen)
    home = os.environ.get("XDG_CACHE_HOME") or Path("~/.cache").expanduser()
    return Path(home) / "quadstep"


def key(*parts: str) -> str:
    """A name for code that follows from these texts."""
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()


def read(name: str) -> bytes | None:
    """The code kept under `name`, or None; a damaged entry counts as none."""
    try:
        content = (folder() / name).read_bytes()
    except OSError:
        return None
    digest, code = content[:32], content[32:]
    return code if hashlib.sha256(code).digest() == digest else None


def write(name: str, code: bytes) -> None:
    """Keep `code` under `name`. A cache that cannot be written is no error: the next run compiles again."""
    with contextlib.suppress(OSError):
        folder().mkdir(parents=True, exist_ok=True)
        handle, temporary = tempfile.mkstemp(dir=folder(), prefix=".writing-")
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(hashlib.sha256(code).digest() + code)
            Path(temporary).replace(folder() / name)
        finally:
            Path(temporary).unlink(missing_ok=True)
        entries = sorted((path for path in folder().iterdir() if len(path.name) == 64), key=lambda path: path.stat().st_mtime)
        for old in entries[:-MOST_ENTRIES]:
            old.unlink(missing_ok=True)

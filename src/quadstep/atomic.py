"""Writing a file so that its place holds the whole of it or what was there before, never half."""

import os
import tempfile
from pathlib import Path

WRITING = ".writing-"
"""Start of the name of a file or folder that is being written; one may be left by a killed run."""


def replace_file(path: Path, content: bytes, mode: int = 0o644, synced: bool = False) -> None:
    """Write a file beside its place and move it there. synced: it must be on the disk by then. Raises OSError."""
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=WRITING)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
            if synced:
                file.flush()
                os.fsync(file.fileno())
        Path(temporary).chmod(mode)
        Path(temporary).replace(path)
    finally:
        Path(temporary).unlink(missing_ok=True)

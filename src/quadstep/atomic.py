"""Writing a file so that its place holds the whole of it or what was there before, never half."""

import os
import tempfile
from pathlib import Path

from quadstep.errors import UserError

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


def write_beside(path: Path, text: str, parents: bool = False) -> None:
    """`replace_file` for text. parents: whether to make the folder where it is absent. Raises UserError."""
    try:
        if parents:
            path.parent.mkdir(parents=True, exist_ok=True)
        replace_file(path, text.encode())
    except OSError as error:
        raise UserError(f"{path}: cannot be written: {error.strerror or error}") from None

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


def refuse_other(path: Path, text: str | None, overwrite: bool) -> None:
    """Refuses to replace an existing file, unless it holds this text already. Raises UserError."""
    if overwrite or not path.exists():
        return
    if path.is_dir():
        raise UserError(f"{path}: is a folder; name a file")
    if text is None or path.stat().st_size != len(text.encode()) or path.read_bytes() != text.encode():
        raise UserError(f"{path}: exists; replace it with --overwrite, or name another file with --out")


def write_beside(path: Path, text: str, parents: bool = False) -> None:
    """`replace_file` for text. parents: whether to make the folder where it is absent. Raises UserError."""
    try:
        if parents:
            path.parent.mkdir(parents=True, exist_ok=True)
        replace_file(path, text.encode())
    except OSError as error:
        raise UserError(f"{path}: cannot be written: {error.strerror or error}") from None

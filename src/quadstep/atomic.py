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


def check_place(path: Path, parents: bool = False) -> None:
    """Refuses a place where no file can be written, by writing one without a name. parents: whether the folder may be absent.

    Raises UserError.
    """
    try:
        if path.is_dir():
            raise UserError(f"{path}: is a folder; name a file")
        if path.exists() and not path.is_file():
            raise UserError(f"{path}: cannot be written: not a regular file")
        folder = next(one for one in path.absolute().parents if one.exists()) if parents else path.parent
        if not folder.is_dir():
            raise UserError(f"{path}: cannot be written: no folder {folder}")
        tempfile.TemporaryFile(dir=folder).close()
    except OSError as error:
        raise UserError(f"{path}: cannot be written: {error.strerror or error}") from None


def refuse_other(path: Path, text: str | None, overwrite: bool) -> None:
    """Refuses a place that cannot be written, and to replace an existing file, unless it holds this text already.

    Raises UserError.
    """
    check_place(path)
    if overwrite or not path.exists():
        return
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

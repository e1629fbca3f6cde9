"""Writing a file so that its place holds the whole of it or what was there before, never half."""

import contextlib
import os
import secrets
import tempfile
from pathlib import Path

from quadstep.io.errors import UserError

WRITING = ".writing-"
"""Start of the name of a file or folder that is being written; one may be left by a killed run."""


WRITTEN: list[str] = []
"""Files and folders of results written since the command began, for what is said where it is interrupted."""


def replace_file(path: Path, content: bytes, mode: int = 0o644, synced: bool = False) -> None:
    """Write a file beside its place and move it there. synced: it must be on the disk by then. Raises OSError."""
    folder = os.open(path.parent, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        replace_in(folder, path.name, content, mode, synced)
    finally:
        os.close(folder)


def replace_in(folder: int, name: str, content: bytes, mode: int = 0o644, synced: bool = False) -> None:
    """`replace_file` in an open folder; a link of this name is replaced, not followed. Raises OSError."""
    temporary = f"{WRITING}{secrets.token_hex(8)}"
    try:
        handle = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600, dir_fd=folder)
        with os.fdopen(handle, "wb") as file:
            file.write(content)
            file.flush()
            os.fchmod(handle, mode)
            if synced:
                os.fsync(handle)
        os.replace(temporary, name, src_dir_fd=folder, dst_dir_fd=folder)
        if synced:
            os.fsync(folder)
    finally:
        with contextlib.suppress(OSError):
            os.unlink(temporary, dir_fd=folder)


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
        WRITTEN.append(str(path))
    except OSError as error:
        raise UserError(f"{path}: cannot be written: {error.strerror or error}") from None

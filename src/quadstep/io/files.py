"""Reading and writing files. Input: regular files only, none larger than its kind allows; a pipe or a device might never
end.

Output: a file appears whole, or what was there before stays; never half of it.
"""

import contextlib
import csv
import io
import os
import secrets
import stat
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple, TextIO

from quadstep.io.errors import UserError


class FileKind(NamedTuple):
    """A kind of file. most: bytes that it may have."""

    what: str
    most: int


TOML = FileKind("a TOML file", 2_000_000)
"""100,000 values of a campaign's grid fit; reading the worst of this size takes some seconds and 350 MB."""

JSON = FileKind("a JSON file", 16_000_000)
RECORDING = FileKind("a recording", 100_000_000)
LOG = FileKind("a log", 400_000_000)
"""500,000 rows, which is the longest log, of 40 columns."""

FLIGHTS = FileKind("a file of flights", 1_000_000_000)
PAGE = FileKind("a page", 400_000_000)
STORY = FileKind("a story", 200_000)
PYTHON = FileKind("a Python file", 2_000_000)
ANY = LOG
"""Whatever a mission may name."""

LONGEST_LINE = 65_536
"""Characters of a line in a table."""


def opened(path: Path, kind: FileKind, links: bool = True, folder: int | None = None) -> io.BufferedReader:
    """A file opened for reading. links: whether `path` may be a link. folder: an open handle of the folder it is in.

    Raises UserError naming the file where it cannot be opened, is no regular file, or is larger than `kind` may be.
    """
    flags = os.O_RDONLY | os.O_NONBLOCK | os.O_NOCTTY | os.O_CLOEXEC | (0 if links else os.O_NOFOLLOW)
    name = path if folder is None else path.name
    try:
        found = os.stat(name, dir_fd=folder, follow_symlinks=links)
        check(path, found, kind)  # before it is opened: to open some devices is to use them
        file: io.BufferedReader = io.BufferedReader(io.FileIO(os.open(name, flags, dir_fd=folder)))
    except OSError as error:
        missing = isinstance(error, FileNotFoundError)
        why = "file not found" if missing else f"cannot be read: {error.strerror or error}"
        raise UserError(f"{path}: {why}") from None
    except ValueError:  # NUL and halves of surrogate pairs
        raise UserError(f"{path}: cannot be read: no file can have this name") from None
    try:
        check(path, os.fstat(file.fileno()), kind)
    except UserError:
        file.close()
        raise
    return file


def check(path: Path, status: os.stat_result, kind: FileKind) -> None:
    """Refuses anything but a regular file, and one that is too large. Raises UserError."""
    if not stat.S_ISREG(status.st_mode):
        names = {stat.S_IFDIR: "a folder", stat.S_IFIFO: "a pipe", stat.S_IFSOCK: "a socket", stat.S_IFLNK: "a link"}
        found = names.get(stat.S_IFMT(status.st_mode), "a device")
        raise UserError(f"{path}: cannot be read: it is {found}; {kind.what} must be a regular file")
    if status.st_size > kind.most:
        raise too_large(path, kind)


def too_large(path: Path, kind: FileKind) -> UserError:
    return UserError(f"{path}: too large; {kind.what} may have at most {kind.most / 1e6:g} MB")


def read_bytes(path: Path, kind: FileKind, links: bool = True) -> bytes:
    """All bytes of a file. Raises UserError as `opened` does, also for a file that grows while it is read."""
    with opened(path, kind, links) as file:
        return content_of(file, path, kind)


def content_of(file: io.BufferedReader, path: Path, kind: FileKind) -> bytes:
    """All bytes of an open file. Raises UserError."""
    try:
        found = file.read(kind.most + 1)
    except OSError as error:
        raise UserError(f"{path}: cannot be read: {error.strerror or error}") from None
    if found is None or len(found) > kind.most:
        raise too_large(path, kind)
    return found


def read_text(path: Path, kind: FileKind, links: bool = True) -> str:
    """The text of a file in UTF-8, line ends as they are. Raises UserError as `read_bytes` does, and for other bytes."""
    try:
        return read_bytes(path, kind, links).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise UserError(f"{path}: not a text file in UTF-8; text in another encoding has to be saved as UTF-8") from None


def is_file(path: Path) -> bool:
    """Whether there is a regular file of this name, however odd the name."""
    try:
        return path.is_file()
    except OSError:  # a name too long
        return False


@contextlib.contextmanager
def table(path: Path, kind: FileKind, links: bool = True) -> Iterator[Iterator[str]]:
    """The lines of a table in UTF-8, one by one, while the block runs.

    Raises UserError as `opened` does, and where a line is longer than `LONGEST_LINE`; ValueError for other bytes.
    """
    with opened(path, kind, links) as file, io.TextIOWrapper(file, encoding="utf-8-sig", newline="") as text:
        yield lines(path, text)


def lines(path: Path, file: TextIO) -> Iterator[str]:
    """The lines of an open table, one by one. Raises UserError for one that is longer than `LONGEST_LINE`."""
    number = 0
    while line := file.readline(LONGEST_LINE + 1):
        number += 1
        if len(line) > LONGEST_LINE:
            raise UserError(f"{path}: line {number}: longer than {LONGEST_LINE} characters, the most that a table may have")
        yield line


@contextlib.contextmanager
def rows(path: Path, kind: FileKind, what: str) -> Iterator[Iterator[tuple[int, list[str]]]]:
    """The rows of a CSV file that are not empty, each with the number of its line, while the block runs. what: it should be.

    Raises UserError as `table` does, and in the block for what is no such file.
    """
    try:
        with table(path, kind) as text:
            read = csv.reader(text)
            yield ((read.line_num, row) for row in read if row)
    except (OSError, ValueError, csv.Error):
        raise UserError(f"{path}: cannot be read as a {what}: not a text file of comma-separated values") from None


WRITING = ".writing-"
"""Start of the name of a file or folder that is being written; one may be left by a killed run."""

WRITTEN: list[str] = []
"""Files and folders of results written since the command began, for what is said where it is interrupted."""


def replace_file(path: Path, content: bytes, mode: int = 0o644) -> None:
    """Write a file beside its place and move it there. Raises OSError."""
    folder = os.open(path.parent, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        replace_in(folder, path.name, content, mode)
    finally:
        os.close(folder)


def replace_in(folder: int, name: str, content: bytes, mode: int = 0o644, synced: bool = False) -> None:
    """`replace_file` in an open folder; a link of this name is replaced, not followed. synced: the file must be on the disk by
    then. Raises OSError.
    """
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
        if ".." in path.parts and not path.parent.exists():  # making the folder would turn this into another place
            folder = path.parent
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

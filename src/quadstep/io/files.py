"""Input files: only regular ones, none larger than its kind allows. Reading a pipe or a device might never end."""

import contextlib
import io
import os
import stat
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
        raise UserError(f"{path}: not a text file in UTF-8") from None


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

"""A folder of results: whatever it holds, nothing outside it is written or removed.

Every part of a name is opened from the one before it, and links are not followed: one that leads elsewhere may have been put
there by whoever made the folder. The folder's own path is the user's, who may have named a link.
"""

import contextlib
import errno
import fcntl
import io
import os
import secrets
import shutil
import stat
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path, PurePosixPath

from quadstep.io import files
from quadstep.io.errors import UserError
from quadstep.io.files import WRITING, replace_in

OPENED = os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC
RUNNING = f"{WRITING}kept"
"""Where the parts of a comparison are before it is over; the other names that begin with `WRITING` go with their run."""


def parts_of(name: str) -> tuple[str, ...]:
    """The parts of a name in a folder. Raises OSError for one that leads out of it."""
    path = PurePosixPath(name)
    with contextlib.suppress(UnicodeEncodeError):
        if not path.is_absolute() and path.parts and ".." not in path.parts and b"\0" not in os.fsencode(name):
            return path.parts
    raise OSError(errno.EINVAL, f"{name!r:.60} is not the name of a file in a folder of results")


def names_in(listed: object) -> list[str]:
    """The names of a list in a manifest that can be those of files in its folder."""
    found = []
    for name in listed if isinstance(listed, list) else ():
        with contextlib.suppress(OSError):
            found += [name] if isinstance(name, str) and parts_of(name) else []
    return found


class Folder:
    """An open folder. path: for messages, and for what is written into one of its drafts. Made by `opened`."""

    def __init__(self, path: Path, handle: int) -> None:
        self.path, self.handle = path, handle

    @contextlib.contextmanager
    def inside(self, parts: Sequence[str], make: bool = False) -> Iterator[int]:
        """The handle of a folder in it. make: whether to make what is absent. Raises OSError, also for a link on the way."""
        handle = os.dup(self.handle)
        try:
            for place, part in enumerate(parts, 1):
                if make:
                    with contextlib.suppress(FileExistsError):
                        os.mkdir(part, dir_fd=handle)
                try:
                    inner = os.open(part, OPENED, dir_fd=handle)
                except OSError as error:
                    if error.errno not in (errno.ENOTDIR, errno.ELOOP):
                        raise
                    raise NotADirectoryError(errno.ENOTDIR, f"{'/'.join(parts[:place])} is not a folder") from None
                os.close(handle)
                handle = inner
            yield handle
        finally:
            os.close(handle)

    def status(self, name: str) -> os.stat_result | None:
        """Of what has this name; None where nothing has, or the way to it leads over a link or a file."""
        *way, last = parts_of(name)
        try:
            with self.inside(way) as handle:
                return os.stat(last, dir_fd=handle, follow_symlinks=False)
        except OSError as error:
            if error.errno not in (errno.ENOENT, errno.ENOTDIR, errno.ENAMETOOLONG):
                raise
            return None

    def has(self, name: str) -> bool:
        """Whether there is a regular file of this name."""
        found = self.status(name)
        return found is not None and stat.S_ISREG(found.st_mode)

    def file(self, name: str, kind: files.FileKind) -> io.BufferedReader:
        """A file opened for reading. Raises UserError."""
        *way, last = parts_of(name)
        try:
            with self.inside(way) as handle:
                return files.opened(self.path.joinpath(*way, last), kind, links=False, folder=handle)
        except OSError as error:
            raise UserError(f"{self.path / name}: cannot be read: {error.strerror or error}") from None

    def read(self, name: str, kind: files.FileKind) -> bytes:
        """The bytes of a file. Raises UserError."""
        with self.file(name, kind) as file:
            return files.content_of(file, self.path / name, kind)

    def write(self, name: str, content: bytes, synced: bool = True) -> None:
        """A file, there as a whole or not at all. synced: it must be on the disk by then. Raises OSError."""
        *way, last = parts_of(name)
        with self.inside(way, make=True) as handle:
            replace_in(handle, last, content, synced=synced)

    def append(self, name: str, content: bytes) -> None:
        """Add to the end of a file, made if absent. Raises OSError."""
        *way, last = parts_of(name)
        flags = os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC
        with self.inside(way, make=True) as handle, os.fdopen(os.open(last, flags, 0o644, dir_fd=handle), "ab") as file:
            file.write(content)

    def unwritable(self, error: OSError, kept: str) -> UserError:
        """The error for a folder that takes nothing more. kept: what is in it, and how to go on."""
        if os.fstat(self.handle).st_nlink == 0:
            return UserError(f"{self.path}: was deleted, or replaced, while results were written into it; none are kept")
        return UserError(f"{self.path}: cannot be written: {error.strerror or error}; {kept}")

    def names(self, inner: str = "") -> list[str]:
        """What it, or a folder in it, contains. Raises OSError."""
        with self.inside(parts_of(inner) if inner else ()) as handle:
            return sorted(os.listdir(handle))  # noqa: PTH208 (of an open folder)

    def files(self) -> list[str]:
        """All regular files in it, below folders too. Raises OSError."""
        found = []
        for way, _, names, handle in os.fwalk(".", dir_fd=self.handle):
            regular = [one for one in names if stat.S_ISREG(os.stat(one, dir_fd=handle, follow_symlinks=False).st_mode)]
            found += [PurePosixPath(way, one).as_posix() for one in regular]
        return sorted(found)

    def remove(self, name: str) -> None:
        """A file or a link, and the folders that it leaves empty. What is absent, or a folder, is no error. Raises OSError."""
        *way, last = parts_of(name)
        found = self.status(name)
        if found is None or stat.S_ISDIR(found.st_mode):
            return
        with self.inside(way) as handle:
            os.unlink(last, dir_fd=handle)
        for place in range(len(way), 0, -1):
            self.remove_empty("/".join(way[:place]))

    def move(self, name: str, new: str) -> None:
        """Give what is directly in it another name. Raises OSError."""
        os.rename(name, new, src_dir_fd=self.handle, dst_dir_fd=self.handle)

    def remove_empty(self, name: str) -> None:
        *way, last = parts_of(name)
        with contextlib.suppress(OSError), self.inside(way) as handle:
            os.rmdir(last, dir_fd=handle)

    def remove_tree(self, name: str) -> None:
        """What has this name, a folder with all in it too, as far as it can be removed. A link is removed, not followed."""
        found = self.status(name)
        with contextlib.suppress(OSError):
            if found is not None and not stat.S_ISDIR(found.st_mode):
                self.remove(name)
        *way, last = parts_of(name)
        with contextlib.suppress(OSError), self.inside(way) as handle:
            shutil.rmtree(last, ignore_errors=True, dir_fd=handle)

    def sweep(self, *inner: str) -> None:
        """Remove what killed runs were writing, here and in these folders, as far as possible. The folder must be locked."""
        for way in ("", *inner):
            with contextlib.suppress(OSError):
                left = [name for name in self.names(way) if name.startswith(WRITING) and name != RUNNING]
                for name in (f"{way}/{name}" if way else name for name in left):
                    with contextlib.suppress(OSError), self.unused(name):
                        self.remove_tree(name)

    def is_folder(self, name: str) -> bool:
        found = self.status(name)
        return found is not None and stat.S_ISDIR(found.st_mode)

    @contextlib.contextmanager
    def unused(self, name: str) -> Iterator[None]:
        """A block that is entered if no run is writing into the folder of this name. Raises OSError where one is."""
        with contextlib.ExitStack() as stack:
            if self.is_folder(name):
                fcntl.flock(stack.enter_context(self.inside(parts_of(name))), fcntl.LOCK_EX | fcntl.LOCK_NB)
            yield

    @contextlib.contextmanager
    def locked(self, wait: bool = True) -> Iterator[None]:
        """One run at a time. Raises BlockingIOError where another has it and this does not wait."""
        fcntl.flock(self.handle, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
        try:
            yield
        finally:
            fcntl.flock(self.handle, fcntl.LOCK_UN)

    @contextlib.contextmanager
    def draft(self) -> Iterator["Folder"]:
        """A temporary folder in it, whose files `take` moves into place; removed in the end. Make it while locked."""
        name = f"{WRITING}{secrets.token_hex(8)}"  # named before it is made: Ctrl-C may come at any moment
        try:
            os.mkdir(name, 0o700, dir_fd=self.handle)
            with self.inside([name]) as handle:
                fcntl.flock(handle, fcntl.LOCK_EX)
                yield Folder(self.path / name, handle)
        finally:
            self.remove_tree(name)

    def check_free(self, names: Iterable[str]) -> None:
        """Refuses names of files that cannot be put there: folders, and others below what is none. Raises OSError."""
        for name in names:
            if self.is_folder(name):
                raise IsADirectoryError(errno.EISDIR, f"{name} is a folder")
            with contextlib.suppress(FileNotFoundError), self.inside(parts_of(name)[:-1]):
                pass

    def take(self, draft: "Folder", names: Iterable[str], last: str) -> None:
        """Move files of a draft into place, replacing what is there; the one that is to come last, last. Raises OSError."""
        for name in sorted(names, key=lambda name: name == last):
            *way, file = parts_of(name)
            with draft.inside(way) as source, self.inside(way, make=True) as target:
                os.replace(file, file, src_dir_fd=source, dst_dir_fd=target)


@contextlib.contextmanager
def alone_in(path: Path, inner: str = "") -> Iterator[Folder]:
    """A folder, made if absent, that one run has for itself by a lock on it or on this folder in it. Raises UserError."""
    with contextlib.ExitStack() as stack:
        try:
            folder = stack.enter_context(opened(path))
            lock = folder
            if inner:
                handle = stack.enter_context(folder.inside([inner], make=True))
                stack.callback(folder.remove_empty, inner)
                lock = Folder(path / inner, handle)
            stack.enter_context(lock.locked(wait=False))
        except BlockingIOError:
            raise UserError(f"{path}: another run is writing into this folder; choose another --out") from None
        except OSError as error:
            raise UserError(f"{path}: cannot be written: {error.strerror or error}") from None
        yield folder


@contextlib.contextmanager
def opened(path: Path) -> Iterator[Folder]:
    """A folder, made if absent; what was made and is empty in the end is removed. Raises OSError, UserError for a file."""
    if path.exists() and not path.is_dir():
        raise UserError(f"{path}: is a file; --out needs a folder")
    made = [one for one in (path, *path.parents) if not one.exists()]
    try:
        path.mkdir(parents=True, exist_ok=True)
        handle = os.open(path, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
        try:
            yield Folder(path, handle)
        finally:
            os.close(handle)
    finally:
        for one in made:
            with contextlib.suppress(OSError):
                one.rmdir()

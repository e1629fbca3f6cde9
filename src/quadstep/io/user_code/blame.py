"""What went wrong in a user's file, in one line: file, line, what, and the line's text."""

import linecache
import sys
import traceback
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from types import TracebackType
from typing import TextIO

from quadstep.io.errors import UserError, cut

FILES: set[str] = set()
"""Files of users that were run in this process."""

NAMED: set[str] = set()
"""What missions named of these, as they wrote it."""


whole = False
"""Whether tracebacks are printed."""

printed: set[str] = set()
"""Those that were."""


def print_whole() -> None:
    """From now on the traceback of each error is printed, once."""
    global whole  # noqa: PLW0603 (a policy of the process)
    whole = True


def warn_of_users_only() -> None:
    """From now on Python shows warnings of users' files alone, unless it was told which to show, by -W or $PYTHONWARNINGS:
    nobody else can act on those of libraries. What a result is warned of, its command says itself.
    """
    if not sys.warnoptions:
        warnings.showwarning = show_of_users


def show_of_users(
    message: Warning | str,
    category: type[Warning],
    filename: str,
    lineno: int,
    file: TextIO | None = None,
    line: str | None = None,
) -> None:
    """What Python calls to show a warning."""
    if filename in FILES:
        (file or sys.stderr).write(warnings.formatwarning(message, category, filename, lineno, line))


def user_error(error: BaseException, named: str = "") -> UserError:
    """The error as one line. named: what to name if no line of a user's file is to blame."""
    if whole:
        said_before, text = len(printed), "".join(traceback.format_exception(error))
        printed.add(text)
        if len(printed) > said_before:
            sys.stderr.write(text)
    found = blamed(error)
    if found is None:
        return UserError(f"{named}: {said_of(error)}")
    file, line, said = found
    text = linecache.getline(file, line).strip()
    return UserError(f"{file}:{line}: {said}" + (f"; the line: {cut(text, 200)}" if text else ""))


@contextmanager
def in_one_line() -> Iterator[None]:
    """A block in which an error in a user's file is a UserError."""
    try:
        yield
    except Exception as error:
        if isinstance(error, UserError) or blamed(error) is None:
            raise
        raise user_error(error) from error


def blamed(error: BaseException) -> tuple[str, int, str] | None:
    """The innermost line of a user's file that led to an error, and what is said; None for an error that is not the user's."""
    for one in chain(error):
        said = said_of(one)
        if isinstance(one, SyntaxError) and one.filename in FILES:
            return str(one.filename), one.lineno or 0, said
        for frame in reversed(list(frames(one.__traceback__))):
            if frame.filename in FILES:
                return frame.filename, frame.lineno or 0, said
    return None


def said_of(error: BaseException) -> str:
    """What an error says, and of which type it is."""
    try:
        said = str(error.msg if isinstance(error, SyntaxError) else error)
    except Exception:
        said = ""
    if isinstance(error, ImportError) and str(error.name).partition(".")[0] == "quadstep":
        said += "; what your own code needs is in quadstep.own (docs/extending.md)"
    return f"{type(error).__name__}: {said}" if said else type(error).__name__


def chain(error: BaseException | None) -> Iterator[BaseException]:
    """An error, and those it came from."""
    seen: set[int] = set()
    while error is not None and id(error) not in seen:
        seen.add(id(error))
        yield error
        error = error.__cause__ or error.__context__


def frames(trace: TracebackType | None) -> Iterator[traceback.FrameSummary]:
    yield from traceback.extract_tb(trace)

"""Standard output and standard error as they really are: closed, full, ASCII only, or with a reader who left early."""

import codecs
import errno
import io
import os
import select
import sys
from typing import Any, TextIO

from rich.cells import cell_len

LEFT = (errno.EPIPE, errno.EIO)
"""What a stream says whose reader has had enough, or whose terminal was closed."""


class OutputError(Exception):
    """Standard output accepts no more, for another reason than a reader that left: a full disk."""


class Outlet(io.RawIOBase):
    """Writes to a descriptor for as long as it accepts output; after that, output is dropped.

    required: whether to raise OutputError, once, where something would be lost that the reader still expects.
    """

    def __init__(self, descriptor: int, required: bool) -> None:
        self.descriptor, self.required, self.over = descriptor, required, False

    def fileno(self) -> int:
        return self.descriptor

    def isatty(self) -> bool:
        return os.isatty(self.descriptor)

    def writable(self) -> bool:
        return True

    def write(self, data: Any) -> int:
        while not self.over:
            try:
                return os.write(self.descriptor, data)
            except BlockingIOError:  # another program has made the terminal non-blocking
                select.select([], [self.descriptor], [])
            except OSError as error:
                self.over = True
                if self.required and error.errno not in LEFT:
                    raise OutputError(f"standard output: {error.strerror or error}") from None
        return len(data)


def question_marks(error: UnicodeError) -> tuple[str, int]:
    """What a stream's encoding does not have, as question marks of the same width, so that columns stay in line."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    missing = error.object[error.start : error.end]
    return "?" * sum(max(1, cell_len(character)) for character in missing), error.end


codecs.register_error("quadstep-question-marks", question_marks)


def prepare_streams() -> None:
    """Replace the interpreter's own streams by ones that never end in a traceback; streams that are captured stay.

    A closed descriptor is opened on nothing first: a results file must not become the standard output of a library.
    """
    for descriptor in range(3):
        try:
            os.fstat(descriptor)
        except OSError:
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)
    if sys.stdout is sys.__stdout__:
        sys.stdout = stream(sys.stdout, Outlet(1, required=True))
    if sys.stderr is sys.__stderr__:
        sys.stderr = stream(sys.stderr, Outlet(2, required=False))


def stream(before: TextIO | None, outlet: Outlet) -> io.TextIOWrapper:
    """A text stream in the encoding of the one before it."""
    encoding = before.encoding if before else "utf-8"
    return io.TextIOWrapper(io.BufferedWriter(outlet), encoding, errors="quadstep-question-marks", line_buffering=True)

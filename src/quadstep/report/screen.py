"""Lines on standard output and standard error, and tables that fit: side by side where every column can be read, else as
blocks of `name: value`.

Either may be closed, full, ASCII only, or have a reader that left early.
"""

import codecs
import errno
import io
import os
import select
import shlex
import sys
import textwrap
import unicodedata
from collections.abc import Sequence
from typing import Any, TextIO

from rich import box
from rich.cells import cell_len
from rich.console import Console
from rich.table import Table
from rich.text import Text

from quadstep.io.errors import one_line, visible
from quadstep.report.units import typed

BIDIRECTIONAL = ("LRE", "RLE", "LRO", "RLO", "PDF", "LRI", "RLI", "FSI", "PDI")
REDIRECTED, UNKNOWN, LEAST = 120, 80, 20
"""Columns: of a file or pipe, of a terminal that does not say, and of the narrowest terminal that is served."""


def width(stream: TextIO) -> int:
    """Columns of a stream; COLUMNS decides where it is set."""
    said = os.environ.get("COLUMNS", "")
    if said.isdecimal() and int(said):
        return max(int(said), LEAST)
    if not stream.isatty():
        return REDIRECTED
    try:
        columns = os.get_terminal_size(stream.fileno()).columns
    except OSError:
        columns = 0
    return max(columns or UNKNOWN, LEAST)


def console(stream: TextIO | None = None) -> Console:
    """Where tables and bars are drawn. Names of missions are text, not markup."""
    file = stream or sys.stdout
    return Console(file=file, width=width(file), highlight=False, markup=False, emoji=False)


def plain(text: str) -> str:
    """Text in which nothing speaks to the terminal: no escape sequences, no change of the direction of writing."""
    return "".join(visible(c) if c != "\n" and speaks(c) else c for c in text)


def speaks(character: str) -> bool:
    """Whether a character is none to be read, but tells the terminal something."""
    return unicodedata.category(character) in ("Cc", "Zl", "Zp") or unicodedata.bidirectional(character) in BIDIRECTIONAL


def typeset(text: str) -> str:
    """Names and numbers as people write them, where the encoding of standard output has the letters."""
    better = typed(text)
    try:
        better.encode(sys.stdout.encoding or "ascii")
    except UnicodeEncodeError:
        return text
    return better


def say(text: str, style: str = "") -> None:
    """A sentence, broken between words where a terminal ends, never in a file."""
    columns = width(sys.stdout) if sys.stdout.isatty() else sys.maxsize
    lines = textwrap.fill(plain(text), columns, break_long_words=False, break_on_hyphens=False)
    console().print(Text(lines, style=style), soft_wrap=True)


def say_whole(text: str) -> None:
    """A line that holds something to copy, a path or a command: never broken."""
    console().print(plain(text), soft_wrap=True)


def complain(line: str) -> None:
    sys.stderr.write(f"quadstep: {one_line(line)}\n")
    sys.stderr.flush()


def command(*arguments: object) -> str:
    """What to type: `quadstep` with these arguments, quoted for a shell."""
    return shlex.join(["quadstep", *map(str, arguments)])


KEY, PROSE, GAP = 28, 24, 2
"""Up to this width the first and any other column is never broken; beyond it, between words only. GAP: between columns."""


def show_table(title: str, header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table. The first column holds the keys: they are never cut. title: may be empty."""
    cells = [[plain(cell) for cell in row] for row in rows]
    if title:
        say(title, "bold")
    widths = fitted([header, *cells], console().width)
    if widths is None:
        show_blocks(header, cells)
        return
    broken = sum(any(cell_len(cell) > width for cell, width in zip(row, widths, strict=True)) for row in cells)
    table = Table(
        box=box.SIMPLE_HEAD, show_edge=False, pad_edge=False, padding=(0, GAP - 1, 0, 0), leading=int(2 * broken > len(cells))
    )
    for name, width in zip(header, widths, strict=True):
        table.add_column(name, width=width)
    for row in cells:
        table.add_row(*row)
    screen = console()
    with screen.capture() as drawn:
        screen.print(table)
    screen.file.write("\n".join(line.rstrip() for line in drawn.get().splitlines()) + "\n")
    say("")


def fitted(rows: Sequence[Sequence[str]], columns: int) -> list[int] | None:
    """The width of each column of a table on a screen of this many columns; None where it cannot be read on one."""
    spare = columns + GAP
    natural, least = [], []
    for place, cells in enumerate(zip(*rows, strict=True)):
        natural.append(max(1, *map(cell_len, cells)))
        words = max(1, *(cell_len(word) for cell in cells for word in cell.split()), 1)
        whole = PROSE if place else KEY
        least.append(natural[-1] if natural[-1] <= whole else max(words, whole))
        spare -= least[-1] + GAP
    if spare < 0:
        return None
    widths = list(least)
    wanting = sorted((natural[i] - least[i], i) for i in range(len(least)) if natural[i] > least[i])
    for place, (lacking, i) in enumerate(wanting):
        more = min(lacking, spare // (len(wanting) - place))
        widths[i] += more
        spare -= more
    return widths


def show_blocks(header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Each row as its key and a line for each value."""
    screen = console()
    wrapper = textwrap.TextWrapper(
        screen.width, initial_indent="  ", subsequent_indent="    ", break_long_words=False, break_on_hyphens=False
    )
    for row in rows:
        say("")
        screen.print(Text(row[0], style="bold"), soft_wrap=True)
        for name, value in zip(header[1:], row[1:], strict=True):
            if value:
                screen.print(wrapper.fill(f"{name}: {value}"), soft_wrap=True)
    say("")


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

"""Lines on standard output and standard error."""

import os
import shlex
import sys
import textwrap
import unicodedata
from typing import TextIO

from rich.console import Console

from quadstep.io.errors import one_line, visible
from quadstep.report.symbols import typed

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


def say(text: str) -> None:
    """A sentence, broken between words where a terminal ends, never in a file."""
    columns = width(sys.stdout) if sys.stdout.isatty() else sys.maxsize
    console().print(textwrap.fill(plain(text), columns, break_long_words=False, break_on_hyphens=False), soft_wrap=True)


def say_whole(text: str) -> None:
    """A line that holds something to copy, a path or a command: never broken."""
    console().print(plain(text), soft_wrap=True)


def complain(line: str) -> None:
    sys.stderr.write(f"quadstep: {one_line(line)}\n")
    sys.stderr.flush()


def command(*arguments: object) -> str:
    """What to type: `quadstep` with these arguments, quoted for a shell."""
    return shlex.join(["quadstep", *map(str, arguments)])

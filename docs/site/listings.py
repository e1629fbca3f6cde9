"""The listings of a page: its code blocks, what kind each is, and what the page's author says of it."""

import re
import tomllib
from enum import StrEnum
from typing import NamedTuple

MARK = re.compile(r"(?<!`)<!-- (not run|instead|exit|file|given|figure|page): (.*?) -->")
"""What an author says in a comment right above a listing, or of what is shown there (`figure`, `page`).
In backquotes it is only spoken of."""

COMMANDS = (
    "quadstep ", "python", ".venv/", "make", "pip ", "docker ", "export ", "ray ", "git ", "cd ", "mkdir ", "RAY_",
    "cp ", "sed ", "cat ", "ls ", "cmp ", "eval ", "echo ",
)  # fmt: skip
"""How a line of a shell listing begins."""


class Kind(StrEnum):
    """What a listing is written in."""

    SHELL = "bash"
    TOML = "toml"
    PYTHON = "python"
    TEXT = "text"
    """Formulas, pictures, output, other people's formats: nothing of ours runs it."""


LANGUAGES = {"sh": Kind.SHELL, "bash": Kind.SHELL, "shell": Kind.SHELL, "toml": Kind.TOML, "python": Kind.PYTHON}


class Listing(NamedTuple):
    """A listing. first, last: its lines in the page, counted from 0, fences included, `last` the first one after it.

    marks: what is said of it, by the words of `MARK`.
    """

    kind: Kind
    text: str
    first: int
    last: int
    marks: dict[str, str]


def kind_of(text: str) -> Kind:
    """The kind of an indented block."""
    lines = [line for line in text.splitlines() if line.strip()]
    if lines[0].startswith(COMMANDS):
        return Kind.SHELL
    try:
        found = tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        return Kind.TEXT
    return Kind.TOML if found else Kind.TEXT


def listings(page: str) -> list[Listing]:
    """The listings of a page in order."""
    found: list[Listing] = []
    lines = page.split("\n")
    at = 0
    marks: dict[str, str] = {}
    while at < len(lines):
        line, first = lines[at], at
        if fence := re.match(r"(`{3,})(.*)$", line):
            at = lines.index(fence[1], first + 1) + 1
            if fence[2].startswith("{"):  # a directive of the site
                continue
            kind = LANGUAGES.get(fence[2], Kind.TEXT)
            text = "\n".join(lines[first + 1 : at - 1])
        elif line.startswith("    ") and (first == 0 or not lines[first - 1].strip()):
            while at < len(lines) and (lines[at].startswith("    ") or not lines[at].strip()):
                at += 1
            while not lines[at - 1].strip():
                at -= 1
            text = "\n".join(one[4:] for one in lines[first:at])
            kind = kind_of(text)
        else:
            marks |= dict(MARK.findall(line))
            if line.strip() and not MARK.search(line):
                marks = {}
            at += 1
            continue
        found.append(Listing(kind, text + "\n", first, at, marks))
        marks = {}
    return found

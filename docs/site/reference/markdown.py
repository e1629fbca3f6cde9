"""Markdown as the pages made from code need it."""

import re
from collections.abc import Iterable

SPECIAL = str.maketrans({char: f"\\{char}" for char in "\\`*_[]<>|$"})


def plain(text: str) -> str:
    """Text that means itself."""
    return text.translate(SPECIAL)


def prose(text: str) -> str:
    """A docstring's text; what it quotes stays code."""
    return "".join(part if part.startswith("`") else plain(part) for part in re.split(r"(`[^`]*`)", text.strip()))


def code(text: str) -> str:
    """Text as code, in a table too; nothing for nothing."""
    return f"`{text}`".replace("|", "\\|") if text else ""


def table(header: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """A table; cells are Markdown."""
    header = tuple(header)
    lines = [header, ("---",) * len(header), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n"

"""What was typed after a command: refused where it is empty, and said in plain words where it is wrong."""

import re
from collections.abc import Sequence

from quadstep.errors import UserError

PLAIN = (
    (r"Input should be a valid integer.*", "should be a whole number"),
    (r"Input should be a valid number.*", "should be a number"),
    (r"Input should be greater than or equal to (\S+)", r"should be at least \1"),
    (r"Input should be less than or equal to (\S+)", r"should be at most \1"),
    (r"Input should be greater than (\S+)", r"should be above \1"),
    (r"Input should be less than (\S+)", r"should be below \1"),
    (r"Value error, ", ""),
)
"""How the parser of the command line says it, and how it is said here."""


def plain(text: str) -> str:
    """What is wrong with an option, in the words of the other messages."""
    for pattern, words in PLAIN:
        text = re.sub(pattern, words, text)
    return text


def refuse_empty(arguments: Sequence[str]) -> None:
    """Refuses empty values; no command has a use for one. Raises UserError."""
    for before, given in zip(("", *arguments), arguments, strict=False):
        if not given:
            raise UserError(f"{before if before.startswith('--') else 'an argument'}: is empty")
        if given.startswith("--") and given.endswith("="):
            raise UserError(f"{given.removesuffix('=')}: is empty")

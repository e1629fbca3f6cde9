"""Errors in what was typed after a command, in plain words; and `quadstep completion`, which helps to type it."""

import re
from collections.abc import Sequence
from enum import StrEnum
from typing import Annotated

import typer
from typer.exceptions import TyperException

from quadstep.io.errors import UserError, did_you_mean, unknown_name
from quadstep.report.screen import say_whole

HELP = "; --help lists what a command takes"

WORDED = (
    (r"Missing (?:argument|option) '(.*?)'\.(?: Choose from: *(.*))?", "{0} is required{2}", "; allowed: {1}"),
    (r"Got unexpected extra argument\(?s?\)? \((.*)\)", "{0!r:.60}: not expected; the command takes no further argument", ""),
    (r"Invalid value for '.*?': [Pp]ath '(.*)' is not readable\.", "{0}: cannot be read: Permission denied", ""),
    (r"Option '(.*)' requires an argument\.", "{0}: missing its value", ""),
    (r"Option '(.*)' does not take a value\.", "{0}: takes no value", ""),
)
"""What the parser says, how it is said here, and what is added where it says more."""

NUMBERS = {"int_parsing_size": "a smaller number", "int_": "a whole number", "float_": "a number"}
"""What an option takes, by how the kind of a problem begins which says that it was given something else."""

SUCH_AS = {
    "--budget": ", for instance --budget 2000 (flights)",
    "--x": ", for instance --x disturbance.scale=0:4:5 --y path.duration=4,10,20",
    "--y": ", for instance --y path.duration=4,10,20",
}
"""Options without which a command does nothing: a value that suits many missions."""


def problem_message(error: TyperException) -> str:
    """What is wrong with the command line, as the other messages say it: which option, what is allowed, what was given."""
    from pydantic import ValidationError

    if hasattr(error, "option_name") and hasattr(error, "possibilities"):
        if error.option_name == "--version":
            return "--version: is an option of quadstep alone: quadstep --version"
        return f"unknown option {error.option_name!r:.60}{did_you_mean(error.option_name, error.possibilities or ())}"
    text = error.format_message()
    if no_command := re.match(r"No such command ['\"](.*?)['\"]\.", text, re.DOTALL):
        known = list(getattr(getattr(getattr(error, "ctx", None), "command", None), "commands", ()))
        return f"unknown command {no_command[1]!r:.60}{did_you_mean(no_command[1], known)}"
    if not isinstance(error.__cause__, ValidationError):
        return worded(text)
    problem = error.__cause__.errors(include_url=False)[0]
    named = re.match(r"Invalid value for '([^']*)'", text)
    option = named.group(1) if named else "an option"
    choice = re.fullmatch(r"Value error, .* is not one of (.*)\.", problem["msg"], re.DOTALL)
    if choice:
        names = choice.group(1).replace("'", "").split(", ")
        return f"{option}: {unknown_name('value', problem['input'], names)}"
    wanted = next((told for kind, told in NUMBERS.items() if problem["type"].startswith(kind)), problem["msg"])
    return f"{option}: should be {wanted}, not {problem['input']!r:.60}"


def worded(text: str) -> str:
    """What the parser says, as the other messages say it."""
    for pattern, said, more in WORDED:
        found = re.fullmatch(pattern, text, re.DOTALL)
        if found:
            given, *others = found.groups(default="")
            likely = " ".join("".join(others).replace("'", "").split())
            return (said + (more if likely else "")).format(given, likely, SUCH_AS.get(given, ""))
    return text


def refuse_empty(arguments: Sequence[str]) -> None:
    """Refuses empty values; no command has a use for one. Raises UserError."""
    for before, given in zip(("", *arguments), arguments, strict=False):
        if not given:
            raise UserError(f"{before if before.startswith('--') else 'an argument'}: is empty{HELP}")
        if given.startswith("--") and given.endswith("="):
            raise UserError(f"{given.removesuffix('=')}: is empty{HELP}")


VARIABLE = "_QUADSTEP_COMPLETE"
"""What a shell sets when it asks for completions."""


class Shell(StrEnum):
    """Shells that complete."""

    BASH = "bash"
    ZSH = "zsh"
    FISH = "fish"


def completion(shell: Annotated[Shell, typer.Argument(help="Which shell: bash, zsh or fish.")]) -> None:
    """Print a script that completes commands and options in a shell (docs/installing.md)."""
    from typer._completion_shared import get_completion_script

    for line in get_completion_script(prog_name="quadstep", complete_var=VARIABLE, shell=shell.value).splitlines():
        say_whole(line)

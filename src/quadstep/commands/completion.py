"""`quadstep completion`."""

from enum import StrEnum
from typing import Annotated

import typer

from quadstep.report.terminal.screen import say_whole

VARIABLE = "_QUADSTEP_COMPLETE"
"""What a shell sets when it asks for completions."""


class Shell(StrEnum):
    """Shells that complete."""

    BASH = "bash"
    ZSH = "zsh"
    FISH = "fish"


def completion(shell: Annotated[Shell, typer.Argument(help="Which shell: bash, zsh or fish.", show_default=False)]) -> None:
    """Print a script that completes commands and options in a shell (docs/installing.md)."""
    from typer._completion_shared import get_completion_script

    for line in get_completion_script(prog_name="quadstep", complete_var=VARIABLE, shell=shell.value).splitlines():
        say_whole(line)


def answer_shell() -> None:
    """Prepare for a shell that asks for completions, which the command line then answers."""
    from typer._completion_classes import completion_init

    completion_init()

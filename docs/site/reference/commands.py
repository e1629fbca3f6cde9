"""The page of the commands, from the command line itself."""

from collections.abc import Iterator
from typing import Any

import typer

from docs.site.reference.markdown import code, prose, table
from quadstep.commands import cli

HEAD = """\
# Commands

Every command with its arguments and options, made from the command line itself. `quadstep COMMAND --help` says the same.
`--no-user-code` and `--traceback` may stand anywhere on the command line.
"""


def leaves(command: Any, path: str) -> Iterator[tuple[str, Any]]:
    """Every command that can be run, with how it is typed, in the order of the help."""
    inner = getattr(command, "commands", {})
    for name in command.list_commands(None) if inner else ():
        yield from leaves(inner[name], f"{path} {name}")
    if not inner:
        yield path, command


def commands() -> list[tuple[str, Any]]:
    """Every command of quadstep."""
    return list(leaves(typer.main.get_command(cli.built()), "quadstep"))


def section(path: str, command: Any) -> str:
    """One command."""
    records = command.records(command.make_context(path, [], resilient_parsing=True))
    rows = [(code(name), prose(told)) for _, name, told in records if name != "--help"]
    body = table(("name", "meaning"), rows) if rows else "No arguments.\n"
    return f"## {path}\n\n{prose(command.help or '')}\n\n{body}"


def page() -> str:
    """The whole page."""
    return "\n".join([HEAD, *(section(path, command) for path, command in commands())])

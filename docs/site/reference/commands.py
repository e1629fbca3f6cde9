"""The page of the commands, from the command line itself."""

import re
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


def with_options(text: str) -> str:
    """A help text with the options that it names set as code, as what it quotes is already."""
    return re.sub(r"`[^`]*`|--[a-z][a-z-]*", lambda found: found[0] if found[0][0] == "`" else f"`{found[0]}`", text)


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
    rows = [(code(name), prose(with_options(told))) for _, name, told in records if name != "--help"]
    body = table(("name", "meaning"), rows) if rows else "No arguments.\n"
    return f"## {path}\n\n{prose(with_options(command.help or ''))}\n\n{body}"


def page() -> str:
    """The whole page."""
    return "\n".join([HEAD, *(section(path, command) for path, command in commands())])

"""The page of the commands, from the command line itself."""

from collections.abc import Iterator
from enum import Enum
from pathlib import Path
from typing import Any, get_args

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


KINDS: dict[type, str] = {Path: "a path", str: "text", int: "a whole number", float: "a number"}


def allowed(option: Any) -> str:
    """What an option takes, in a few words."""
    kind = option.type_descriptor.annotation
    kind, *_ = [one for one in get_args(kind) if one is not type(None)] or [kind]
    if "|" in (option.metavar or ""):
        return ", ".join(map(code, option.metavar.split("|")))
    if isinstance(kind, type) and issubclass(kind, Enum):
        return ", ".join(code(str(one.value)) for one in kind)
    if kind is bool:
        return ""
    ends = [f"{word} {end}" for word, end in (("from", option.min), ("to", option.max)) if end is not None]
    return " ".join([KINDS.get(kind, "text"), *ends]) + ("; may be repeated" if option.multiple else "")


def default(option: Any) -> str:
    """What is taken where it is left out."""
    value = option.default
    if option.required:
        return "needed"
    shown = isinstance(value, str | int | float | Path | Enum) and not isinstance(value, bool)
    return code(str(value.value if isinstance(value, Enum) else value)) if shown else ""


def section(path: str, command: Any) -> str:
    """One command."""
    rows = []
    for one in command.params:
        if one.name == "help":
            continue
        argument = one.param_type_name == "argument"
        name = code((one.metavar or one.name.upper()) if argument else ", ".join(one.opts))
        rows.append((name, prose(one.help or ""), allowed(one), default(one)))
    body = table(("name", "meaning", "takes", "if left out"), rows) if rows else "No arguments.\n"
    return f"## {path}\n\n{prose(command.help or '')}\n\n{body}"


def page() -> str:
    """The whole page."""
    return "\n".join([HEAD, *(section(path, command) for path, command in commands())])

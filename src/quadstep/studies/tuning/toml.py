"""A TOML file with a few values changed and all else left as it is: comments, order, blank lines.

If that does not give the desired content, the file is rewritten.
"""

import tomllib
from collections.abc import MutableMapping
from typing import cast

import tomlkit
from tomlkit.exceptions import TOMLKitError


def edited(text: str, old: dict[str, object], new: dict[str, object]) -> str:
    """The text, whose content is `old`, with the content `new`."""
    try:
        content = tomlkit.parse(text)
        change(content, old, new)
        changed = content.as_string()
        good = tomllib.loads(changed) == new
    except (TOMLKitError, tomllib.TOMLDecodeError):
        good = False
    return changed if good else tomlkit.dumps(new)


def change(table: MutableMapping[str, object], old: dict[str, object], new: dict[str, object]) -> None:
    """Set every value in a table that is not as it was."""
    for name, value in new.items():
        before = old.get(name)
        if isinstance(value, dict) and isinstance(before, dict):
            change(cast(MutableMapping[str, object], table[name]), before, value)
        elif name not in old or value != before:
            if isinstance(value, dict) and isinstance(table, tomlkit.TOMLDocument):
                for _ in range(1 if table.as_string().endswith("\n") else 2):
                    table.add(tomlkit.nl())  # a blank line before a new table
            table[name] = value

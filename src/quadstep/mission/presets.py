"""Vehicles in TOML: those that come with the package, and a user's own, which look the same."""

import tomllib
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

WAYS_TO_PLACE_ROTORS = ({"layout", "arm"}, {"rotors"})
"""Keys that say where the rotors are, in two ways: a table that chooses one way says nothing in the other."""

OWN_KEYS = {"preset", "file", "layout", "rotor"}
"""Keys by which a vehicle table is known to describe a real airframe: each has one of them, the paper's plant none."""

DEEPEST = 8
"""How many files may start from one another."""


def is_airframe(table: Any) -> bool:
    """Whether a vehicle table of a mission describes a real airframe and not the paper's plant."""
    return isinstance(table, dict) and bool(OWN_KEYS & table.keys())


def preset_folder() -> Traversable:
    """Where the vehicles of the package are."""
    return files("quadstep.airframe") / "presets"


def preset_names() -> list[str]:
    """The vehicles that come with the package."""
    return sorted(entry.name.removesuffix(".toml") for entry in preset_folder().iterdir() if entry.name.endswith(".toml"))


def preset_table(name: Any) -> dict[str, Any]:
    """The keys of one of them. Raises ValueError naming the others."""
    if name not in preset_names():
        raise ValueError(f"preset {name!r:.60} is not known; allowed: {', '.join(preset_names())}")
    return tomllib.loads((preset_folder() / f"{name}.toml").read_text(encoding="utf-8"))


def vehicle_table(path: Path) -> dict[str, Any]:
    """The keys of a user's own vehicle. Raises ValueError where the file cannot be read."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise ValueError(f"{path}: cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise ValueError(f"{path}: not a text file in UTF-8") from None
    except (ValueError, RecursionError) as error:
        raise ValueError(f"{path}: not valid TOML: {error}") from None


def completed(table: dict[str, Any], folder: Path, depth: int = 0) -> dict[str, Any]:
    """The keys of a vehicle table on top of those of the `preset` or `file` it names, which is looked up from `folder`.

    Raises ValueError for an unknown preset, a file that cannot be read, both keys at once, or files that name each other.
    """
    preset, file = table.get("preset"), table.get("file")
    if preset is not None and file is not None:
        raise ValueError("preset and file are both given; a vehicle starts from one of them")
    if preset is not None:
        return merged(preset_table(preset), table)
    if file is not None:
        if not isinstance(file, str) or not file.isprintable():
            raise ValueError(f"file should be the name of a TOML file, not {file!r:.60}")
        path = folder / file
        if depth == DEEPEST:
            raise ValueError(f"{path}: more than {DEEPEST} files start from one another")
        base = completed(vehicle_table(path), path.parent, depth + 1)
        return merged({key: value for key, value in base.items() if key != "preset"}, table)
    return table


def merged(base: dict[str, Any], own: dict[str, Any]) -> dict[str, Any]:
    """`base` with what `own` says; tables are merged key by key, everything else is replaced."""
    result = dict(base)
    for ours, theirs in (WAYS_TO_PLACE_ROTORS, WAYS_TO_PLACE_ROTORS[::-1]):
        if ours & own.keys():
            result = {key: value for key, value in result.items() if key not in theirs}
    for key, value in own.items():
        both = isinstance(value, dict) and isinstance(result.get(key), dict)
        result[key] = {**result[key], **value} if both else value
    return result

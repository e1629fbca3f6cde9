"""Vehicles in TOML: those that come with the package, and a user's own, which look the same."""

import tomllib
from collections.abc import Sequence
from copy import deepcopy
from functools import cache
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path

from quadstep.io.documents import read_toml
from quadstep.io.doors import OWN, VEHICLES, installed, named, own_place
from quadstep.io.errors import UserError, unknown_name
from quadstep.io.user_code import load, user_error
from quadstep.mission.fields import plain

WAYS_TO_PLACE_ROTORS = ({"layout", "arm"}, {"rotors"})
"""Keys that say where the rotors are, in two ways; the two are exclusive."""

OWN_KEYS = {"preset", "file", "layout", "rotor"}
"""Keys by which a vehicle table is known to describe a real airframe: each has one of them, the paper's plant none."""

DEEPEST = 8
"""How many files may start from one another."""


def is_airframe(table: object) -> bool:
    """Whether a vehicle table of a mission describes a real airframe and not the paper's plant."""
    keys = table if isinstance(table, dict) else getattr(type(table), "model_fields", {})  # or another mission's, checked
    return bool(OWN_KEYS & keys.keys())


def preset_folder() -> Traversable:
    """Where the vehicles of the package are."""
    return files("quadstep.vehicle") / "presets"


def preset_names() -> list[str]:
    """The vehicles that come with the package, and those that installed packages bring."""
    own = packaged_names()
    return [*own, *sorted(installed(VEHICLES).keys() - set(own))]


@cache
def packaged_table(name: str) -> dict[str, object]:
    """The keys of a vehicle that comes with the package; a campaign asks for them with every plan."""
    return tomllib.loads((preset_folder() / f"{name}.toml").read_text(encoding="utf-8"))


@cache
def packaged_names() -> list[str]:
    return sorted(one.name.removesuffix(".toml") for one in preset_folder().iterdir() if one.name.endswith(".toml"))


def preset_table(name: object, folder: Path = Path()) -> dict[str, object]:
    """The keys of one of them, or of one in a Python file, looked up from `folder`: a dict, or a function that gives one.

    Raises ValueError naming the others, or what is wrong with the file.
    """
    if isinstance(name, str) and name in packaged_names():
        return deepcopy(packaged_table(name))
    try:
        own = own_place(name, VEHICLES)
    except UserError as error:
        raise ValueError(str(error)) from error
    if own is None:
        raise ValueError(unknown_name("preset", name, named(packaged_names(), VEHICLES), OWN))
    try:
        thing = load(own, folder)
        table = plain(thing() if callable(thing) else thing)
    except UserError as error:
        raise ValueError(str(error)) from error
    except Exception as error:
        raise ValueError(str(user_error(error, own.text))) from error
    if not isinstance(table, dict) or table.get("preset") == name:
        raise ValueError(f"{own.text}: should be a dict with the keys of a vehicle, or a function that gives one")
    return completed(table, folder, 1) if {"preset", "file"} & table.keys() else table


def completed(table: dict[str, object], folder: Path, depth: int = 0) -> dict[str, object]:
    """The keys of a vehicle table on top of those of the `preset` or `file` it names, which is looked up from `folder`.

    Raises ValueError for an unknown preset or both keys at once; UserError, naming the file, where that is about a file, where
    one cannot be read, and for files that name each other.
    """
    preset, file = table.get("preset"), table.get("file")
    if preset is not None and file is not None:
        raise ValueError("preset and file are both given; a vehicle starts from one of them")
    if preset is not None:
        return merged(preset_table(preset, folder), table)
    if file is not None:
        path = named_file(table, folder)
        if depth == DEEPEST:
            raise UserError(f"{path}: more than {DEEPEST} files build on one another")
        own = read_toml(path)
        try:
            base = completed(own, path.parent, depth + 1)
        except ValueError as error:
            raise UserError(f"{path}: {error}") from None
        return merged({key: value for key, value in base.items() if key != "preset"}, table)
    return table


def named_file(table: dict[str, object], folder: Path) -> Path:
    """The file that a vehicle table starts from. Raises ValueError."""
    file = table["file"]
    if not isinstance(file, str) or not file.isprintable() or not file:
        raise ValueError(f"file should be the name of a TOML file, not {file!r:.60}")
    return folder / file


def origin(table: dict[str, object], keys: Sequence[int | str], folder: Path) -> Path | None:
    """The file that says what a vehicle table has at `keys`; None where the table does itself, or nobody.

    What a table is as a whole, without `keys`, its file has said where it adds nothing.
    """
    path: Path | None = None
    for _ in range(DEEPEST):
        if has_key(table, keys) if keys else len(table) > 1:
            return path
        if "file" not in table:
            return None if keys else path
        path = named_file(table, folder)
        table, folder = read_toml(path), path.parent
    return None


def has_key(table: dict[str, object], keys: Sequence[int | str]) -> bool:
    """Whether a table has what is at `keys`. Only tables directly inside it are made of several files."""
    value = table.get(str(keys[0]))
    return value is not None and (len(keys) == 1 or not isinstance(value, dict) or keys[1] in value)


def merged(base: dict[str, object], own: dict[str, object]) -> dict[str, object]:
    """`base` with what `own` says; tables are merged key by key, everything else is replaced."""
    result = dict(base)
    for ours, theirs in (WAYS_TO_PLACE_ROTORS, WAYS_TO_PLACE_ROTORS[::-1]):
        if ours & own.keys():
            result = {key: value for key, value in result.items() if key not in theirs}
    for key, value in own.items():
        before = result.get(key)
        result[key] = {**before, **value} if isinstance(value, dict) and isinstance(before, dict) else value
    return result

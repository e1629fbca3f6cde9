"""A file of an autopilot's parameters as part of a mission's table [controller]."""

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from quadstep.interfaces.controller import Controller
from quadstep.io.errors import UserError
from quadstep.io.parameter_files import Parameters, read_parameters
from quadstep.mission.check import meant

KEY = "parameters"
"""Names the file. It goes when the mission is read: what the file says is then in the mission."""

FEW = 20
"""Parameters without a law that are all named."""


class Completed(NamedTuple):
    """table: with what the file says where the table itself says nothing. notes: what is to be said of the rest."""

    table: dict[str, object]
    notes: tuple[str, ...] = ()


def completed(law: type[Controller], table: Mapping[str, object], folder: Path) -> Completed:
    """The table of a law. folder: where the file is looked up. Raises ValueError for a file that cannot be used."""
    name = table.get(KEY)
    if not law.parameter_file or not isinstance(name, str):
        return Completed(dict(table))
    try:
        found = read_parameters(folder / name, law.parameter_file)
    except UserError as error:
        raise ValueError(f"{KEY}: {error}") from None
    refuse_unknown(law, found, name)
    merged = {key: one for key, one in table.items() if key != KEY}
    known = {key: value for key, value in found.values.items() if key in law.by_key()}
    return Completed(under(merged, known), tuple(notes(law, found, name)))


def refuse_unknown(law: type[Controller], found: Parameters, name: str) -> None:
    """Raises ValueError for a parameter in one of the law's groups that the firmware does not have, and for a value with which
    the law does not fly.
    """
    keys = law.by_key()
    groups = {group(key) for key in keys if "." in key}
    for one, value in found.values.items():
        if one not in keys and one not in law.unmodelled and group(one) in groups:
            raise ValueError(f"{KEY}: {name}: {one} is no parameter of {law.source}{meant(one, list(keys))}")
        if value not in law.supported.get(one, (value,)):
            flown = " or ".join(f"{number:g}" for number in law.supported[one])
            raise ValueError(f"{KEY}: {name}: {one} is {value:g}, and {law.name} flies only {flown}")


def group(name: str) -> str:
    """Of a parameter: what stands before its last dot, or up to the first underscore."""
    return name.rpartition(".")[0] if "." in name else name.partition("_")[0]


def notes(law: type[Controller], found: Parameters, name: str) -> list[str]:
    """What the law does without, and defaults that are not its own."""
    keys, said = law.by_key(), []
    if left := sorted(found.values.keys() - keys.keys() - law.supported.keys()):
        said.append(f"{name}: {law.name} does without {', '.join(briefly(left, {group(key) for key in keys}))}")
    if other := sorted(key for key, one in found.defaults.items() if key in keys and keys[key][1].fixed not in (None, one)):
        said.append(f"{name}: is of another firmware or vehicle than {law.source}: other defaults of {', '.join(other)}")
    return said


def briefly(names: list[str], groups: set[str]) -> list[str]:
    """Names, of many only those in these groups, and how many others."""
    near = names if len(names) <= FEW else [one for one in names if group(one) in groups]
    return [*near, f"{len(names) - len(near)} of other modules"] if len(near) < len(names) else near


def under(table: dict[str, object], values: Mapping[str, float]) -> dict[str, object]:
    """A table with these values, by dotted key, where it has none."""
    merged = dict(table)
    for key, value in values.items():
        group, _, inner = key.rpartition(".")
        inside = merged.get(group, {}) if group else merged
        if isinstance(inside, Mapping) and inner not in inside:
            merged = {**merged, group: {**inside, inner: value}} if group else {**merged, inner: value}
    return merged

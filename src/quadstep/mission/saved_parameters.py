"""A file of an autopilot's parameters as part of a mission's table [controller]."""

from collections.abc import Iterator, Mapping, Sequence
from operator import attrgetter
from pathlib import Path
from typing import NamedTuple

from quadstep.interfaces.controller import Controller
from quadstep.io.errors import UserError, meant
from quadstep.io.parameter_files import AutopilotParameters, read_parameters
from quadstep.report.units import listed

KEY = "parameters"
"""Names the file. It goes when the mission is read: what the file says is then in the mission."""

FEW = 5
"""Of many names, those that a line has."""


class Completed(NamedTuple):
    """table: with what the file says where the table itself says nothing. notes: what is to be said of the rest. left: the
    parameters that the law does without.
    """

    table: dict[str, object]
    notes: tuple[str, ...] = ()
    left: tuple[str, ...] = ()


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
    groups = {group(key) for key in law.by_key()}
    left = found.values.keys() - law.by_key().keys() - law.supported.keys()
    near_first = tuple(sorted(left, key=lambda one: (group(one) not in groups, one)))
    return Completed(under(merged, known), tuple(notes(law, found, name, near_first)), near_first)


def refuse_unknown(law: type[Controller], found: AutopilotParameters, name: str) -> None:
    """Raises ValueError for a parameter in one of the law's groups that the firmware does not have, or has under another name,
    and for a value with which the law does not fly.
    """
    keys = law.by_key()
    groups = {group(key) for key in keys if "." in key}
    for one, value in found.values.items():
        if one not in keys and one not in law.unmodelled and group(one) in groups:
            raise ValueError(f"{KEY}: {name}: {one} is not a parameter of {law.source}{meant(one, list(keys))}")
        if one in law.renamed:
            raise ValueError(f"{KEY}: {name}: {one} is from another release; {law.source} calls it {law.renamed[one]}")
        if value not in law.supported.get(one, (value,)):
            flown = listed([f"{number:g}" for number in law.supported[one]], "or")
            raise ValueError(f"{KEY}: {name}: {one} is {value:g}, and {law.name} flies only {flown}")


def group(name: str) -> str:
    """Of a parameter: what stands before its last dot, or up to the first underscore."""
    return name.rpartition(".")[0] if "." in name else name.partition("_")[0]


def notes(law: type[Controller], found: AutopilotParameters, name: str, left: tuple[str, ...]) -> list[str]:
    """Of another release, of what the law does without, and of defaults that are not its own."""
    keys, said = law.by_key(), []
    if found.version and found.version not in law.source:
        said.append(f"{name}: is from version {found.version}; {law.name} is {law.source}'s")
    if left:
        many = f"{len(left)} of {len(found.values)} parameters: " if len(left) > FEW else ""
        said.append(f"{name}: {law.name} does not use {many}{briefly(left)}")
    if other := sorted(key for key, one in found.defaults.items() if key in keys and keys[key][1].fixed not in (None, one)):
        said.append(
            f"{name}: is from another firmware or vehicle than {law.source}: it has other defaults for {briefly(other)}"
        )
    return said


def briefly(names: Sequence[str]) -> str:
    """Names, of many the first."""
    return ", ".join(names) if len(names) <= FEW else f"{', '.join(names[:FEW])} and {len(names) - FEW} more"


def check_order(law: type[Controller], section: object) -> None:
    """Raises ValueError for two parameters of which the autopilot can keep only one."""
    for text in law.ordered:
        lower, relation, upper = text.split()
        least, most = (attrgetter(key)(section) for key in (lower, upper))
        if least and most and not (least < most or (relation == "<=" and least == most)):
            raise ValueError(f"{lower} = {least:g} and {upper} = {most:g} contradict each other: {law.source} needs {text}")


def beyond(law: type[Controller], section: object) -> Iterator[str]:
    """What is said of parameters beyond the ranges that the autopilot documents, but takes all the same."""
    for key, (_, gain) in law.by_key().items():
        value = attrgetter(key)(section)
        low, high = (one if one is not None else value for one in (gain.low, gain.high))
        if value is not None and not low <= value <= high:
            ends = f"from {low:g} to {high:g}" if None not in (gain.low, gain.high) else f"up to {high:g}"
            yield f"controller.{key} = {value:g} is outside the range documented by {law.source}, {ends}"


def under(table: dict[str, object], values: Mapping[str, float]) -> dict[str, object]:
    """A table with these values, by dotted key, where it has none."""
    merged = dict(table)
    for key, value in values.items():
        group, _, inner = key.rpartition(".")
        inside = merged.get(group, {}) if group else merged
        if isinstance(inside, Mapping) and inner not in inside:
            merged = {**merged, group: {**inside, inner: value}} if group else {**merged, inner: value}
    return merged

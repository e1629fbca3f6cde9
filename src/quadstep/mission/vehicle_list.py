"""What `quadstep vehicles` lists: every vehicle that comes with the package, or one of a user's own, number by number."""

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from pydantic import BaseModel, ValidationError

from quadstep.io.documents import read_toml
from quadstep.io.errors import UserError, one_line
from quadstep.mission.airframe import AirframeSection
from quadstep.mission.check import check, explained
from quadstep.mission.fields import Quantity
from quadstep.mission.presets import preset_names, preset_table

__all__ = ["Parameter", "load_preset", "parameters", "preset_names", "read_vehicle"]


class Parameter(NamedTuple):
    """One number of a vehicle, as text: its key in a vehicle file, value, unit, what it means, and where it is from."""

    key: str
    value: str
    unit: str
    meaning: str
    source: str


def load_preset(name: str, folder: Path = Path()) -> AirframeSection:
    """A vehicle that comes with the package or an installed one, or `FILE.py:NAME`, looked up from `folder`.

    Raises UserError naming the others.
    """
    table = {}
    try:
        table = preset_table(name, folder)
        return AirframeSection.model_validate(table)
    except ValidationError as error:
        raise explained(AirframeSection, table, error, name) from None
    except ValueError as error:
        raise UserError(str(error)) from None


def read_vehicle(path: Path) -> AirframeSection:
    """A vehicle in a file of one's own, which may itself start from a preset or a file. Raises UserError."""
    return check(AirframeSection, read_toml(path), str(path), path.parent)


def parameters(vehicle: AirframeSection) -> list[Parameter]:
    """Every number of a vehicle in the order of its file, rotors one by one."""
    found = []
    for key, value, quantity in numbers(vehicle):
        found.append(Parameter(key, short_text(value), quantity.unit, quantity.meaning, source(vehicle.sources, key)))
        if key == "arm":
            found.insert(-1, Parameter("layout", str(vehicle.layout), "", "of the rotors", source(vehicle.sources, "layout")))
    rotors = [
        Parameter(
            f"rotor {place + 1}",
            f"({short_text(mount.position)}), {'ccw' if mount.spin > 0 else 'cw'}",
            "m",
            "where it is, and how it turns seen from above",
            source(vehicle.sources, "rotors") or source(vehicle.sources, "layout"),
        )
        for place, mount in enumerate(vehicle.geometry().mounts)
    ]
    first = next(place for place, parameter in enumerate(found) if parameter.key.startswith("rotor."))
    return [*found[:first], *rotors, *found[first:]]


def numbers(section: BaseModel, prefix: str = "") -> Iterator[tuple[str, object, Quantity]]:
    """The keys of a section that hold a number, or several, with its value; what is left out is left out."""
    for name, field in type(section).model_fields.items():
        value = getattr(section, name)
        if isinstance(value, BaseModel):
            yield from numbers(value, f"{prefix}{name}.")
        for note in field.metadata:
            several = isinstance(value, tuple) and not any(isinstance(one, str) for one in value) and value
            if isinstance(note, Quantity) and (several or isinstance(value, float)):
                yield f"{prefix}{name}", value, note


def source(sources: dict[str, str], key: str) -> str:
    """Where a number is from: what is said of its key, or of the table it is in."""
    return one_line(sources.get(key) or sources.get(key.partition(".")[0], ""))


def short_text(value: object) -> str:
    return ", ".join(f"{part:.6g}" for part in value) if isinstance(value, tuple) else f"{value:.6g}"

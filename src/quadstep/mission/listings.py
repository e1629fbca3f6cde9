"""What `quadstep new` writes of a controller, from what its gains declare: every key with its default; and what `quadstep
vehicles` lists: every vehicle that comes with the package, or one of a user's own, number by number.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from operator import attrgetter
from pathlib import Path
from typing import NamedTuple, get_args

from pydantic import BaseModel, ValidationError

from quadstep.interfaces.controller import Controller
from quadstep.interfaces.learning import DeclaredNet
from quadstep.interfaces.plant import Model
from quadstep.io.documents import read_toml
from quadstep.io.errors import UserError, one_line
from quadstep.mission.airframe import AirframeSection
from quadstep.mission.check import check, explained
from quadstep.mission.derived import ControllerSection
from quadstep.mission.fields import Quantity
from quadstep.mission.presets import preset_names, preset_table
from quadstep.mission.read import VEHICLE, refuse_others
from quadstep.numbers import Vector

WIDTH = 27
"""Of a key and its value, before the comment."""

DIGITS = 4
"""Of a default that follows from the vehicle."""


def controller_lines(section: type[ControllerSection], model: Model, others: Sequence[str]) -> Iterator[str]:
    """Tables `[controller]` and `[controller.nets]`. others: what its `type` may be too."""
    controller, (kind,) = section.controller, get_args(section.model_fields["type"].annotation)
    yield "[controller]"
    yield commented(f'type = "{kind}"', "; or ".join(filter(None, (controller.label or kind, ", ".join(others)))))
    yield "# This vehicle's defaults, which `quadstep linear` grades. For three axes: one number, or a list of three."
    if controller.parameter_file:
        yield commented('# parameters = "saved.yaml"', "", "example: a file of the autopilot's own parameters")
    gains = controller.gains(model)
    for key, (name, gain) in controller.by_key().items():
        value = gain.fixed if gain.fixed is not None else rounded(attrgetter(name)(gains))
        yield commented(f"# {key} = {written(value, gain.stands_for_three)}", gain.unit, gain.meaning)
    nets = section(type=kind).table
    if nets is not None:
        yield "\n[controller.nets]"
        given = {key: value for key, value in nets if value is not None}
        yield from number_lines(type(nets), learning_numbers(controller, gains) | given)
        yield commented('# weights = "weights.json"', "", "example: warm start from an earlier flight")
    yield ""


def number_lines(section: type[BaseModel], shown: Mapping[str, object], inside: str = "") -> Iterator[str]:
    """The keys of a table of declared numbers, with what is `shown`, or their defaults; keys with neither are left out.

    inside: the table within the table, and a dot.
    """
    for key, field in section.model_fields.items():
        value = shown.get(key, field.get_default(call_default_factory=True))
        if isinstance(value, BaseModel):
            yield from number_lines(type(value), shown, f"{inside}{key}.")
        for note in field.metadata:
            if isinstance(note, Quantity) and value is not None:
                yield commented(f"# {inside}{key} = {written(value)}", note.unit, note.meaning)


def learning_numbers(controller: type[Controller], gains: object) -> dict[str, object]:
    """F1, F2, kappa1 and kappa2."""
    found: dict[str, object] = {}
    for name, net in controller.declarations().items():
        if isinstance(net, DeclaredNet):
            built = attrgetter(name)(gains)
            found |= {f"F{net.number}": rounded(built.learning_rate), f"kappa{net.number}": rounded(built.damping)}
    return found


def rounded(value: object) -> object:
    return tuple(map(rounded, value)) if isinstance(value, Vector | tuple) else float(f"{value:.{DIGITS}g}")


def written(value: object, stands_for_three: bool = False) -> str:
    """A value as TOML; of three equal ones that one number may stand for, that."""
    if isinstance(value, tuple | list):
        same = stands_for_three and len(set(value)) == 1
        return written(value[0]) if same else f"[{', '.join(map(written, value))}]"
    if isinstance(value, Mapping):
        return f"{{ {', '.join(f'{name} = {written(one)}' for name, one in value.items())} }}"
    return json.dumps(value, ensure_ascii=False) if isinstance(value, str | bool) else repr(value)


def commented(line: str, *said: str) -> str:
    return f"{line:<{WIDTH}} # {'; '.join(filter(lambda part: part not in ('', '-'), said))}"


__all__ = ["VehicleNumber", "load_preset", "parameters", "preset_names", "read_vehicle", "vehicle_named"]


class VehicleNumber(NamedTuple):
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
    content = read_toml(path)
    refuse_others(content, VEHICLE, str(path))
    return check(AirframeSection, content, str(path), path.parent)


def vehicle_named(given: str) -> AirframeSection:
    """A vehicle by the name of a preset, or in a file. Raises UserError."""
    return load_preset(given) if given in preset_names() or not given.endswith(".toml") else read_vehicle(Path(given))


def parameters(vehicle: AirframeSection) -> list[VehicleNumber]:
    """Every number of a vehicle in the order of its file, rotors one by one."""
    found = []
    for key, value, quantity in numbers(vehicle):
        found.append(VehicleNumber(key, short_text(value), quantity.unit, quantity.meaning, source(vehicle.sources, key)))
        if key == "arm":
            found.insert(
                -1, VehicleNumber("layout", str(vehicle.layout), "", "of the rotors", source(vehicle.sources, "layout"))
            )
    rotors = [
        VehicleNumber(
            f"rotor {place + 1}",
            f"({short_text(mount.position)}), {'ccw' if mount.spin > 0 else 'cw'}",
            "m",
            "where it is, and how it turns, viewed against its axis",
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

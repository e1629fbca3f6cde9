"""The lines of `quadstep new` about a controller, from what its gains declare: every key with its default."""

from collections.abc import Iterator, Mapping, Sequence
from operator import attrgetter
from typing import get_args

from pydantic import BaseModel

from quadstep.interfaces.controller import Controller
from quadstep.interfaces.learning import DeclaredNet
from quadstep.interfaces.plant import Model
from quadstep.mission.derived import ControllerSection, NetsSection
from quadstep.mission.fields import Quantity
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
    yield "# Shown are this vehicle's defaults, which `quadstep linear` grades. Of three axes: one number, or a list of three."
    if controller.parameter_file:
        yield commented('# parameters = "saved.yaml"', "", "example: a file of the autopilot's own parameters")
    gains = controller.gains(model)
    for key, (name, gain) in controller.by_key().items():
        value = gain.fixed if gain.fixed is not None else rounded(attrgetter(name)(gains))
        yield commented(f"# {key} = {written(value, gain.stands_for_three)}", gain.unit, gain.meaning)
    nets = section(type=kind).table
    if nets is not None:
        yield "\n[controller.nets]"
        yield from net_lines(nets, learning_numbers(controller, gains))
    yield ""


def number_lines(section: type[BaseModel]) -> Iterator[str]:
    """The keys of a table of declared numbers, with their defaults."""
    for key, field in section.model_fields.items():
        for note in field.metadata:
            if isinstance(note, Quantity):
                value = field.get_default(call_default_factory=True)
                yield commented(f"# {key} = {written(value)}", note.unit, note.meaning)


def net_lines(nets: NetsSection, derived: Mapping[str, float]) -> Iterator[str]:
    """The keys of the nets. derived: numbers that follow from the vehicle."""
    for key, field in type(nets).model_fields.items():
        value = getattr(nets, key)
        for note in field.metadata:
            if isinstance(note, Quantity) and (value is not None or key in derived):
                shown = rounded(derived[key]) if value is None else value
                yield commented(f"# {key} = {written(shown)}", note.unit, note.meaning)
    yield commented('# weights = "weights.json"', "", "example: warm start from an earlier flight")


def learning_numbers(controller: type[Controller], gains: object) -> dict[str, float]:
    """F1, F2, kappa1 and kappa2."""
    found: dict[str, float] = {}
    for name, net in controller.declarations().items():
        if isinstance(net, DeclaredNet):
            built = attrgetter(name)(gains)
            found |= {f"F{net.number}": built.learning_rate, f"kappa{net.number}": built.damping}
    return found


def rounded(value: object) -> object:
    return tuple(map(rounded, value)) if isinstance(value, Vector | tuple) else float(f"{value:.{DIGITS}g}")


def written(value: object, stands_for_three: bool = False) -> str:
    """A value as TOML; of three equal ones that one number may stand for, that."""
    if isinstance(value, tuple):
        same = stands_for_three and len(set(value)) == 1
        return written(value[0]) if same else f"[{', '.join(map(written, value))}]"
    return str(value).lower() if isinstance(value, bool) else repr(value)


def commented(line: str, *said: str) -> str:
    return f"{line:<{WIDTH}} # {'; '.join(filter(lambda part: part not in ('', '-'), said))}"

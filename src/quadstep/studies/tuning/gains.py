"""Which numbers of a mission are tuned, what they are at present, and what a candidate makes of them.

A candidate is a point in the unit box: a place in each gain's range. Its numbers are rounded to a few digits before anything
is flown, so that the file with the tuned gains says exactly what was flown.
"""

from collections.abc import Mapping, Sequence
from operator import attrgetter
from typing import NamedTuple, cast

from pydantic import BaseModel

from quadstep.interfaces import gain as declaration
from quadstep.interfaces.learning import DeclaredNet
from quadstep.io.errors import UserError
from quadstep.mission.keys import parts, with_value
from quadstep.mission.schema import Mission
from quadstep.mission.tune import Range, TuneSection
from quadstep.numbers import Vector

DIGITS = 6

LEARNING = declaration.Gain(None, "", "number of the nets", zero=True)
"""What is declared of the keys of `controller.nets`."""


class Leaf(NamedTuple):
    """A key that a gain decides. share: in proportion to the gain. present: what it is now."""

    key: str
    share: float
    present: float


class Gain(NamedTuple):
    """A number that is tuned, and the keys that it decides, the first of which it is itself."""

    key: str
    range: Range
    leaves: tuple[Leaf, ...]

    def value(self, place: float) -> float:
        """The number at a place of the range."""
        return min(max(rounded(self.range.value(place)), self.range.low), self.range.high)

    def edge(self, values: Mapping[str, float]) -> str:
        """Which end of its range it is near, in words: within a hundredth of it. values: of a mission, by key."""
        value = values[self.leaves[0].key]
        if value <= self.range.value(0.01):
            return "near its lower bound"
        return "near its upper bound" if value >= self.range.value(0.99) else ""

    def numbers(self, value: float) -> dict[str, float]:
        """What the mission then says at each key."""
        return {leaf.key: value if leaf.share == 1.0 else rounded(leaf.share * value) for leaf in self.leaves}


def rounded(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")


def gains_of(section: TuneSection, mission: Mission) -> list[Gain]:
    """The gains that a section names. Raises UserError for one that cannot be tuned."""
    gains = [gain(key, one, mission) for key, one in section.gains.items()]
    places = [leaf.key for one in gains for leaf in one.leaves]
    twice = [leaf for leaf in places if places.count(leaf) > 1]
    if twice:
        raise UserError(f"tune.gains: {twice[0]} is named twice")
    varying = [*section.vary, *(key for group in section.correlated for key in group.keys)]
    for one in gains:
        for leaf in one.leaves:
            for key in varying:
                if f"{leaf.key}.".startswith(f"{key}.") or f"{key}.".startswith(f"{leaf.key}."):
                    raise UserError(f"tune.gains: {one.key} cannot be tuned while {key} varies (tune.vary)")
    return gains


def gain(key: str, wanted: Range | None, mission: Mission) -> Gain:
    """A gain and what it is at present.

    A key of several numbers is one gain: its range is that of the first of them, and the others keep their proportion to it.
    """
    said = f"tune.gains: {key}"
    first, *rest = parts(key)
    if first != "controller" or not rest:
        raise UserError(f"{said}: only numbers of the controller can be tuned; allowed: {', '.join(tunable(mission))}")
    value = looked_up(mission, rest, said)
    if isinstance(value, tuple) and value and all(type(entry) is float for entry in value):
        every = enumerate(zip(shares(value, said), value, strict=True))
        leaves = tuple(Leaf(f"{key}.{place}", share, one) for place, (share, one) in every if share != 0.0)
    elif type(value) is float:
        leaves = (Leaf(key, 1.0, value),)
    else:
        raise UserError(
            f"{said}: is {value!r:.40}, which changes the structure of the flight; allowed: {', '.join(tunable(mission))}"
        )
    present = leaves[0].present
    wanted = wanted or declared_range(".".join(one for one in rest if not one.isdigit()), present, mission)
    if not wanted.low <= present <= wanted.high:
        raise UserError(f"{said}: its present value {present:g} is outside low = {wanted.low:g} to high = {wanted.high:g}")
    return Gain(key, wanted, leaves)


def declared_range(name: str, present: float, mission: Mission) -> Range:
    """The range that a gain's own declaration gives it."""
    _, declared = mission.controller.controller.by_key().get(name, ("", LEARNING))
    low, high, scale = declared.span(present, present)
    return Range.model_validate({"low": low, "high": high, "scale": scale})


def shares(values: tuple[float, ...], said: str) -> list[float]:
    """Each number in proportion to the first."""
    if not any(values):
        return [1.0] * len(values)
    if values[0] == 0.0:
        raise UserError(f"{said}: the first entry is 0, so the others cannot be scaled with it; name each entry")
    return [value / values[0] for value in values]


def looked_up(mission: Mission, names: Sequence[str], said: str) -> object:
    """What the controller has under these names, with what stands for a key that was left out."""
    value: object = mission.controller
    for depth, name in enumerate(names):
        if isinstance(value, BaseModel) and name in type(value).model_fields:
            found = getattr(value, name)
            value = follows(mission, names[:depth]).get(name) if found is None else found
        elif isinstance(value, tuple) and name.isdigit() and int(name) < len(value):
            value = value[int(name)]
        else:
            raise UserError(f"{said}: unknown key; allowed: {', '.join(tunable(mission))}")
        if value is None:
            raise UserError(f"{said}: is not in the mission, and is derived from other numbers; give it in the mission first")
    return value


def follows(mission: Mission, table: Sequence[str]) -> Mapping[str, object]:
    """What the keys of a table of the controller are that were left out, where they follow from the vehicle."""
    return filled_in(mission) if not table else learning_rates(mission) if list(table) == ["nets"] else {}


def filled_in(mission: Mission) -> dict[str, object]:
    """What the controller takes at the keys of its gains, given or not, as the mission would say it."""
    gains = mission.controller.gains(mission.modelled.model())
    found = {key: attrgetter(name)(gains) for key, (name, _) in mission.controller.controller.by_key().items()}
    return {key: tuple(one) if isinstance(one, Vector) else one for key, one in found.items()}


def learning_rates(mission: Mission) -> dict[str, float]:
    """F1 and F2 of the controller's nets, given or not; empty without nets."""
    gains = mission.controller.gains(mission.modelled.model())
    nets = {name: one for name, one in mission.controller.controller.declarations().items() if isinstance(one, DeclaredNet)}
    return {f"F{one.number}": float(attrgetter(name)(gains).learning_rate) for name, one in nets.items()}


def tunable(mission: Mission) -> list[str]:
    """The keys that can be tuned."""
    keys = [key for key, (_, gain) in mission.controller.controller.by_key().items() if gain.tunable]
    nets = mission.controller.table
    known = [key for key, value in nets or () if type(value) is float]
    learning = [f"nets.{key}" for key in (*known, *(rate for rate in learning_rates(mission) if rate not in known))]
    return [f"controller.{key}" for key in (*keys, *learning)]


def present(gains: Sequence[Gain]) -> dict[str, float]:
    """What is at every key now."""
    return {leaf.key: leaf.present for one in gains for leaf in one.leaves}


def numbers(gains: Sequence[Gain], point: Sequence[float]) -> dict[str, float]:
    """What a point of the unit box puts at every key."""
    found: dict[str, float] = {}
    for one, place in zip(gains, point, strict=True):
        found |= one.numbers(one.value(place))
    return found


def starting_point(gains: Sequence[Gain]) -> list[float]:
    """The present gains in the unit box."""
    return [min(max(one.range.place(one.leaves[0].present), 0.0), 1.0) for one in gains]


def with_numbers(content: dict[str, object], mission: Mission, values: dict[str, float]) -> dict[str, object]:
    """A mission's content with these numbers written out."""
    changed = content if "controller" in content else {**content, "controller": {"type": mission.controller.type}}
    for key, number in values.items():
        listed, _, place = key.rpartition(".")
        entries: object = (
            list(cast(tuple[object, ...], looked_up(mission, parts(listed)[1:], listed))) if place.isdigit() else None
        )
        for name in reversed(parts(listed)):  # where the file has no list, the present one is written out
            entries = {name: entries}
        changed = with_value(changed, key, number, entries)
    return changed

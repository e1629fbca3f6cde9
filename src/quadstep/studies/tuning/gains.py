"""Which numbers of a mission are tuned, what they are at present, and what a candidate makes of them.

A candidate is a point in the unit box: a place in each gain's range. Its numbers are rounded to a few digits before anything
is flown, so that the file with the tuned gains says exactly what was flown. A candidate that breaks the controller's own
conditions is moved straight towards a point where they hold, just as far as needed, and flown there; the search is told a
cost that grows with the distance.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from operator import attrgetter
from typing import NamedTuple, cast

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel

from quadstep.interfaces import gain as declaration
from quadstep.interfaces.controller import Condition
from quadstep.interfaces.learning import DeclaredNet
from quadstep.interfaces.plant import Model
from quadstep.io.errors import UserError
from quadstep.mission.derived import ControllerSection
from quadstep.mission.fields import key_parts, replaced, with_value
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


class TunedGain(NamedTuple):
    """A number that is tuned, and the keys that it decides, the first of which it is itself."""

    key: str
    range: Range
    leaves: tuple[Leaf, ...]

    def value(self, place: float) -> float:
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


def gains_of(section: TuneSection, mission: Mission) -> list[TunedGain]:
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


def gain(key: str, limits: Range | None, mission: Mission) -> TunedGain:
    """A gain and what it is at present.

    A key of several numbers is one gain: its range is that of the first of them, and the others keep their proportion to it.
    """
    said = f"tune.gains: {key}"
    first, *rest = key_parts(key)
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
    if limits is None:  # the range that the gain's own declaration gives it
        name = ".".join(one for one in rest if not one.isdigit())
        _, declared = mission.controller.controller.by_key().get(name, ("", LEARNING))
        limits = Range.model_validate(dict(zip(("low", "high", "scale"), declared.span(present, present), strict=True)))
    if not limits.low <= present <= limits.high:
        raise UserError(f"{said}: its current value {present:g} is outside low = {limits.low:g} to high = {limits.high:g}")
    return TunedGain(key, limits, leaves)


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


def with_numbers(content: dict[str, object], mission: Mission, values: dict[str, float]) -> dict[str, object]:
    """A mission's content with these numbers written out."""
    changed = content if "controller" in content else {**content, "controller": {"type": mission.controller.type}}
    for key, number in values.items():
        listed, _, place = key.rpartition(".")
        entries: object = (
            list(cast(tuple[object, ...], looked_up(mission, key_parts(listed)[1:], listed))) if place.isdigit() else None
        )
        for name in reversed(key_parts(listed)):  # where the file has no list, the present one is written out
            entries = {name: entries}
        changed = with_value(changed, key, number, entries)
    return changed


HALVINGS = 20
TRIED = 2000
ENOUGH = 32

Point = Sequence[float]


def distance(a: Point, b: Point) -> float:
    """Between two points of the unit box."""
    return (Vector(a) - Vector(b)).norm()


class Conditions:
    """missions: all for which they must hold. numbers: what a point of the unit box puts at every key."""

    def __init__(self, missions: Sequence[Mission], numbers: Callable[[Point], dict[str, float]]) -> None:
        self.numbers = numbers
        self.cases: list[tuple[ControllerSection, list[Model]]] = []
        """Each controller, and the vehicles that it flies."""
        for mission in missions:
            model = mission.modelled.model()
            known = [models for controller, models in self.cases if controller == mission.controller]
            if known:
                known[0].append(model)
            else:
                self.cases.append((mission.controller, [model]))

    def of(self, values: Mapping[str, object]) -> Iterator[Condition]:
        """All conditions on these numbers, each of which may be an array of candidates."""
        for controller, models in self.cases:
            changed = with_gains(controller, values)
            for model in models:
                yield from changed.conditions(model)

    def broken(self, values: Mapping[str, float]) -> list[str]:
        return [one.warning() for one in self.of(values) if not one.holds]

    def hold(self, point: Point) -> bool:
        return all(one.holds for one in self.of(self.numbers(point)))

    def holding(self, points: Sequence[Point]) -> NDArray[np.bool_]:
        """At which of many points all hold."""
        values = [self.numbers(point) for point in points]
        columns = {key: np.array([one[key] for one in values]) for key in values[0]}
        found = np.ones(len(points), dtype=bool)
        for one in self.of(columns):
            found &= one.holds
        return found

    def anchor(self, start: Point, seed: int) -> list[float]:
        """A point where they hold: the start, or the nearest to it of many tried. Raises UserError if there is none."""
        if self.hold(start):
            return list(start)
        tried = np.random.default_rng(seed).random((TRIED, len(start)))
        found = tried[self.holding(tried.tolist())][:ENOUGH].tolist()
        if not found:
            said = self.broken(self.numbers(start))[0]
            raise UserError(
                f"tune.gains: no gains in these ranges meet the conditions: {said}; widen the ranges, or set theorem = false"
            )
        return self.moved(start, min(found, key=lambda point: distance(point, start)))

    def moved(self, point: Point, anchor: Point) -> list[float]:
        """The point itself where they hold, else the nearest to it found between it and the anchor."""
        if self.hold(point):
            return list(point)
        near, far = 0.0, 1.0  # shares of the way from the anchor: they hold at near, not at far
        for _ in range(HALVINGS):
            middle = 0.5 * (near + far)
            near, far = (middle, far) if self.hold(interpolated(anchor, point, middle)) else (near, middle)
        return interpolated(anchor, point, near)


def with_gains(controller: ControllerSection, values: Mapping[str, object]) -> ControllerSection:
    """A checked controller with other numbers, by keys of the mission."""
    changed: dict[str, object] = {}
    for key, value in values.items():
        _, name, *rest = key_parts(key)
        changed[name] = replaced(changed.get(name, getattr(controller, name)), rest, value)
    return controller.model_copy(update=changed)


def interpolated(first: Point, second: Point, share: float) -> list[float]:
    """Some way from the first to the second; the first itself at 0."""
    return [a if share == 0.0 else a + share * (b - a) for a, b in zip(first, second, strict=True)]

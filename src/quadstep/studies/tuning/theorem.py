"""The controller's own conditions on its gains, and candidates moved until they hold.

A candidate that breaks them is moved straight towards a point where they hold, just as far as needed, and flown there; the
search is told a cost that grows with the distance.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from quadstep.interfaces.controller import Condition
from quadstep.interfaces.model import Model
from quadstep.io.errors import UserError
from quadstep.mission.derived import ControllerSection
from quadstep.mission.keys import parts, replaced
from quadstep.mission.schema import Mission
from quadstep.numbers import Vector

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
        """Whether all hold at a point."""
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
                f"tune.gains: none were found in these ranges that keep the conditions: {said}; widen the ranges, or say "
                "theorem = false"
            )
        return self.moved(start, min(found, key=lambda point: distance(point, start)))

    def moved(self, point: Point, anchor: Point) -> list[float]:
        """The point itself where they hold, else the nearest to it found between it and the anchor."""
        if self.hold(point):
            return list(point)
        near, far = 0.0, 1.0  # shares of the way from the anchor: they hold at near, not at far
        for _ in range(HALVINGS):
            middle = 0.5 * (near + far)
            near, far = (middle, far) if self.hold(between(anchor, point, middle)) else (near, middle)
        return between(anchor, point, near)


def with_gains(controller: ControllerSection, values: Mapping[str, object]) -> ControllerSection:
    """A checked controller with other numbers, by keys of the mission."""
    changed: dict[str, object] = {}
    for key, value in values.items():
        _, name, *rest = parts(key)
        changed[name] = replaced(changed.get(name, getattr(controller, name)), rest, value)
    return controller.model_copy(update=changed)


def between(first: Point, second: Point, share: float) -> list[float]:
    """Some way from the first to the second; the first itself at 0."""
    return [a if share == 0.0 else a + share * (b - a) for a, b in zip(first, second, strict=True)]

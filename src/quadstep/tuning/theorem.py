"""The controller's own conditions on its gains, and candidates moved until they hold.

A candidate that breaks them is moved straight towards a point where they hold, just as far as needed, and flown there; the
search is told a cost that grows with the distance. Nothing is known of the conditions but whether they hold.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from quadstep.campaign.keys import parts, replaced
from quadstep.errors import UserError
from quadstep.mission.schema import Mission
from quadstep.numbers import Vector

CONDITION = "(condition of "
"""What a controller's warning of a broken condition says, as in (condition of Theorem 5.1)."""

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
        self.cases: list[tuple[Any, list[Any]]] = []
        """Each controller, and the vehicles that it flies."""
        for mission in missions:
            vehicle = mission.model
            known = [vehicles for controller, vehicles in self.cases if controller == mission.controller]
            if known:
                known[0].append(vehicle)
            else:
                self.cases.append((mission.controller, [vehicle]))

    def broken(self, values: dict[str, float]) -> list[str]:
        """The conditions that these numbers break in the first case in which they break any."""
        for controller, vehicles in self.cases:
            changed = with_gains(controller, values)
            for vehicle in vehicles:
                found = [line for line in changed.warnings(vehicle) if CONDITION in line]
                if found:
                    return found
        return []

    def hold(self, point: Point) -> bool:
        """Whether all hold at a point."""
        return not self.broken(self.numbers(point))

    def anchor(self, start: Point, seed: int) -> list[float]:
        """A point where they hold: the start, or the nearest to it of many tried. Raises UserError if there is none."""
        if self.hold(start):
            return list(start)
        random, found = np.random.default_rng(seed), []
        for _ in range(TRIED):
            point = random.random(len(start)).tolist()
            if self.hold(point):
                found.append(point)
            if len(found) == ENOUGH:
                break
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


def with_gains(controller: Any, values: dict[str, float]) -> Any:
    """A checked controller with other numbers, by keys of the mission."""
    changed: dict[str, Any] = {}
    for key, value in values.items():
        _, name, *rest = parts(key)
        changed[name] = replaced(changed.get(name, getattr(controller, name)), rest, value)
    return controller.model_copy(update=changed)


def between(first: Point, second: Point, share: float) -> list[float]:
    """Some way from the first to the second; the first itself at 0."""
    return [a if share == 0.0 else a + share * (b - a) for a, b in zip(first, second, strict=True)]

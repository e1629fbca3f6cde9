"""From the values of a flight to its mission and its plan; also from arrays of values to the plans of many flights."""

import itertools
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from quadstep.engines.fly import FlightPlan
from quadstep.engines.trial import NotFiniteError
from quadstep.io.errors import UserError
from quadstep.mission.keys import overridden, with_value
from quadstep.mission.read import check_mission
from quadstep.mission.schema import Mission
from quadstep.numbers import Table, flatten, rebuild
from quadstep.studies.campaign.draws import DrawnColumn, noise_keys


def corners(low: NDArray[np.float64], high: NDArray[np.float64]) -> Iterator[list[float]]:
    """The corners of a box; if there are too many, its two ends and the corners next to them."""
    ends = [sorted({a.item(), b.item()}) for a, b in zip(low, high, strict=True)]
    if len(ends) <= 5:
        yield from map(list, itertools.product(*ends))
        return
    yield low.tolist()
    yield high.tolist()
    for i in range(len(ends)):
        yield [high[j].item() if i == j else low[j].item() for j in range(len(ends))]
        yield [low[j].item() if i == j else high[j].item() for j in range(len(ends))]


def groups(columns: list[NDArray[np.generic]], count: int) -> Iterator[tuple[tuple[int, ...], NDArray[np.int64]]]:
    """Flights grouped by equal places in these columns: the places, and the flights of each group."""
    if not columns:
        yield (), np.arange(count)
        return
    together = np.stack(columns, axis=1)
    found, which = np.unique(together, axis=0, return_inverse=True)
    order = np.argsort(which.ravel(), kind="stable")
    ends = np.cumsum(np.bincount(which.ravel(), minlength=len(found)))
    for place, members in zip(found, np.split(order, ends[:-1]), strict=True):
        yield tuple(place.tolist()), members


def numbers(drawn: DrawnColumn) -> NDArray[np.float64]:
    values = drawn.values if drawn.options is None else np.array(drawn.options, dtype=float)[drawn.values]
    result: NDArray[np.float64] = np.asarray(values, dtype=float)
    return result


def option(drawn: DrawnColumn, place: int) -> object:
    assert drawn.options is not None
    return drawn.options[place]


def same(alone: object, together: object, place: int) -> bool:
    """Whether a leaf of a single flight equals the arrays' value for it, to the bit."""
    if isinstance(alone, Table) or isinstance(together, Table):
        return isinstance(alone, Table) and isinstance(together, Table) and alone.values == together.values
    return bool(alone == (together[place] if isinstance(together, np.ndarray) else together))


def without(values: Mapping[str, object], name: str) -> dict[str, object]:
    return {key: value for key, value in values.items() if key != name}


def values_text(values: Mapping[str, object]) -> str:
    return ", ".join(f"{name} = {value!r:.40}" for name, value in itertools.islice(values.items(), 8))


class Variants:
    """Variants of one mission, with other values for some of its keys.

    content, defaults: the mission as written, and with every default. seed: of the noise; each flight has its own.
    """

    def __init__(self, content: dict[str, object], defaults: dict[str, object], source: str, folder: Path, seed: int) -> None:
        self.content, self.defaults, self.source, self.folder, self.seed = content, defaults, source, folder, seed

    def refuse_lost_at_once(self, mission: Mission) -> None:
        """Refuses a user's law whose first command is not finite in the mission as written. Raises UserError."""
        if mission.controller.own:
            try:
                mission.plan(self.folder)
            except NotFiniteError as error:
                raise UserError(f"{self.source}: {error}") from None
            except UserError:  # the values that vary may mend it
                return

    def mission(self, values: Mapping[str, object], flight: int | None = None) -> Mission:
        """The mission with these values. Raises UserError naming the key, and the flight if given."""
        content = self.content
        said = "" if flight is None else f"flight {flight} ({values_text(values)}): "
        try:
            for name, value in values.items():
                content = with_value(content, name, value, self.defaults)
            return check_mission(content, self.source, self.folder)
        except UserError as error:
            text = str(error).removeprefix(f"{self.source}: ")
            if ": unknown key" in text and any(text.startswith(name.partition(".")[0]) for name in values):
                said = "no such key can be varied: "
            raise UserError(f"{self.source}: {said}{text}") from None

    def plan(self, values: Mapping[str, object], flight: int | None = None) -> FlightPlan:
        """The flight with these values, its noise that of `flight`. Raises UserError."""
        mission = self.mission(values, flight)
        try:
            plan = mission.plan(self.folder, drawn=bool(values))
        except UserError as error:
            said = "" if flight is None else f"flight {flight} ({values_text(values)}): "
            raise UserError(f"{self.source}: {said}{error}") from None
        return plan if flight is None else self.with_noise(plan, np.array([flight]), one=True)

    def with_noise(self, plan: FlightPlan, flights: NDArray[np.int64], one: bool = False) -> FlightPlan:
        if not hasattr(plan.parameters, "key"):
            return plan
        keys = noise_keys(self.seed, flights)
        if one:
            keys = rebuild(keys, iter([float(part[0]) for part in flatten(keys)]))
        return plan._replace(parameters=plan.parameters._replace(key=keys))

    def array_plan(self, fixed: dict[str, object], columns: Mapping[str, NDArray[np.float64]]) -> FlightPlan:
        """A plan with arrays among its leaves. Raises whatever arithmetic on them may raise."""
        first = {name: column[0].item() for name, column in columns.items()}
        with np.errstate(all="ignore"):
            plan = self.built({**fixed, **first}, {name: np.ascontiguousarray(column) for name, column in columns.items()})
        count = len(next(iter(columns.values()))) if columns else 0
        for leaf in flatten((plan.start, plan.parameters)):
            if isinstance(leaf, np.ndarray) and leaf.shape != (count,):
                raise ValueError("an array of another shape")
            if not isinstance(leaf, np.ndarray | Table | float | int):
                raise TypeError(f"neither number nor table: {type(leaf)}")
        return plan

    def built(self, values: dict[str, object], numbers: Mapping[str, object]) -> FlightPlan:
        """The plan of a mission with these values, some of which are other kinds of numbers."""
        mission = self.mission(values)
        for name, number in numbers.items():
            mission = overridden(mission, name, number)
        return mission.plan(self.folder, warn=False)

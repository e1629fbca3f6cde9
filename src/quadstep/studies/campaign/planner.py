"""From drawn values to flights: most keys become numbers for all flights at once, the others flight by flight.

A mission builds its flight by arithmetic. Given an array in place of a number, it builds many flights in one go; where it
cannot (a value that is rounded, compared or decides the structure), each value is built on its own. Which keys are of which
kind is found by trial: the flights are compared with those built one by one, number by number.
"""

import time
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadstep.engines.loop import Loop, Numbers
from quadstep.engines.scored import ScoredLoop, scored
from quadstep.interfaces.closed_loop import Ticks
from quadstep.io.errors import UserError
from quadstep.mission.distributions import Grid
from quadstep.mission.lagrange import LagrangeMission
from quadstep.mission.multirotor import MultirotorMission
from quadstep.mission.read import check_mission
from quadstep.mission.schema import Mission
from quadstep.numbers import Table, flatten, leaf_names, rebuild
from quadstep.studies.campaign.draws import DrawnColumn, Values, Variants, corners, draw, groups, numbers, option, same
from quadstep.studies.campaign.schema import Campaign
from quadstep.world.air import DeclaredWind

SINGLY = "cannot be set for many flights at once"
"""What is said of keys that arrays cannot stand for."""

TYPICAL = 256
"""Flights on which the planner finds out what can be built in one go: the first of the campaign, always the same."""

TRIED = 3
"""Flights on which each key is tried."""

FEWEST_ALIKE = 8
"""Flights that have to share, on average, each value that cannot be built in one go, for a batch per value to pay."""

MOST_STRUCTURES = 200
"""Most programs that one campaign may need; each takes about a second to compile."""


class PlannedBatch(NamedTuple):
    """Flights of one structure and clock. members: their places among those requested. loop, ticks: with scores.

    start, parameters: of one of the flights; places: of the leaves that vary; rows: their values, one row per flight.
    """

    members: NDArray[np.int64]
    loop: ScoredLoop
    ticks: Ticks
    start: Any
    parameters: Any
    places: tuple[int, ...]
    rows: NDArray[np.float64]

    def flight(self, row: NDArray[np.float64]) -> tuple[tuple[object, ...], Numbers]:
        """Start and parameters of the flight of a row."""
        leaves = flatten((self.start, self.parameters))
        for place, value in zip(self.places, row, strict=True):
            leaves[place] = float(value)
        start, parameters = rebuild((self.start, self.parameters), iter(leaves))
        return start, parameters


class Planner(Variants):
    """Builds flights of one mission in which some keys vary.

    typical: values of the varying keys; the trial of what can be built in one go uses them. score_period: [s], None for the
    mission's log period. singly: filled with keys because of which flights were built one by one, and how long one took [s].
    """

    def __init__(
        self, content: dict[str, object], defaults: dict[str, object], source: str, folder: Path,
        typical: Mapping[str, DrawnColumn], seed: int, score_period: float | None, singly: dict[str, float],
    ) -> None:  # fmt: skip
        super().__init__(content, defaults, source, folder, seed)
        self.typical, self.score_period, self.singly = typical, score_period, singly
        mission = check_mission(content, source, folder)
        self.refuse_lost_at_once(mission)
        self.begin, self.own = mission.scored_from, mission.own_metrics
        self.direct: dict[object, list[str]] = {}
        self.checked: dict[object, tuple[NDArray[np.float64], NDArray[np.float64]]] = {}
        self.structures: set[object] = set()

    def batches(self, flights: NDArray[np.int64], drawn: Mapping[str, DrawnColumn]) -> Iterator[PlannedBatch]:
        """The flights of these numbers with these values, in batches. Raises UserError for values that cannot be flown."""
        numeric = [name for name, column in drawn.items() if all(type(one) is float for one in column.options or ())]
        options = [name for name in drawn if name not in numeric]
        for chosen, members in groups([drawn[name].values for name in options], len(flights)):
            fixed = {name: option(drawn[name], place) for name, place in zip(options, chosen, strict=True)}
            columns = {name: numbers(drawn[name])[members] for name in numeric}
            yield from self.batches_of(fixed, columns, drawn, flights, members)

    def batches_of(
        self, fixed: dict[str, object], columns: dict[str, NDArray[np.float64]], drawn: Mapping[str, DrawnColumn],
        flights: NDArray[np.int64], members: NDArray[np.int64],
    ) -> Iterator[PlannedBatch]:  # fmt: skip
        """The flights that agree in every value that is not a number."""
        identity = tuple(map(repr, fixed.values()))
        if identity not in self.direct:
            self.direct[identity] = self.find_direct(fixed, {name: numbers(self.typical[name]) for name in columns})
        direct = {name: columns[name] for name in columns if name in self.direct[identity]}
        others = [name for name in columns if name not in direct]
        alike = list(groups([columns[name] for name in others], len(members)))
        if len(alike) * FEWEST_ALIKE > len(members) and any(drawn[name].options is None for name in others):
            began = time.perf_counter()
            batches = self.one_by_one(fixed, columns, flights, members)
            took = (time.perf_counter() - began) / len(members)
            self.singly |= dict.fromkeys((name for name in others if drawn[name].options is None), took)
            yield from batches
            return
        for chosen, some in alike:
            more = dict(zip(others, chosen, strict=True))
            part = {name: column[some] for name, column in direct.items()}
            self.check((identity, chosen), {**fixed, **more}, part, flights[members[some]])
            yield self.in_one_go({**fixed, **more}, part, flights[members[some]], members[some])

    def in_one_go(
        self, fixed: dict[str, object], columns: dict[str, NDArray[np.float64]], flights: NDArray[np.int64],
        members: NDArray[np.int64],
    ) -> PlannedBatch:  # fmt: skip
        """A batch whose mission was built with arrays in it."""
        plan = self.with_noise(self.array_plan(fixed, columns), flights)
        leaves = flatten((plan.start, plan.parameters))
        places = tuple(place for place, leaf in enumerate(leaves) if isinstance(leaf, np.ndarray))
        rows = np.stack([leaves[place] for place in places], axis=1) if places else np.zeros((len(flights), 0))
        one = [float(leaf[0]) if isinstance(leaf, np.ndarray) else leaf for leaf in leaves]
        start, parameters = rebuild((plan.start, plan.parameters), iter(one))
        return self.batch(members, plan.loop, plan.ticks, start, parameters, places, rows)

    def one_by_one(
        self, fixed: dict[str, object], columns: dict[str, NDArray[np.float64]], flights: NDArray[np.int64],
        members: NDArray[np.int64],
    ) -> list[PlannedBatch]:  # fmt: skip
        """Batches of flights that were built one by one; everything but tables counts as varying."""
        plans = [
            self.plan({**fixed, **{name: column[i].item() for name, column in columns.items()}}, int(flights[members[i]]))
            for i in range(len(members))
        ]
        alike: dict[object, list[int]] = defaultdict(list)
        for i, plan in enumerate(plans):
            given = (plan.start, plan.parameters)
            tables = tuple(tuple(leaf.values) for leaf in flatten(given) if isinstance(leaf, Table))
            alike[plan.loop, plan.ticks, tuple(leaf_names(given)), tables].append(i)
        batches = []
        for some in alike.values():
            first = plans[some[0]]
            leaves = flatten((first.start, first.parameters))
            places = tuple(place for place, leaf in enumerate(leaves) if not isinstance(leaf, Table))
            all_leaves = [flatten((plans[i].start, plans[i].parameters)) for i in some]
            rows = np.array([[one[place] for place in places] for one in all_leaves], dtype=float)
            batches.append(self.batch(members[some], first.loop, first.ticks, first.start, first.parameters, places, rows))
        return batches

    def batch(
        self, members: NDArray[np.int64], loop: Loop, ticks: Ticks, start: tuple[object, ...], parameters: Numbers,
        places: tuple[int, ...], rows: NDArray[np.float64],
    ) -> PlannedBatch:  # fmt: skip
        """A batch, scored. Raises UserError for a campaign of too many structures."""
        self.structures.add((loop, places, len(flatten((start, parameters)))))
        if len(self.structures) > MOST_STRUCTURES:
            raise UserError(
                f"{self.source}: the varied keys change the structure of the flight more than {MOST_STRUCTURES} times, "
                "and each "
                "has to be compiled; vary numbers, or choose from fewer values"
            )
        period = self.score_period or ticks.log * ticks.step
        scored_loop, scored_ticks = scored(loop, ticks, period, self.begin, self.own)
        if ticks.last // scored_ticks.every[-1] * scored_ticks.every[-1] * ticks.step < scored_loop.begin:
            raise UserError(
                f"{self.source}: score_period = {period:g} s: no sample is between score_from and the flight's end"
            )
        return PlannedBatch(members, scored_loop, scored_ticks, start, parameters, places, rows)

    def price(self) -> str:
        """Which keys made flights be built one by one so far, and the time that this takes; empty where none did."""
        if not self.singly:
            return ""
        return (
            f"each flight is set up by itself, {1000.0 * max(self.singly.values()):.2g} ms each, because "
            f"{' and '.join(self.singly)} {SINGLY}; a choice or a grid of few values would cost less"
        )

    # What can be built in one go

    def find_direct(self, fixed: dict[str, object], columns: Mapping[str, NDArray[np.float64]]) -> list[str]:
        """The keys that arrays can stand for, alone and together, giving exactly the numbers of flights built one by one."""
        spread = {name: np.array([column.min(), np.median(column), column.max()]) for name, column in columns.items()}
        first = {name: column[0].item() for name, column in columns.items()}
        others = {name: {key: value for key, value in first.items() if key != name} for name in columns}
        found = [name for name in columns if self.agrees({**fixed, **others[name]}, {name: spread[name]})]
        some = {name: columns[name][:TRIED] for name in found}
        rest = {name: value for name, value in first.items() if name not in found}
        return found if self.agrees({**fixed, **rest}, some) else []

    def agrees(self, fixed: dict[str, object], columns: Mapping[str, NDArray[np.float64]]) -> bool:
        """Whether arrays give the flights that single values give."""
        if not columns:
            return True
        try:
            together = self.array_plan(fixed, columns)
        except (TypeError, ValueError, AttributeError, IndexError, UserError):
            return False
        leaves = flatten((together.start, together.parameters))
        for i in range(len(next(iter(columns.values())))):
            values = {name: column[i].item() for name, column in columns.items()}
            try:
                alone = self.plan({**fixed, **values})
            except UserError:
                return False
            if (alone.loop, alone.ticks) != (together.loop, together.ticks):
                return False
            wanted = flatten((alone.start, alone.parameters))
            if len(wanted) != len(leaves) or not all(same(one, ours, i) for one, ours in zip(wanted, leaves, strict=True)):
                return False
        return True

    def check(
        self, identity: object, fixed: dict[str, object], columns: Mapping[str, Values], flights: NDArray[np.int64]
    ) -> None:
        """Refuse values that the mission refuses. Ranges are checked at their corners, value by value only where
        a corner fails.

        What a mission requires of several keys is linear in them (an order, a sum), so the corners decide for all others.
        """
        if not columns:
            if identity not in self.checked:
                self.plan(fixed, int(flights[0]))
            self.checked[identity] = (np.zeros(0), np.zeros(0))
            return
        low, high = (np.array([end(column) for column in columns.values()]) for end in (np.min, np.max))
        known = self.checked.get(identity)
        if known is not None and (known[0] <= low).all() and (high <= known[1]).all():
            return
        if known is None:  # as far as most flights go, so that it is done once
            usual = [numbers(self.typical[name]) for name in columns]
            known = np.array([one.min() for one in usual]), np.array([one.max() for one in usual])
        low, high = np.minimum(known[0], low), np.maximum(known[1], high)
        try:
            for corner in corners(low, high):
                self.plan({**fixed, **dict(zip(columns, corner, strict=True))})
        except UserError:
            _, places = np.unique(np.stack(list(columns.values()), axis=1), axis=0, return_index=True)
            for i in np.sort(places):
                self.plan({**fixed, **{name: column[i].item() for name, column in columns.items()}}, int(flights[i]))
            return
        self.checked[identity] = (low, high)


def is_random(campaign: Campaign) -> bool:
    """Whether anything of the flights may be drawn at random: a key that varies, if not in a grid, or noise.

    Of plants, airs and functions of the user's own that shows only in flight.
    """
    file = campaign.file
    if file.correlated or not all(isinstance(one, Grid) for one in file.vary.values()):
        return True
    plan = planner(campaign)
    ends = [(name, one) for name, grid in file.vary.items() if isinstance(grid, Grid) for one in extremes(grid.options)]
    try:
        return any(may_draw(plan.mission(values)) for values in ({}, *({name: one} for name, one in ends)))
    except UserError:  # values that go only together
        return True


def extremes(options: Sequence[object]) -> Sequence[object]:
    """The least and the largest of numbers; options of another kind as they are."""
    numbers = [one for one in options if isinstance(one, int | float)]
    return (min(numbers), max(numbers)) if len(numbers) == len(options) else options


def may_draw(mission: Mission) -> bool:
    """Whether a flight of these numbers may differ from another by its noise."""
    if mission.noisy or mission.controller.controller.one_at_a_time:
        return True
    known = isinstance(mission, LagrangeMission) or (
        isinstance(mission, MultirotorMission) and not isinstance(mission.wind.air, DeclaredWind)
    )
    return not known


def planner(campaign: Campaign) -> Planner:
    """The planner of a campaign's flights."""
    file = campaign.file
    typical = draw(file, np.arange(TYPICAL))
    for name, one in file.vary.items():
        if isinstance(one, Grid):  # all its values, however slowly it varies
            places = np.linspace(0, len(one.options) - 1, TYPICAL).round().astype(np.int64)
            typical[name] = DrawnColumn(places, one.options)
    return Planner(
        campaign.content, campaign.defaults, campaign.source, campaign.folder, typical, file.seed, file.score_period,
        campaign.singly,
    )  # fmt: skip

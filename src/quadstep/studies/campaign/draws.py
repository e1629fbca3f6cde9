"""The values of the varying keys, from the flight's number alone: the same in any order and on any machine.

From these values it makes a flight's mission and plan, and from arrays of values the plans of many flights.
"""

import itertools
import json
import warnings
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple, TypeAlias, cast

import numpy as np
from numpy.typing import NDArray

from quadstep.engines.fly import FlightPlan
from quadstep.engines.own_checks import NotFiniteError
from quadstep.io.errors import UserError
from quadstep.mission.distributions import Choice, Grid, LogNormal, Normal, Sobol, Uniform
from quadstep.mission.fields import overridden, with_value
from quadstep.mission.read import check_mission
from quadstep.mission.schema import Mission
from quadstep.numbers import Number, Table, Vector, flatten, rebuild
from quadstep.numbers.noise import Key, key, uniforms
from quadstep.studies.campaign.schema import CampaignFile

VERSION = 2
"""Version of the draws, raised whenever a flight's seed and number give other values. Version 1 depended on the machine."""

STREAM = 2**25
"""Stream of the random numbers that campaigns draw; a flight's own noise uses small stream numbers."""

A_TICK = 128
"""Numbers drawn at one tick of the counter."""

Values: TypeAlias = NDArray[np.generic]
"""One element per flight: numbers, places of options, or text."""


class DrawnColumn(NamedTuple):
    """A column of values. options: if not None, `values` are indices into it."""

    values: Values
    options: tuple[object, ...] | None = None

    def at(self, place: int) -> object:
        value = self.values[place]
        return float(value) if self.options is None else self.options[value]

    def column(self) -> Values:
        if self.options is None:
            return self.values
        shown = self.shown_options()
        return np.array(shown, dtype=object if isinstance(shown[0], str) else None)[self.values]

    def shown_options(self) -> list[object]:
        """The options as numbers, booleans or text (JSON for anything else)."""
        options = list(self.options or ())
        kinds = {type(option) for option in options}
        if kinds == {int, float}:
            return [float(cast(float, option)) for option in options]
        if len(kinds) == 1 and kinds <= {int, float, bool, str}:
            return options
        return [json.dumps(option, sort_keys=True) for option in options]


def noise_keys(seed: int, flights: NDArray[np.int64]) -> Key:
    """The keys of the flights' noise, each part an array; as `noise.key`."""
    *first, high, low = key(seed, 0).words
    halves = [np.full(len(flights), half) for half in first]
    halves += [(int(half) ^ part).astype(float) for half, part in ((high, flights >> 16), (low, flights & 0xFFFF))]
    return Key(Vector(cast(list[Number], halves)))


def draw(file: CampaignFile, flights: NDArray[np.int64]) -> dict[str, DrawnColumn]:
    """The values of each key for the flights of these consecutive numbers."""
    with np.errstate(all="ignore"):  # a value beyond the range of floats is refused with its flight
        return draw_columns(file, flights)


def draw_columns(file: CampaignFile, flights: NDArray[np.int64]) -> dict[str, DrawnColumn]:
    """`draw`, with NumPy's warnings."""
    spread = [one for one in file.vary.values() if isinstance(one, Sobol)]
    shared = shares(file, noise_keys(file.seed, flights))
    points = iter(sobol(file.seed, flights, len(spread)))
    drawn = from_shares(file, shared)
    every = 1
    for name, one in reversed(file.vary.items()):  # the last grid varies fastest
        if isinstance(one, Grid):
            drawn[name] = DrawnColumn((flights // every) % len(one.options), one.options)
            every *= len(one.options)
    for name, one in file.vary.items():
        if isinstance(one, Sobol):
            drawn[name] = DrawnColumn(cast(Values, one.quantile(cast(Number, next(points)))))
    return {name: drawn[name] for name in file.keys}


def from_shares(file: CampaignFile, shared: dict[str, Number]) -> dict[str, DrawnColumn]:
    """The values of all keys but grids and Sobol sequences, from a number in (0, 1) for each."""
    drawn = {name: DrawnColumn(cast(Values, value)) for name, value in continuous(file, shared).items()}
    chosen = {
        name: DrawnColumn(one.place(shared[name]), one.options) for name, one in file.vary.items() if isinstance(one, Choice)
    }
    return drawn | chosen


def shares(file: CampaignFile, key: Key) -> dict[str, Number]:
    """A number uniform in (0, 1) for each key that is drawn independently; a law over numbers."""
    names = [name for name, one in file.vary.items() if not isinstance(one, Sobol | Grid)]
    names += [name for group in file.correlated for name in group.keys]
    return dict(zip(names, many_uniforms(key, len(names)), strict=True))


def continuous(file: CampaignFile, shared: dict[str, Number]) -> dict[str, Number]:
    """The values of the keys with continuous distributions; a law over numbers."""
    drawn = {
        name: one.quantile(shared[name])
        for name, one in file.vary.items()
        if isinstance(one, Uniform | Normal | LogNormal) and not isinstance(one, Sobol)
    }
    for group in file.correlated:
        drawn.update(zip(group.keys, group.quantiles([shared[name] for name in group.keys]), strict=True))
    return drawn


def many_uniforms(key: Key, count: int) -> list[Number]:
    """`count` independent numbers, uniform in (0, 1)."""
    ticks = range(-(-count // A_TICK))
    return [u for tick in ticks for u in uniforms(key, STREAM, float(tick), min(A_TICK, count - tick * A_TICK))]


def sobol(seed: int, flights: NDArray[np.int64], dimensions: int) -> list[Values]:
    """Columns of a Sobol sequence (Joe and Kuo 2008), digitally shifted by the seed so that no point is at a corner."""
    if not dimensions:
        return []
    from scipy.stats import qmc  # noqa: PLC0415 (an extra, loaded where it is used)

    sequence = qmc.Sobol(dimensions, scramble=False, bits=32)
    if flights[0]:
        sequence.fast_forward(int(flights[0]))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a count that is not a power of two: the sequence continues with the next chunk
        points = sequence.random(len(flights))
    whole = (points * 2.0**32).astype(np.uint64)
    shifts = [int(u * 2.0**32) for u in many_uniforms(key(seed ^ 0x50B01, 0), dimensions)]
    return [((whole[:, i] ^ np.uint64(shift)).astype(float) + 0.5) * 2.0**-32 for i, shift in enumerate(shifts)]


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


def numbers(column: DrawnColumn) -> NDArray[np.float64]:
    values = column.values if column.options is None else np.array(column.options, dtype=float)[column.values]
    return np.asarray(values, dtype=float)


def option(column: DrawnColumn, place: int) -> object:
    assert column.options is not None
    return column.options[place]


def same(alone: object, together: object, place: int) -> bool:
    """Whether a leaf of a single flight equals the arrays' value for it, to the bit."""
    if isinstance(alone, Table) or isinstance(together, Table):
        return isinstance(alone, Table) and isinstance(together, Table) and alone.values == together.values
    return bool(alone == (together[place] if isinstance(together, np.ndarray) else together))


def values_text(values: Mapping[str, object]) -> str:
    """Values as in TOML, the first of many."""
    texts = {
        name: json.dumps(value, separators=(", ", " = "), default=str) for name, value in itertools.islice(values.items(), 8)
    }
    return ", ".join(f"{name} = {text if len(text) <= 60 else f'{text[:59]}…'}" for name, text in texts.items())


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
                said = "cannot vary "
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

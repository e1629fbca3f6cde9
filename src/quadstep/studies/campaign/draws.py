"""The values of the varying keys, from the flight's number alone: the same in any order and on any machine."""

import json
import warnings
from typing import NamedTuple, TypeAlias, cast

import numpy as np
from numpy.typing import NDArray

from quadstep.mission.distributions import Choice, Grid, LogNormal, Normal, Sobol, Uniform
from quadstep.numbers import Number, Vector
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
        result: Values = np.array(shown, dtype=object if isinstance(shown[0], str) else None)[self.values]
        return result

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
        return drawn_columns(file, flights)


def drawn_columns(file: CampaignFile, flights: NDArray[np.int64]) -> dict[str, DrawnColumn]:
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

"""What the flights of a cell are like: medians, 95 % quantiles and losses, each with its interval.

A lost flight has no error; it counts as worse than every other. So a quantile is over all flights, and infinite where too
many are lost: a controller cannot gain by losing its worst flights.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from quadstep.metrics.statistics import Estimate, ordered_quantile, share
from quadstep.studies.campaign.flown import OUTCOME, OUTCOMES
from quadstep.studies.campaign.schema import Campaign

Floats = NDArray[np.float64]


class Flown(NamedTuple):
    """The flights of a cell. lost: which did not complete. metrics: by name without unit, NaN where lost. others: the same
    flights with the gains of other searches.
    """

    lost: NDArray[np.bool_]
    metrics: dict[str, Floats]
    others: tuple["Flown", ...] = ()

    @property
    def every(self) -> tuple["Flown", ...]:
        """The flights with the gains of each search."""
        return (self, *self.others)

    def ranked(self, name: str) -> Floats:
        """A metric in which a lost flight is worse than any other."""
        return np.where(self.lost, math.inf, self.metrics[name])


class Spread(NamedTuple):
    """A metric of a cell. mean: over completed flights, NaN without any; median, high: quantiles of 50 % and 95 % of all."""

    mean: float
    median: Estimate
    high: Estimate


class Effort(NamedTuple):
    """Means over completed flights, NaN without any: energy [J], rotor activity [N/s], share of time at the rotors' limits."""

    energy: float
    activity: float
    saturation: float


def flown_of(table: pa.Table, campaign: Campaign) -> Flown:
    """The flights of a campaign's table."""
    lost = table[OUTCOME].to_numpy() != OUTCOMES[0]
    metrics = {}
    for name, full in campaign.thresholds.items():
        values = np.array(table[full].to_numpy(zero_copy_only=False), dtype=np.float64)
        lost = lost | ~np.isfinite(values)
        metrics[name] = values
    return Flown(lost, {name: np.where(lost, math.nan, values) for name, values in metrics.items()})


def spread(flown: Flown, name: str) -> Spread:
    values, ranked = flown.metrics[name][~flown.lost], [one.ranked(name) for one in flown.every]
    median, high = (hull([ordered_quantile(one, q) for one in ranked]) for q in (0.5, 0.95))
    return Spread(float(values.mean()) if len(values) else math.nan, median, high)


def losses(flown: Flown) -> Estimate:
    """The share lost, with its exact interval."""
    return hull([share(int(one.lost.sum()), len(one.lost)) for one in flown.every])


def hull(found: Sequence[Estimate]) -> Estimate:
    """The first value, with an interval about those of all; unknown where one of them is."""
    low, high = np.array([one[1:] for one in found]).T
    return Estimate(found[0].value, float(low.min()), float(high.max()))


def effort(flown: Flown) -> Effort:
    """Means, where the vehicle's flights have them."""

    def mean(name: str) -> float:
        values = flown.metrics.get(name, np.zeros(0))[~flown.lost] if name in flown.metrics else np.zeros(0)
        return float(values.mean()) if len(values) else math.nan

    return Effort(mean("energy"), mean("rotor_activity"), mean("saturation"))

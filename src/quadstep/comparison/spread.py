"""What the flights of a cell are like: medians, 95 % quantiles and losses, each with its interval.

A lost flight has no error; it counts as worse than every other. So a quantile is over all flights, and infinite where too
many are lost: a controller cannot gain by losing its worst flights.
"""

import math
from typing import NamedTuple

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from quadstep.analysis.statistics import Estimate, ordered_quantile, share
from quadstep.campaign.flown import OUTCOME, OUTCOMES
from quadstep.campaign.schema import Campaign

Floats = NDArray[np.float64]


class Flown(NamedTuple):
    """The flights of a cell. lost: which did not complete. metrics: by name without unit, NaN where lost."""

    lost: NDArray[np.bool_]
    metrics: dict[str, Floats]

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
    """A metric."""
    values = flown.metrics[name][~flown.lost]
    ranked = flown.ranked(name)
    return Spread(
        float(values.mean()) if len(values) else math.nan, ordered_quantile(ranked, 0.5), ordered_quantile(ranked, 0.95)
    )


def losses(flown: Flown) -> Estimate:
    """The share lost, with its exact interval."""
    return share(int(flown.lost.sum()), len(flown.lost))


def effort(flown: Flown) -> Effort:
    """Means, where the vehicle's flights have them."""

    def mean(name: str) -> float:
        values = flown.metrics.get(name, np.zeros(0))[~flown.lost] if name in flown.metrics else np.zeros(0)
        return float(values.mean()) if len(values) else math.nan

    return Effort(mean("energy"), mean("rotor_activity"), mean("saturation"))

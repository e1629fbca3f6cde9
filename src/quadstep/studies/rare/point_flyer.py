"""Flies sampled values of the keys: which flights failed, and by a score of metrics how close the others came to failure."""

from collections.abc import Sequence
from enum import Enum
from pathlib import Path
from typing import NamedTuple, cast

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray
from scipy.special import ndtr

from quadstep.interfaces.closed_loop import Advance
from quadstep.io.errors import UserError
from quadstep.mission.distributions import Grid, Sobol
from quadstep.studies.campaign.draws import DrawnColumn, Values, draw, from_shares
from quadstep.studies.campaign.flyer import OUTCOME, OUTCOMES, SUCCESS, Flyer
from quadstep.studies.campaign.planner import TYPICAL
from quadstep.studies.campaign.schema import Campaign, CampaignFile
from quadstep.studies.rare.mixture import Evaluate, Floats, Points

LEAST, MOST = 2.0**-1000, 1.0 - 2.0**-53
"""Range of a share in which quantile functions are finite. The probability above it, at 8.2 deviations, is 1e-16."""


def check_space(file: CampaignFile, path: Path) -> None:
    """Refuses a campaign in which nothing is drawn, or not every key. Raises UserError."""
    grids = [name for name, one in file.vary.items() if isinstance(one, Grid)]
    if grids:
        raise UserError(f"{path}: vary.{grids[0]}: a grid has no probabilities; use a choice or a distribution")
    if not file.keys:
        raise UserError(f"{path}: vary: empty; --rare needs keys with distributions, --until does not")


def values(file: CampaignFile, latent: Floats) -> dict[str, DrawnColumn]:
    """The values of all keys. latent: shape (flights, keys)."""
    shares = np.clip(ndtr(latent), LEAST, MOST)
    shared = dict(zip(file.keys, shares.T, strict=True))
    drawn = from_shares(file, shared)
    drawn |= {
        name: DrawnColumn(cast(Values, one.quantile(shared[name])))
        for name, one in file.vary.items()
        if isinstance(one, Sobol)
    }
    return {name: drawn[name] for name in file.keys}


BOUND = "--rare also flies what hardly any flight of the campaign draws: give {} low or high in [vary]{}"

FAR = 8.0
"""Deviations at which values are tried before anything is flown: a mission that accepts these accepts all in between."""


class Failure(Enum):
    """The kind of failure that is sought."""

    ABOVE = "completed, above a limit"
    EARLY = "ended early"
    ANY = "any"


class Scale(NamedTuple):
    """Origin and unit in which a metric is counted."""

    zero: float
    unit: float


class Event(NamedTuple):
    """Failures, and what predicts them: the largest of some metrics, each on its own scale. scales: by name without unit."""

    failure: Failure
    scales: dict[str, Scale]


class PointFlyer:
    """Flies points of a campaign. noisy: whether two flights with the same values may differ."""

    def __init__(self, campaign: Campaign) -> None:
        self.campaign, self.flyer = campaign, Flyer(campaign)
        self.flyer.rehearse()
        first, planner = np.arange(TYPICAL), self.flyer.planner
        self.typical = self.flyer.fly_values(first, dict(planner.typical))
        one = next(iter(planner.batches(first[:1], draw(campaign.file, first[:1]))))
        self.noisy = hasattr(one.parameters, "key")
        far = values(campaign.file, np.outer([FAR, -FAR], np.ones(len(campaign.file.keys))))
        try:
            list(planner.batches(first[:2], far))
        except UserError:  # refused flight by flight, should it occur
            return

    def events(self) -> list[Event]:
        """The failures sought, each with the score that predicts it. A score that the user names is for any failure.

        Without one, the largest ratio of a metric to its limit predicts that a limit is exceeded; how much the inputs vary,
        relative to what is typical, predicts that a flight ends early: a loop that becomes unstable shows there first.
        """
        file = self.campaign.file
        if file.rare.score:
            return [Event(Failure.ANY, self.scales(file.rare.score))]
        early = Event(Failure.EARLY, self.activity)
        limits = {name: Scale(0.0, most) for name, most in file.failure.items()}
        return [Event(Failure.ABOVE, limits), early] if limits else [early]

    @property
    def activity(self) -> dict[str, Scale]:
        """The metrics of how much the inputs vary."""
        names = [name for name in self.campaign.thresholds if name.startswith("variation_")]
        return self.scales(names or ["largest_error"])

    def scales(self, names: Sequence[str]) -> dict[str, Scale]:
        """Scales of these metrics over typical flights: zero at the median, one at the 90 % quantile."""
        return {name: scale(self.typical[self.campaign.thresholds[name]].to_numpy()) for name in names}

    def evaluate(self, events: Sequence[Event], progress: Advance) -> Evaluate:
        """A function that flies points and scores how close each came to each event, infinite where it occurred."""

        def fly(points: Points) -> Floats:
            table = self.fly(points)
            progress(table.num_rows)
            return np.array([self.scored(table, event) for event in events])

        return fly

    def scored(self, table: pa.Table, event: Event) -> Floats:
        """How close each flight of a table came to an event, infinite where it occurred."""
        columns = [(self.campaign.thresholds[name], scale) for name, scale in event.scales.items()]
        parts = [(table[name].to_numpy().astype(np.float64) - zero) / unit for name, (zero, unit) in columns]
        score = np.nan_to_num(np.max(parts, axis=0), nan=-1e300, posinf=1e300, neginf=-1e300)
        failed: NDArray[np.bool_] = ~table[SUCCESS].to_numpy()
        completed: NDArray[np.bool_] = table[OUTCOME].to_numpy() == OUTCOMES[0]
        occurred = {Failure.ANY: failed, Failure.ABOVE: failed & completed, Failure.EARLY: failed & ~completed}
        return np.where(occurred[event.failure], np.inf, score)

    def fly(self, points: Points) -> pa.Table:
        """The flights of these points, one row each. Raises UserError for values that cannot be flown."""
        with np.errstate(all="ignore"):
            try:
                return self.flyer.fly_values(points.noise, values(self.campaign.file, points.latent))
            except UserError as error:
                keys = [one for one in self.campaign.file.keys if f": {one}: " in str(error)]
                said = [BOUND.format(one, ", not in [[correlated]]" * (one not in self.campaign.file.vary)) for one in keys]
                raise UserError("; ".join([str(error), *said])) from None


def scale(column: NDArray[np.float64]) -> Scale:
    known = column[np.isfinite(column.astype(np.float64))].astype(np.float64)
    if not len(known):
        return Scale(0.0, 1.0)
    middle, high = np.quantile(known, [0.5, 0.9])
    return Scale(float(middle), float(high - middle) or 1.0)

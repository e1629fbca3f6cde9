"""The cases of known probability without their flights: their metrics are those of the start, which needs no flying."""

from collections.abc import Callable, Sequence

import numpy as np

from benchmarks.rare.cases.first_sample import UNIT, Corner, Edge, FirstSample, Radius, Side, Sum
from quadstep.studies.campaign.draws import numbers
from quadstep.studies.campaign.schema import Campaign
from quadstep.studies.rare.mixture import Evaluate, Floats, Points
from quadstep.studies.rare.point_flyer import Event, Failure, PointFlyer, Scale, values

METRICS: dict[str, FirstSample] = {one.name: one for one in (Sum(), Side(), Corner(), Radius(), Edge())}


class Starts(PointFlyer):
    """What a campaign of these cases draws, judged as its flights are."""

    def __init__(self, campaign: Campaign) -> None:
        self.campaign, self.noisy = campaign, False
        ((self.name, self.limit),) = campaign.file.failure.items()

    def events(self) -> list[Event]:
        """Their only one. Its scale does not matter."""
        return [Event(Failure.ANY, {self.name: Scale(0.0, 1.0)})]

    def evaluate(self, events: Sequence[Event], told: Callable[[int], None]) -> Evaluate:
        """As `PointFlyer.evaluate`."""

        def judged(points: Points) -> Floats:
            told(len(points.noise))
            drawn = values(self.campaign.file, points.latent)
            x, y, z = (numbers(drawn[f"start.position.{axis}"]) / UNIT for axis in range(3))
            score: Floats = METRICS[self.name].of(x, y, z)  # type: ignore[arg-type,assignment]  # arrays are numbers here
            return np.array([np.where(score > self.limit, np.inf, score) for _ in events])

        return judged

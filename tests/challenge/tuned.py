"""That roll and pitch can be tuned on an identified model: default gains for it, on the vehicle whose flights it is fitted
to.
"""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from quadstep.identify.fit import identify
from quadstep.identify.uses import ENOUGH, TUNED, USES, reach
from quadstep.identify.vehicle_file import identified_vehicle
from quadstep.io.errors import UserError
from quadstep.linear.grade import Grade, grade
from quadstep.metrics.registry import SOUND
from quadstep.mission.airframe import AirframeSection
from quadstep.mission.read import check_mission
from quadstep.mission.schema import Mission
from quadstep.studies.tuning.gains import filled_in
from tests import made_flights
from tests.challenge.search import Attempt, Search

LAWS = "geometric", "pid", "indi", "lqr"
DRAWN = {
    "inertia[0]": (0.7, 1.4), "inertia[1]": (0.7, 1.4), "rotor.rise_time": (0.6, 1.2), "drag.rotor[0]": (0.5, 2.0),
    "drag.flapping": (0.5, 2.0), "rotor.inertia": (0.5, 2.0),
}  # fmt: skip
"""By what numbers of the made vehicle are multiplied."""

LEFT = 0.5
"""Of the margins that are asked of the model, what the vehicle has to have: the model may be off by `ENOUGH`."""


def hovering(vehicle: AirframeSection, law: str, gains: dict[str, Any]) -> Mission:
    path = {"type": "circle", "centre": [0.0, 0.0, 1.5], "radius": 1e-4, "period": 10.0}
    table = vehicle.model_dump(exclude_none=True, mode="json")
    return check_mission({"vehicle": table, "path": path, "controller": {"type": law, **gains}}, "hover", Path())


def short(found: Grade) -> float:
    """The share of a margin that has to be left over the margin, of the one of roll and pitch that is nearest to it."""
    shares = [LEFT * one.limit / one.value for one in found.measures if one.channel.startswith((*TUNED,))]
    return max(shares, default=0.0) if found.measures else math.inf


def tuned(seed: int) -> Iterator[Attempt]:
    """The test on a held-out flight is left out: the verdict rests on intervals alone, and is given more often."""
    random, made = np.random.default_rng(seed), dict(made_flights.TRUTH)
    while True:
        drawn = {key: float(random.uniform(*ends)) for key, ends in DRAWN.items()}
        made_flights.TRUTH.update({key: made[key] * by for key, by in drawn.items()})
        wrong, number = random.uniform(0.8, 1.25, 3), int(random.integers(1000))
        begun = made_flights.misgiven(made_flights.start(), *wrong)
        case = f"the made vehicle times {drawn}, logged({number})[:2], given {wrong}"
        try:
            found = identify(made_flights.logged(number)[:2], begun, lambda _: None, predictors=False, still=True)
        except UserError as error:
            yield Attempt(0.0, f"{case}: {error}")
            continue
        keys = {key for axis in TUNED for key in USES[axis][0]}
        if max(max(reach(found, key)) for key in keys) > ENOUGH:
            yield Attempt(0.0, f"{case}: cannot be tuned on")
            continue
        true = {key: one._replace(value=made_flights.true_value(key, begun)) for key, one in found.fitted.items()}
        model, vehicle = (identified_vehicle(begun, one, "", "") for one in (found, found._replace(fitted=true)))
        for law in LAWS:
            mission = hovering(model, law, {})
            if grade(mission).word == SOUND:
                flown = grade(hovering(vehicle, law, filled_in(mission)))
                yield Attempt(short(flown), f"{case}: {law}: {flown.sentence}")


SEARCHES = [
    Search(
        "gains tuned on a model",
        "where roll and pitch can be tuned on a model, gains sound on it keep half of the margins asked on the vehicle",
        tuned,
        slow=True,
    )
]

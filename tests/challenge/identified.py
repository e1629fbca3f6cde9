"""Intervals of `identify` against the truth, on calm, smooth, short and lively flights of known vehicles in closed loop."""

import math
from collections.abc import Iterable

import numpy as np

from quadstep.identify.fit import Fitted, identify
from quadstep.io.errors import UserError
from tests.calm_flights import PATHS, WOBBLY, logged, start, true_values
from tests.challenge.search import Attempt, Search

PRESETS = ("x500", "crazyflie", "research-2.6kg")
FAR = 2.0
"""Halves of a 95 % interval from its middle, beyond which a number misleads and is not merely one of the twenty."""


def off(one: Fitted, true: float) -> float:
    """How far a number is from the truth, in halves of its interval."""
    if one.low > 0.0 and true > 0.0:
        half = 0.5 * math.log(one.high / one.low)
        return abs(math.log(true) - 0.5 * math.log(one.high * one.low)) / half
    return abs(true - 0.5 * (one.low + one.high)) / max(0.5 * (one.high - one.low), 1e-12)


def flights(seed: int) -> Iterable[Attempt]:
    random = np.random.default_rng(seed)
    while True:
        name, path = str(random.choice(PRESETS)), str(random.choice(list(PATHS)))
        duration, noise = float(random.choice([8.0, 12.0, 20.0, 40.0])), float(random.choice([0.1, 0.3, 1.0]))
        guidance, number = float(random.choice([0.002, 0.002, 0.01])), int(random.integers(1000))
        fastest, turn = float(random.choice([0.5, 2.0, 6.0])), float(random.choice([0.0, 0.3, 2.0 * math.pi / 10.0]))
        wind = {"mean": [*random.uniform(-fastest, fastest, 2).tolist(), 0.0]} if random.random() < 0.5 else None
        gains = WOBBLY if name == "x500" and random.random() < 0.3 else None
        case = f"logged({name!r}, {path!r}, {number}, {duration}, {noise}, {guidance}, {wind}, turn={turn}, gains={gains})"
        try:
            flight = logged(name, path, number, duration, noise, guidance, wind, turn=turn, gains=gains)
            found = identify([flight], start(name), lambda _: None, predictors=False)
        except UserError as error:
            yield Attempt(0.0, f"{case}: {error}")
            continue
        truth = true_values(name)
        worst, key = max(((off(one, truth[key]), key) for key, one in found.fitted.items()), default=(0.0, "nothing"))
        yield Attempt(worst / FAR, f"{case}: {key} is {worst:.2g} halves of its interval off")


SEARCHES = [
    Search("interval of an identified number", "no identified number is further off than twice its 95 % interval", flights)
]

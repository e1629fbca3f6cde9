"""Intervals of `identify` against the truth: on calm, smooth, short and lively flights of presets, and on vehicles of another
simulator, with structure that the package's models lack.

`python -m tests.challenge.identified [VEHICLES] [SEED]` prints each interval of the latter that misses, and their coverage.
"""

import itertools
import math
import sys
from collections.abc import Iterable, Iterator

import numpy as np

from quadstep.identify.fit import Fitted, identify
from quadstep.identify.parameters import VEHICLE
from quadstep.io.errors import UserError
from tests.calm_flights import PATHS, WOBBLY, logged, start, true_values
from tests.challenge.search import Attempt, Search, coverage
from tests.independent_flights import Case, cases
from tests.made_flights import misgiven, scale

PRESETS = ("x500", "crazyflie", "research-2.6kg")
TOGETHER = 10
"""Vehicles that are simulated at once."""

FAR = 2.0
"""Halves of a 95 % interval from its middle, beyond which a number misleads and is not merely one of the twenty."""


LINEAR = {one.key for one in VEHICLE if not one.logarithmic}


def off(key: str, one: Fitted, true: float) -> float:
    """How far a number is from the truth, in halves of its interval, on the scale on which it was searched."""
    if key not in LINEAR and one.low > 0.0 and true > 0.0:
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
        wrong = random.uniform(0.75, 1.3, 3)
        given = misgiven(start(name), *wrong)
        case = f"logged({name!r}, {path!r}, {number}, {duration}, {noise}, {guidance}, {wind}, turn={turn}, gains={gains})"
        case += f", given {wrong}"
        try:
            flight = logged(name, path, number, duration, noise, guidance, wind, turn=turn, gains=gains)
            found = identify([flight], given, lambda _: None, predictors=False)
        except UserError as error:
            yield Attempt(0.0, f"{case}: {error}")
            continue
        truth = {key: scale(key, given, start(name)) * one for key, one in true_values(name).items()}
        worst, key = max(((off(key, one, truth[key]), key) for key, one in found.fitted.items()), default=(0.0, "nothing"))
        yield Attempt(worst / FAR, f"{case}: {key} is {worst:.2g} halves of its interval off")


def vehicles(seed: int) -> Iterator[tuple[Case, dict[str, float]]]:
    """Flights of the other simulator, and how far each number that was identified is off, in halves of its interval."""
    for batch in itertools.count(seed):
        seconds = float(np.random.default_rng(batch).choice([8.0, 8.0, 20.0, 40.0]))
        for case in cases(batch, TOGETHER, seconds):
            try:
                found = identify([case.flight], case.start, lambda _: None, predictors=False).fitted
            except UserError:
                found = {}
            yield case, {key: off(key, one, case.truth[key]) for key, one in found.items()}


def of_structure(seed: int) -> Iterable[Attempt]:
    for case, far in vehicles(seed):
        worst, key = max(((one, key) for key, one in far.items()), default=(0.0, "nothing"))
        yield Attempt(worst / FAR, f"seed {seed}, {case.drawn}: {key} is {worst:.2g} halves of its interval off")


def covered(seed: int) -> Iterable[Attempt]:
    return coverage((one <= 1.0 for _, far in vehicles(seed) for one in far.values()), batch=5)


SEARCHES = [
    Search(
        "interval of an identified number",
        "no identified number is further off than twice its 95 % interval, whatever mass, k_f and J_z are given",
        flights,
        slow=True,
    ),
    Search("interval, other simulator", "nor where the vehicle has structure that no model has", of_structure, slow=True),
    Search("coverage, other simulator", "intervals of identified numbers hold 95 % of them there", covered, slow=True),
]


def main(count: int, seed: int) -> None:
    every: list[float] = []
    for number, (case, far) in enumerate(itertools.islice(vehicles(seed), count)):
        every += far.values()
        missed = [f"{number} {key}: {one:.2f} halves off; {case.drawn}\n" for key, one in far.items() if one > 1.0]
        sys.stdout.writelines(missed)
    held = sum(one <= 1.0 for one in every)
    share, most = 100.0 * held / max(len(every), 1), max(every, default=0.0)
    sys.stdout.write(
        f"{count} vehicles, {len(every)} intervals: {held} hold ({share:.1f} %), the worst {most:.2f} halves off\n"
    )


if __name__ == "__main__":
    main(*(int(given) for given in [*sys.argv[1:], *("100", "1")[len(sys.argv) - 1 :]]))

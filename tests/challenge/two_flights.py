"""How far two flights and their advice bring a vehicle that starts from its autopilot's default gains.

`python -m tests.challenge.two_flights [COUNT [SEED [SECONDS]]]` draws vehicles, flies each with sticks that snap, loads what
`advise` says, flies again, loads again, and compares margins and tracking with the best factor on the gains that there is.
"""

import itertools
import math
import sys
from collections import Counter
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from quadstep.identify.changes import changes
from quadstep.identify.plant import loop_margins
from quadstep.identify.rate_loops import ARDUPILOT, PX4, RateLoop
from quadstep.io.errors import UserError
from tests.challenge.advice import CLOSE
from tests.challenge.search import Attempt, Search
from tests.challenge.setpoints import DURATION, EVERY, OMEGA, changed, least, parameters, read
from tests.rate_flights import LONGER, PERIOD, Axis, flown, stepped

DEFAULTS = {
    "px4": {"p": 0.15, "i": 0.2, "d": 0.003, "attitude": 6.5, "cut": 40.0, "slope": 30.0, "target": math.inf,
        "error": math.inf},
    "ardupilot": {"p": 0.135, "i": 0.135, "d": 0.0036, "attitude": 4.5, "cut": 20.0, "slope": 20.0, "target": 20.0,
        "error": math.inf},
}  # fmt: skip
"""Of roll: PX4 1.15 and Copter 4.6."""

TRIED = np.geomspace(0.25, 8.0, 26)
"""Factors on the gains among which the best is sought, where they stay in the range that the autopilot documents."""

NOISE, GUST, TRACKED = 1e-3, 0.3, 15.0
"""Of a gyro [rad/s a sample], of the air [rad/s^2]; length of a flight that tells tracking [s]."""


class Tuned(NamedTuple):
    """Least margins as shares of a sound loop's, with the defaults, after one flight's advice and after two; tracking errors
    (n + 1,): with the defaults, after each, and the best of a sound loop; what `advise` said of each flight.
    """

    margins: tuple[float, ...]
    errors: tuple[float, ...]
    said: tuple[str, ...]


def drawn(random: np.random.Generator, count: int, form: str) -> Axis:
    """Vehicles with default gains."""

    def between(low: float, high: float) -> np.ndarray:
        return np.exp(random.uniform(np.log(low), np.log(high), count))

    own = {name: np.full(count, value) for name, value in DEFAULTS[form].items()}
    own |= {"effect": between(20.0, 400.0), "lag": between(0.012, 0.07), "delay": random.integers(1, 4, count)}
    late = form == "ardupilot"
    own |= {"period": np.full(count, LONGER if late else PERIOD), "after": np.full(count, float(late))}
    return Axis(**own)


def tracking(axes: Axis, angle: np.ndarray) -> np.ndarray:
    """RMS of the rate's error over that of its setpoint, in still air (n,)."""
    steps = round(TRACKED / float(axes.period[0]))
    r, y, _ = flown(axes, angle[:steps, None] * axes.attitude, every=1)
    return np.sqrt(((r - y) ** 2).mean(axis=0) / (r**2).mean(axis=0))


def flight(loop: RateLoop, axes: Axis, angle: np.ndarray, seed: int) -> tuple[Axis, list[str]]:
    """The vehicles with what `advise` says of their flights, and in a word what that is."""
    with np.errstate(all="ignore"):
        columns = flown(axes, angle[:, None] * axes.attitude, NOISE, GUST, seed, EVERY[loop.form])
    time = EVERY[loop.form] * float(axes.period[0]) * np.arange(len(columns[0]))
    then, said = [], []
    for place in range(len(axes.p)):
        one, signals = alone(axes, place), [column[:, place] for column in columns]
        word = "lost"
        if np.isfinite(signals[2]).all() and np.abs(signals[1]).max() < 50.0:
            try:
                found = read(loop, time, signals, parameters(loop, Axis(*(field[0] for field in one))))
            except UserError:
                word = "refused"
            else:
                now, behind = loop_margins(found)
                word, advice = now.grade, changes(found, now, behind)
                one, word = (changed(one, advice, loop), "advised") if advice else (one, word)
        then.append(one)
        said.append(word)
    return Axis(*map(np.concatenate, zip(*then, strict=True))), said


def alone(axes: Axis, place: int) -> Axis:
    return Axis(*(field[[place]] for field in axes))


def tried(loop: RateLoop, one: Axis) -> np.ndarray:
    """Factors with which the gains stay in their documented ranges."""
    gains = (loop.gains(parameters(loop, one)) or {}).items()
    return TRIED[min(loop.documented(name)[1] / value for name, value in gains) >= TRIED]


def tuned(random: np.random.Generator, count: int, loop: RateLoop, duration: float = DURATION) -> list[Tuned]:
    steps, said = [drawn(random, count, loop.form)], []
    angle = stepped(random, duration, period=float(steps[0].period[0]))
    factors = tried(loop, Axis(*(field[0] for field in steps[0])))
    for number in range(2):
        then, words = flight(loop, steps[-1], angle, number)
        steps.append(then)
        said.append(words)
    wide = Axis(*(np.repeat(field, len(factors)) for field in steps[0])).scaled(np.tile(factors, count))
    with np.errstate(all="ignore"):
        errors = tracking(wide, angle).reshape(count, -1)
        follow = [tracking(step, angle) for step in steps]
    made = []
    for place in range(count):
        sound = [margin(alone(wide, place * len(factors) + by)) >= 1.0 for by in range(len(factors))]
        best = min(errors[place][sound], default=math.nan)
        margins = tuple(margin(alone(step, place)) for step in steps)
        made.append(Tuned(margins, (*(float(one[place]) for one in follow), float(best)), tuple(one[place] for one in said)))
    return made


def margin(one: Axis) -> float:
    """The least margin as a share of a sound loop's; infinite where no gain is 1."""
    opened = one.opened(OMEGA)[0]
    return least(opened)[2] if (np.abs(opened) > 1.0).any() else math.inf


def flies(one: Tuned) -> bool:
    """Whether a vehicle flies with the default gains."""
    return one.margins[0] > 0.0 and one.said[0] != "lost"


def searched(seed: int) -> Iterable[Attempt]:
    random = np.random.default_rng(seed)
    for loop in itertools.cycle((PX4[0], ARDUPILOT[0])):
        for one in tuned(random, 10, loop):
            if flies(one):
                said = f"{loop.form}: {one.said}, margins {one.margins} of a sound loop's"
                yield Attempt(0.0 if one.margins[2] >= min(one.margins[0], CLOSE) else 2.0, said)


SEARCHES = [Search("two flights and their advice", "no vehicle has less margin after them than before", searched, slow=True)]


def main() -> None:
    numbers = [int(one) for one in sys.argv[1:]]
    count, seed, seconds = numbers + [100, 20261128, round(DURATION)][len(numbers) :]
    for loop in (PX4[0], ARDUPILOT[0]):
        every = tuned(np.random.default_rng(seed), count, loop, float(seconds))
        flying = [one for one in every if flies(one)]
        sound = [sum(one.margins[place] >= 1.0 for one in flying) for place in range(3)]
        behind = [
            float(np.nanmedian([one.errors[place] / one.errors[3] for one in flying if one.margins[place] >= 1.0]))
            for place in range(3)
        ]
        near = [
            sum(one.margins[place] >= 1.0 and one.errors[place] < 1.1 * one.errors[3] for one in flying) for place in range(3)
        ]
        bearing = sum(math.isfinite(one.errors[3]) for one in flying)
        weak = [one for one in flying if one.margins[0] < 1.0]
        mended = sum(one.margins[2] >= 1.0 for one in weak)
        worse = sum(one.margins[2] < min(one.margins[0], 1.0) for one in flying)
        words = [dict(Counter(one.said[place] for one in flying)) for place in range(2)]
        lines = [
            f"{loop.form}: {len(flying)} of {count} fly with the defaults; sound as flown, after one and two flights: {sound}",
            f"  of {len(weak)} without margin {mended} are sound after two; {worse} are worse than before",
            f"  tracking error of the sound ones over the best of a sound loop (median): {np.round(behind, 2)}; sound and "
            f"within 10 % of that: {near} of {bearing} that some factor makes sound; advise said of the first flight "
            f"{words[0]}, of the second {words[1]}",
        ]
        sys.stdout.write("\n".join([*lines, ""]))


if __name__ == "__main__":
    main()

"""Loops with known margins, often decided outside the excited frequencies, against what `advise` calls sound; and vehicles
that hover with a chirp, of which the model's margins are known.
"""

import math
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from quadstep.engines.fly import fly_all
from quadstep.identify.changes import advised
from quadstep.identify.excited import Excited, refuse
from quadstep.identify.measured import measured
from quadstep.identify.response import Crossing, response
from quadstep.io.errors import UserError
from quadstep.linear.analysis import analyse_rest
from quadstep.linear.margins import Margins
from quadstep.metrics.registry import LEAST_GAIN, LEAST_PHASE
from quadstep.mission.read import check_mission
from tests.challenge.search import Attempt, Search, coverage
from tests.injected import injected, signals
from tests.random_sheets import HOVER, random_sheet, vehicle

PERIOD, DURATION = 0.005, 40.0
CLOSE = 0.9
"""Share of a limit below which a loop that is called sound contradicts that: intervals of 95 % miss now and then."""


class Loop(NamedTuple):
    """L(s) = gain (s + lead) (s + reset)^2 / s^4, with a lag [s], a delay [s], and a resonance: where [rad/s], its damping,
    and how much more of it the zeros have.
    """

    gain: float
    lead: float
    reset: float
    lag: float
    delay: float
    mode: tuple[float, float, float]

    def rational(self) -> tuple[np.ndarray, np.ndarray]:
        """Numerator and denominator; the delay as Padé's approximation of order 4."""
        above = self.gain * np.poly([-self.lead, -self.reset, -self.reset])
        below = np.polymul([1.0, 0.0, 0.0, 0.0, 0.0], [self.lag, 1.0])
        at, damping, depth = self.mode
        above = np.polymul(above, [1.0, 2.0 * damping * depth * at, at * at])
        below = np.polymul(below, [1.0, 2.0 * damping * at, at * at])
        pade = np.array([1.0, -20.0, 180.0, -840.0, 1680.0]) * self.delay ** np.arange(4, -1, -1)
        return np.polymul(above, pade), np.polymul(below, np.abs(pade))

    def opened(self, omega: np.ndarray) -> np.ndarray:
        """L at frequencies [rad/s]."""
        above, below = self.rational()
        return np.polyval(above, 1j * omega) / np.polyval(below, 1j * omega)

    def stable(self, factor: float) -> bool:
        """Whether the loop with its gain times a factor is stable, by its poles."""
        above, below = self.rational()
        return bool((np.roots(np.polyadd(below, factor * above)).real < 0.0).all())

    def phase_margin(self) -> float:
        """From the whole response [rad]."""
        loop = self.opened(np.geomspace(1e-4, 1e5, 40_000))
        at = np.flatnonzero(np.diff(np.abs(loop) > 1.0))
        return float(np.abs(np.angle(-loop[at])).min())

    @property
    def sound(self) -> bool:
        """Whether it keeps nearly the margins of a sound loop, by poles and by its whole response."""
        factors = 10.0 ** (np.linspace(-CLOSE, CLOSE, 25) * LEAST_GAIN / 20.0)
        return all(self.stable(float(one)) for one in factors) and self.phase_margin() > CLOSE * LEAST_PHASE


def drawn(random: np.random.Generator, low: float, high: float) -> Loop:
    """A loop whose gain crosses 1 near 20 rad/s, and whose resonance, if it has one, is excited."""

    def between(least: float, most: float) -> float:
        return float(np.exp(random.uniform(np.log(least), np.log(most))))

    resonance = between(1.5 * low, high / 1.5), between(0.1, 0.5), between(0.2, 5.0) if random.random() < 0.3 else 1.0
    one = Loop(1.0, between(0.5, 10.0), between(0.1, 12.0), between(1e-3, 0.05), between(1e-3, 0.03), resonance)
    return one._replace(gain=between(0.3, 3.0) / float(np.abs(one.opened(np.array([20.0])))[0]))


def flown(one: Loop, low: float, high: float, noise: float, random: np.random.Generator) -> Excited:
    """What `advise` has of a flight with a chirp from low to high [rad/s]. noise: of the command, over the chirp's."""
    time = np.arange(0.0, DURATION, PERIOD)
    pace = DURATION / math.log(high / low)
    fade = np.clip(np.minimum(time, DURATION - time) / 2.0, 0.0, 1.0)
    chirp = fade * np.sin(low * pace * np.expm1(time / pace))
    omega = 2.0 * math.pi * np.fft.rfftfreq(len(time), PERIOD)
    sensitivity = 1.0 / (1.0 + one.opened(np.maximum(omega, 1e-3)))
    command = np.fft.irfft(sensitivity * np.fft.rfft(chirp + noise * random.normal(size=len(time))), len(time))
    return Excited("roll", ("excitation", "command"), response(chirp, command, PERIOD), chirp, command, PERIOD, {})


def loops(seed: int) -> Iterable[Attempt]:
    """Stable loops, excited over a band that often holds not every place where the phase crosses -180 degrees."""
    random = np.random.default_rng(seed)
    while True:
        low, high = float(random.uniform(0.5, 12.0)), float(np.exp(random.uniform(np.log(40.0), np.log(500.0))))
        one, noise = drawn(random, low, high), float(random.choice([0.0, 0.01, 0.1]))
        if not one.stable(1.0) or (random.random() < 0.7 and one.sound):
            continue
        case = f"{one}, excited from {low:.3g} to {high:.3g} rad/s, noise {noise:g}"
        flight = flown(one, low, high, noise, random)
        try:
            refuse(Path("flight.BIN"), flight)
        except UserError:
            continue
        now = measured(flight.measured)
        advice = advised(flight.measured) if now.lacking else None
        after = one._replace(gain=advice.factor * one.gain) if advice else one
        if now.sound or advice:
            yield Attempt(
                0.0 if after.sound else 2.0, f"{case}: called sound, gains times {advice.factor if advice else 1.0:.3g}"
            )


def hovering(random: np.random.Generator, noise: float) -> tuple[str, Crossing, Margins] | None:
    """A random vehicle under pid with a chirp on roll or pitch: what it is, what is measured of its flight, and what its model
    has; None where the log is refused or the loop is not stable. noise: of the gyro [rad/s/sqrt(Hz)].
    """
    sheet, channel = random_sheet(random), int(random.integers(2))
    content = {"vehicle": vehicle(sheet), "path": {**HOVER, "duration": 42.0}, "controller": {"type": "pid"}}
    content["sensors"] = {"imu_period": 0.002, "gyro_noise": noise}
    content["simulation"] = {"duration": 42.0, "log_period": 0.002}
    mission = check_mission(content, "hover.toml", Path())
    analysis = analyse_rest(mission).analysis
    if not analysis.margins:
        return None
    plan = injected(mission, channel, 1.0)
    d, u, period = signals(plan, *fly_all([plan]))
    found = Excited("roll", ("excitation", "command"), response(d, u, period), d, u, period, {})
    try:
        refuse(Path("flight.BIN"), found)
    except UserError:
        return None
    case = f"{sheet.name}, {'roll' if channel == 0 else 'pitch'}, gyro noise {noise:.3g}"
    phase = measured(found.measured).phase
    return (case, phase, analysis.margins[1 + channel]) if phase else None


def vehicles(seed: int) -> Iterable[Attempt]:
    """Without noise: the crossover within 5 %, the phase margin within 3 degrees."""
    random = np.random.default_rng(seed)
    while True:
        if one := hovering(random, 0.0):
            case, found, true = one
            off = abs(found.at.value / true.phase_at - 1.0), abs(found.value.value - true.phase)
            said = f"{case}: crossover off by {100.0 * off[0]:.3g} %, phase margin by {math.degrees(off[1]):.3g} degrees"
            yield Attempt(max(off[0] / 0.05, off[1] / math.radians(3.0)), said)


def noisy(seed: int) -> Iterable[Attempt]:
    """With noise: how often the interval of the phase margin holds the model's."""
    random = np.random.default_rng(seed)

    def held() -> Iterable[bool]:
        while True:
            if one := hovering(random, float(10.0 ** random.uniform(-5.0, -3.0))):
                _, found, true = one
                yield found.value.low <= true.phase <= found.value.high

    yield from coverage(held(), batch=5)


SEARCHES = [
    Search(
        "a loop that advise calls sound", "no loop is called sound, as flown or with the advised gains, that is not", loops
    ),
    Search("margins that advise measures", "crossovers are within 5 %, phase margins within 3 degrees", vehicles),
    Search("intervals of advise", "95 % of the intervals of a phase margin hold it", noisy, slow=True),
]

"""Margins of a measured loop with their intervals, in numbers and words, and whether they are those of a sound one."""

import math
from typing import NamedTuple

import numpy as np

from quadstep.identify.logs.flight import Floats
from quadstep.identify.response import Complex, Crossing, Response, crossovers, determined, gain_margins, interval, margin
from quadstep.metrics.registry import LEAST_GAIN, LEAST_PHASE, SOUND
from quadstep.metrics.statistics import Estimate

HIDDEN = 0.32
"""Largest gain of a resonance beyond what was excited, as noise tells it, with which a loop counts as sound, as flown or as
advised: 6 dB below 1, and 4 dB less, since noise told some up to 3 dB too small (docs/advise.md).
"""


class HiddenResonance(NamedTuple):
    """The most that noise may hide beyond what was excited. gains: |L| at -180 degrees, 1 where the log does not tell, at
    frequencies omega [rad/s], each (n,).
    """

    gains: Floats
    omega: Floats

    @property
    def gain(self) -> float:
        """The largest."""
        return float(self.gains.max())

    @property
    def at(self) -> float:
        """Where it is [rad/s], or from where on the log does not tell."""
        return float(self.omega[self.gains.argmax()])

    @property
    def words(self) -> str:
        """What it is, as a clause's subject."""
        at = f"{self.at / (2.0 * math.pi):.3g} Hz"
        if self.gain < 1.0:
            most = f"about {self.gain:.2g} by the noise (in simulations, at most 3 dB more)"
            return f"a resonance near {at}, whose gain may be up to {most},"
        return f"a resonance above {at}, where the log shows too little,"

    @property
    def leaves(self) -> float:
        """How far the gain may then grow [dB]."""
        return -20.0 * math.log10(self.gain)

    def scaled(self, factors: Complex | float) -> "HiddenResonance":
        """With the loop times a factor at each frequency."""
        return self._replace(gains=self.gains if self.gain >= 1.0 else self.gains * np.abs(factors))

    def room(self, factors: Complex | float = 1.0) -> float:
        """By how much more the loop may grow, after a factor at each frequency, until a resonance is larger than `HIDDEN`, or
        than it may be as flown where that is more already.
        """
        return float((np.maximum(HIDDEN / np.maximum(self.gains, 1e-9), 1.0) / np.abs(factors)).min())


class MeasuredLoop(NamedTuple):
    """phase: the crossover with the smallest phase margin [rad], as `sized`, None if the excitation tells of none; up, down:
    where the gain may grow and fall least, by which factor, None where the phase crosses -180 degrees at no excited frequency
    and the gain margin is unknown. open: crossovers whose phase margin it does not tell. lowest, highest: excited [rad/s].
    floor: where `down` is unknown, how far the gain may fall at least [dB], None where that is unknown too. by_plant: whether
    the margins are those of the loop that a plant and the parameters make, as far as it goes beyond what was excited. hidden:
    what may take them, None where that is not judged. limited: whether motors were often at a limit, where a loop does less
    than in small motions.
    """

    phase: Crossing | None
    up: Crossing | None
    down: Crossing | None
    open: tuple[Crossing, ...]
    lowest: float
    highest: float
    floor: float | None = None
    by_plant: bool = False
    hidden: HiddenResonance | None = None
    limited: bool = False

    @property
    def gain_up(self) -> Estimate | None:
        """How far the gain may grow [dB]: not below 0, as the loop flew."""
        return self.up and stable_gain_margin(decibels(self.up.value))

    @property
    def gain_down(self) -> Estimate | None:
        """How far the gain may fall [dB], above 0."""
        if self.down is None:
            return None
        value, low, high = decibels(self.down.value)
        return stable_gain_margin(Estimate(-value, -high, -low))

    @property
    def shares(self) -> dict[str, Estimate]:
        """The margins that are known, in units of a sound loop's."""
        floor = Estimate(self.floor, self.floor, math.inf) if self.floor is not None else None
        gains = {"gain margin upwards": self.gain_up, "gain margin downwards": self.gain_down or floor}
        known = {name: (one, LEAST_GAIN) for name, one in gains.items() if one}
        known |= {"phase margin": (self.phase.value, LEAST_PHASE)} if self.phase else {}
        return {name: Estimate(*(end / least for end in one)) for name, (one, least) in known.items()}

    @property
    def lacking(self) -> list[str]:
        """The margins that are below those of a sound loop with 95 % confidence."""
        return [name for name, one in self.shares.items() if one.high < 1.0]

    @property
    def sound(self) -> bool:
        """Whether all margins are those of a sound loop with 95 % confidence, but for what noise may hide; never where one of
        them is unknown.
        """
        doubtful = any(sized(one.value).low < LEAST_PHASE for one in self.open)
        return len(self.shares) == 3 and not doubtful and all(one.low >= 1.0 for one in self.shares.values())

    @property
    def doubtful(self) -> bool:
        """Whether noise may hide a resonance that leaves less than a sound loop's margins."""
        return self.hidden is not None and self.hidden.gain > HIDDEN

    @property
    def grade(self) -> str:
        if self.sound and not (self.by_plant or self.doubtful or self.limited):
            return SOUND
        return "fragile" if self.lacking else "unknown"

    def gains(self, unit: str = "") -> tuple[str, str]:
        """How far the gain may grow, and fall [dB], in words."""
        up, down = (f"{spelled(one, '.1f')}{unit}" if one else "" for one in (self.gain_up, self.gain_down))
        floor = f"{self.floor:.1f}{unit} or more" if self.floor is not None else f"unknown below {self.lowest:.3g} rad/s"
        return up or f"unknown above {self.highest:.3g} rad/s", down or floor

    @property
    def cells(self) -> tuple[str, ...]:
        """Crossover [rad/s], phase margin [deg] and `gains`, as a table has them."""
        assert self.phase
        return spelled(self.phase.at, ".3g"), spelled(Estimate(*map(math.degrees, self.phase.value)), ".1f"), *self.gains()


def measured(response: Response) -> MeasuredLoop:
    crossings, turns = crossovers(response), gain_margins(response)
    up = min((one for one in turns if one.value.value >= 1.0), key=lambda one: one.value.value, default=None)
    down = max((one for one in turns if one.value.value < 1.0), key=lambda one: one.value.value, default=None)
    phase = margin(crossings)
    left = tuple(one for one in crossings if not determined(one))
    ends = float(response.omega[0]), float(response.omega[-1])
    # The phase of a loop without an attitude loop crosses -180 degrees nowhere above, and below |L| is larger than here.
    rests = response.rising and down is None
    level = interval(abs(response.opened[0]), response.opened_error[0], response.freedom[0]).low if rests else 0.0
    floor = 20.0 * math.log10(level) if level > 0.0 else None
    return MeasuredLoop(phase and phase._replace(value=sized(phase.value)), up, down, left, *ends, floor)


def sized(one: Estimate) -> Estimate:
    """A phase margin either way, lag or lead, as a size."""
    return one if one.value >= 0.0 else Estimate(-one.value, -one.high, -one.low)


def stable_gain_margin(margin: Estimate) -> Estimate:
    """A gain margin [dB] of a loop that flew, and is stable."""
    return margin._replace(low=max(margin.low, 0.0))


def decibels(factor: Estimate) -> Estimate:
    return Estimate(*(20.0 * math.log10(max(one, 1e-300)) for one in factor))


def spelled(one: Estimate, digits: str) -> str:
    return f"{one.value:{digits}} ({one.low:{digits}} to {one.high:{digits}})"


def degrees(one: Estimate) -> tuple[str, str]:
    """An angle and its interval in words."""
    value, low, high = map(math.degrees, one)
    return f"{value:.1f}°", f"{low:.1f} to {high:.1f}°"


def hertz(one: Estimate) -> tuple[str, str]:
    """A frequency and its interval in words."""
    return f"{one.value:.3g} rad/s", f"{one.low:.3g} to {one.high:.3g} rad/s"

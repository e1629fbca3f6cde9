"""The grade of a loop: its least margins against the limits of its mission.

*sound*: every margin reaches its limit. *fragile*: stable, but a margin is below its limit. *unstable*: a mode grows, or
position or heading are not held. *no rest found*: the search ended without an equilibrium. *not linearised*: it has no
slopes there.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

from quadstep.io.errors import UserError
from quadstep.linear.analysis import Analysis, studied
from quadstep.linear.margins import Margins
from quadstep.linear.sampled import NoRestError
from quadstep.metrics.margins import NO_REST, SOUND
from quadstep.mission.schema import Mission

FRAGILE, UNSTABLE, UNKNOWN = "fragile", "unstable", "not linearised"


class Measure(NamedTuple):
    """A margin as it is graded: where it is least, and what is asked. channel: with the way of a gain. scale: from SI."""

    what: str
    value: float
    limit: float
    channel: str
    scale: float
    unit: str

    @property
    def met(self) -> bool:
        return self.value >= self.limit

    def text(self, value: float) -> str:
        """A value in the unit that people read."""
        return f"{self.scale * value:.1f}{self.unit}" if math.isfinite(value) else "none"


class Grade(NamedTuple):
    """word: one of the grades. why: in words, without a full stop. measures: least margins, of a stable loop."""

    word: str
    why: str
    measures: tuple[Measure, ...] = ()

    @property
    def sentence(self) -> str:
        """For a table of facts or the first line of a report."""
        return f"{self.word[0].upper()}{self.word[1:]}: {self.why}."


WORST_FIRST = UNSTABLE, NO_REST, UNKNOWN, FRAGILE, SOUND


def graded(found: Analysis) -> Grade:
    """The grade of a linearised loop."""
    if not found.stable:
        constant = -found.poles[0].time_constant
        return Grade(UNSTABLE, f"a mode grows by a factor of {math.e:.3g} in {constant:.3g} s ({named(found)})")
    if found.not_held:
        return Grade(UNSTABLE, f"it does not hold {', '.join(found.not_held)}; a deviation there never decays")
    measures = least_of(found)
    short = [one for one in measures if not one.met]
    said = ", ".join(f"{one.what} margin {one.text(one.value)}{where(one)}" for one in measures)
    if not short:
        return Grade(SOUND, f"least {said}", measures)
    missed = " and ".join(f"{one.what} margin below {one.text(one.limit)}" for one in short)
    return Grade(FRAGILE, f"{missed}; least {said}", measures)


def where(one: Measure) -> str:
    """The channel in brackets, of a margin that exists."""
    return f" ({one.channel})" if math.isfinite(one.value) else ""


def named(found: Analysis) -> str:
    """The states in the slowest or fastest growing mode."""
    return ", ".join(found.poles[0].states)


def least_of(found: Analysis) -> tuple[Measure, ...]:
    """The least gain margin of both ways, phase margin and delay margin over all channels."""
    pairs = list(zip((channel.name for channel in found.channels), found.margins, strict=True))

    def least(what: str, bound: float, scale: float, unit: str, *of: tuple[str, Callable[[Margins], float]]) -> Measure:
        every = [(value(one), ", ".join(filter(None, (name, way)))) for way, value in of for name, one in pairs]
        value, channel = min(every, key=lambda one: one[0], default=(math.inf, ""))
        return Measure(what, value, bound, channel, scale, unit)

    return (
        least("gain", found.limits.gain, 1.0, " dB", ("up", lambda one: one.up), ("down", lambda one: one.down)),
        least("phase", found.limits.phase, math.degrees(1.0), "°", ("", lambda one: one.phase)),
        least("delay", found.limits.delay, 1e3, " ms", ("", lambda one: one.delay)),
    )


def grade(mission: Mission) -> Grade:
    """The grade of a mission's loop at rest where its path begins; never raises for a loop that has none."""
    try:
        return graded(studied(mission).analysis)
    except UserError as error:
        return refused(error)


def refused(error: UserError) -> Grade:
    """The grade of a loop that cannot be linearised."""
    return Grade(NO_REST if isinstance(error, NoRestError) else UNKNOWN, str(error).removeprefix(f"{NO_REST}: "))

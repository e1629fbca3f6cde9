"""The grade of a loop: its least margins against the limits of its mission.

*sound*: every margin reaches its limit. *fragile*: stable, but a margin is below its limit. *unstable*: a mode grows, or
position or heading are not held. *no rest found*: the search ended without an equilibrium. *not linearised*: it has no
slopes there.

The same of the loop as it will be in a firmware: with the filter of its gyro and the delay of its outputs.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

from quadstep.io.errors import UserError
from quadstep.linear.analysis import Analysis, studied
from quadstep.linear.margins import Margins
from quadstep.linear.sampled import NoRestError
from quadstep.metrics.margins import NO_REST, SOUND
from quadstep.mission.airframe import CommandSection
from quadstep.mission.multirotor import MultirotorMission
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


class FirmwarePath(NamedTuple):
    """What lies between sensors, law and rotors of a firmware by default. cutoff: of the gyro's second-order low-pass [Hz],
    which `parameter` sets; outputs: delay until the motors are told [s].
    """

    name: str
    parameter: str
    cutoff: float
    outputs: float

    @property
    def behind(self) -> float:
        """How far the filtered gyro is behind below its cutoff [s]: of a Butterworth filter."""
        return math.sqrt(2.0) / (2.0 * math.pi * self.cutoff)


PATHS = {
    "px4": FirmwarePath("PX4", "IMU_GYRO_CUTOFF", 40.0, 0.0025),
    "ardupilot": FirmwarePath("ArduPilot", "INS_GYRO_FILTER", 20.0, 0.0025),
    "crazyflie": FirmwarePath("the Crazyflie", "the gyro's low-pass filter", 80.0, 0.001),
}
"""By target. Outputs: a period at 400 Hz, and of the Crazyflie's loop."""


def within(mission: Mission, path: FirmwarePath) -> Mission:
    """The mission with the gyro and the outputs as late as there, in whole samples. Its gains are those that are exported,
    which do not follow this delay.
    """
    assert isinstance(mission, MultirotorMission)
    vehicle, sensors = mission.vehicle, mission.sensors
    period = sensors.imu_period or mission.simulation.period_of("law")
    late = sensors.imu_latency + round(path.behind / period) * period
    command = vehicle.command or CommandSection(speed=vehicle.rotor.fastest)
    delay = 0.5 * mission.simulation.period_of("law") + command.delay + path.outputs
    return mission.model_copy(
        update={
            "sensors": sensors.model_copy(update={"imu_latency": late}),
            "vehicle": vehicle.model_copy(update={"command": command.model_copy(update={"delay": delay})}),
            "modelled": mission.modelled,
        }
    )


def in_firmware(mission: Mission, target: str) -> tuple[str, bool]:
    """What the margins are in a firmware, in a sentence, and whether they are too small to fly."""
    path = PATHS[target]
    about = f"{path.parameter} {path.cutoff:g} Hz: {1e3 * path.behind:.0f} ms, outputs {1e3 * path.outputs:g} ms"
    try:
        found: Grade = grade(within(mission, path))
    except UserError as error:
        return f"Margins on {path.name} ({about}): not known: {error}.", False
    if found.word == UNSTABLE:
        return f"On {path.name} ({about}) this loop is unstable: {found.why}.", True
    if not found.measures:
        return f"Margins on {path.name} ({about}): {found.why}.", False
    short = [one for one in found.measures if one.what != "delay" and not one.met]  # what is late is counted already
    missed = " and ".join(
        f"{one.what} margin on {path.name} is {one.text(one.value)}, below {one.text(one.limit)}" for one in short
    )
    below = f"The {missed}: choose slower gains. " if short else ""
    said = ", ".join(f"{one.what} {one.text(one.value)} ({one.channel})" for one in found.measures)
    return f"{below}Least margins on {path.name} ({about}): {said}.", bool(short)

"""The grade of a loop: its least margins against the limits of its mission.

*sound*: every margin reaches its limit. *fragile*: stable, but a margin is below its limit. *unstable*: a mode grows, or
position or heading are not held. *no rest found*: the search ended without an equilibrium. *not linearised*: it has no
slopes there.

The same of the loop as it will be in a firmware: with the filter of its gyro and the delay of its outputs.

Beside other results there is a grade only where it takes less than about a second (`quick_grade`), cached beside the compiled
code; margins are also metrics of a mission, finite numbers that can be compared and searched.
"""

import json
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import NamedTuple, cast

from quadstep.control.opaque import Opaque
from quadstep.engines.fly import FlightPlan, fingerprint
from quadstep.io import code_cache
from quadstep.io.code_identity import as_it_is
from quadstep.io.errors import UserError
from quadstep.io.parts import source_digest
from quadstep.linear.analysis import Analysis, analyse_rest, least, limits, of_even_rotors, of_loop, with_place, worst_of
from quadstep.linear.equilibrium import after_warm_up, at_rest, hovering, newton, other_sides, with_others
from quadstep.linear.margins import Margins
from quadstep.linear.modes import grouped
from quadstep.linear.sampled import Loops, NoRestError, linearising
from quadstep.linear.states import states
from quadstep.metrics.registry import LESS_IS_BETTER, MARGINS, NO_REST, SOUND, UNITS, at_rest_sentences
from quadstep.mission.airframe_tables import CommandSection
from quadstep.mission.multirotor import MultirotorMission
from quadstep.mission.schema import Mission
from quadstep.report.units import quantity

FRAGILE, UNSTABLE, UNKNOWN = "fragile", "unstable", "not linearised"
REMEDY = "`quadstep tune` searches for gains with margins."
RISES, FALLS = "if the gain rises", "if the gain falls"


class Measure(NamedTuple):
    """A margin as it is graded: where it is least, and what is asked. channel: with the way of a gain. scale: from SI."""

    what: str
    value: float
    limit: float
    channel: str
    scale: float
    unit: str
    words: str = ""

    @property
    def met(self) -> bool:
        return self.value >= self.limit

    def text(self, value: float) -> str:
        """A value in the unit that people read."""
        return f"{round(self.scale * value, 1) + 0.0:.1f}{self.unit}" if math.isfinite(value) else "none"


class Grade(NamedTuple):
    """word: one of the grades. why: in words, without a full stop. measures: least margins, of a stable loop."""

    word: str
    why: str
    measures: tuple[Measure, ...] = ()

    @property
    def sentence(self) -> str:
        """For the first line of a report."""
        return at_rest_sentences({"grade": self.word, "why": self.why})[0]


LEAST_ASIDE, SAME = 1e-3, 1e-4
"""From how far on it is said that a loop rests elsewhere than where it should [m]. Share by which margins of channels differ
through rounding: of equal ones the first is named, on every machine.
"""

WORST_FIRST = UNSTABLE, NO_REST, UNKNOWN, FRAGILE, SOUND


def graded(analysis: Analysis) -> Grade:
    if not analysis.stable:
        first, *others = grouped(analysis.growing)
        pace = quantity(-math.log(2.0) * first.pole.time_constant, "s").replace("\N{NO-BREAK SPACE}", " ")
        more, what = "; other modes grow more slowly" * bool(others), first.states[0].partition(".")[0]
        most = analysis.in_words(one for one in first.states if one.partition(".")[0] == what)
        return Grade(UNSTABLE, f"a deviation doubles every {pace} ({most}){more}")
    if analysis.not_held:
        return Grade(UNSTABLE, f"it does not hold {', '.join(analysis.not_held)}; a deviation there never decays")
    measures = least_of(analysis)
    missed = [one for one in measures if not one.met]
    return Grade(FRAGILE if missed else SOUND, explained(analysis, missed or measures), measures)


def explained(analysis: Analysis, measures: Sequence[Measure]) -> str:
    """These margins of a stable loop in words, either all too small or none, and what else is to be known of it."""
    small = [
        f"{one.what} margin {one.words} in {one.channel} (less than {one.text(one.limit)})" for one in measures if not one.met
    ]
    every = [f"{one.what} margin {one.words}{f' ({one.channel})' * math.isfinite(one.value)}" for one in measures]
    said = " and ".join(small) or "smallest " * bool(every) + ", ".join(every)
    aside = f"it rests {quantity(analysis.aside, 'm')} from where the path begins" if analysis.aside >= LEAST_ASIDE else ""
    return "; ".join(filter(None, (said, aside, "events are ignored" * bool(analysis.eventful))))


def least_of(analysis: Analysis) -> tuple[Measure, ...]:
    """The least gain margin of both ways, phase margin and delay margin over all channels."""
    pairs = list(zip((channel.name for channel in analysis.channels), analysis.margins, strict=True))

    def least(what: str, bound: float, scale: float, unit: str, *of: tuple[str, Callable[[Margins], float]]) -> Measure:
        every = [(value(one), ", ".join(filter(None, (name, way)))) for way, value in of for name, one in pairs]
        smallest = min((value for value, _ in every), default=math.inf)
        alike = (pair for pair in every if pair[0] <= smallest + SAME * abs(smallest))
        value, channel = next(alike, (math.inf, ""))
        words = analysis.written(scale * value) + unit * math.isfinite(value)
        return Measure(what, value, bound, channel, scale, unit, words)

    late = (1.0, " s") if min((one.delay for _, one in pairs), default=0.0) >= 1.0 else (1e3, " ms")
    return (
        least("gain", analysis.limits.gain, 1.0, " dB", (RISES, lambda one: one.up), (FALLS, lambda one: one.down)),
        least("phase", analysis.limits.phase, math.degrees(1.0), "°", ("", lambda one: one.phase)),
        least("delay", analysis.limits.delay, *late, ("", lambda one: one.delay)),
    )


def grade(mission: Mission) -> Grade:
    """The grade of a mission's loop at rest where its path begins; never raises for a loop that has none."""
    try:
        return graded(analyse_rest(mission).analysis)
    except UserError as error:
        return grade_of_refusal(error)


def grade_of_refusal(error: UserError) -> Grade:
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


def as_in_firmware(mission: Mission, path: FirmwarePath) -> Mission:
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
        found: Grade = grade(as_in_firmware(mission, path))
    except UserError as error:
        return f"Margins on {path.name} ({about}): not known: {error}.", False
    if found.word == UNSTABLE:
        return f"On {path.name} ({about}) this loop is unstable: {found.why}.", True
    if not found.measures:
        return f"Margins on {path.name} ({about}): {found.why}.", False
    short = [one for one in found.measures if one.what != "delay" and not one.met]  # what is late is counted already
    missed = " and ".join(f"{one.what} margin on {path.name} is {one.words}, below {one.text(one.limit)}" for one in short)
    below = f"The {missed}: choose slower gains. " if short else ""
    said = ", ".join(f"{one.what} {one.words} ({one.channel})" for one in found.measures)
    return f"{below}Smallest margins on {path.name} ({about}): {said}.", bool(short)


MOST = {"gain_margin_up": 60.0, "gain_margin_down": 60.0, "phase_margin": math.pi, "delay_margin": 10.0, "disk_margin": 2.0}
"""Finite stand-in for an infinite margin, in its unit."""

UNHELD = {**dict.fromkeys(MOST, 0.0), LESS_IS_BETTER: 1000.0}
"""Margin of a loop that is not stable."""


def margin_metrics(mission: Mission, names: Iterable[str]) -> dict[str, float]:
    """The metrics of these names, out of `MARGINS`. Raises UserError for a loop that cannot be linearised."""
    found = of_analysis(analyse_rest(mission).analysis)
    return {name: found[name] for name in names}


def of_analysis(analysis: Analysis) -> dict[str, float]:
    """All metrics by name; for a channel that the vehicle does not have, the stand-in for an infinite margin."""
    by_channel = {channel.name: one for channel, one in zip(analysis.channels, analysis.margins, strict=False)}
    if analysis.stable:
        by_channel[""] = least(analysis.margins)
    made = {}
    for name in MARGINS:
        kind = next(kind for kind in UNITS if name.startswith(kind))
        one = by_channel.get(name.removeprefix(kind).removeprefix("_"))
        endless = MOST.get(kind, 1.0)
        made[name] = (
            UNHELD[kind]
            if not analysis.stable
            else endless
            if one is None
            else min(sizes(one)[kind], MOST.get(kind, math.inf))
        )
    return made


def sizes(one: Margins) -> dict[str, float]:
    return {
        "gain_margin_up": one.up,
        "gain_margin_down": one.down,
        "phase_margin": one.phase,
        "delay_margin": one.delay,
        "disk_margin": one.disk,
        LESS_IS_BETTER: one.sensitivity,
    }


MOST_STATES, MOST_TICKS = 160, 50
"""Of a loop that is linearised here; more take seconds."""


def quick_grade(mission: Mission) -> Mapping[str, str]:
    """The "grade" and "why" of a mission's loop at rest where its path begins; empty where `quadstep linear` has to be asked:
    the loop is large, has other slopes on other sides of rest, or has no equations.
    """
    law = mission.controller.controller
    if issubclass(law, Opaque) or law.one_at_a_time:
        return {}
    try:
        plans = of_even_rotors(hovering(mission))
        found = cached("grade", mission, plans, lambda: at_once(mission, [Loops(plan) for plan in plans]))
    except UserError:
        return {}
    return cast("dict[str, str]", found)


def whole_grade(mission: Mission) -> Grade:
    """The grade of a stock law's loop however long it takes, kept as well; never raises for a loop that has none."""
    try:
        plans = of_even_rotors(hovering(mission))
    except UserError as error:
        return grade_of_refusal(error)
    found = cached("whole grade", mission, plans, lambda: grade(mission))
    word, why, measures = cast("tuple[str, str, list[tuple[str, float, float, str, float, str, str]]]", found)
    return Grade(word, why, tuple(Measure(*one) for one in measures))


def cached(kind: str, mission: Mission, plans: list[FlightPlan], made: Callable[[], object]) -> object:
    """What is made of a mission's loops, as JSON has it; made once for the same laws and numbers."""
    live = as_it_is(tuple(plan.loop for plan in plans))
    name = code_cache.key(kind, source_digest(), fingerprint(plans), live, repr(limits(mission)))
    found = code_cache.read(name)
    if found is None:
        found = json.dumps(made()).encode()
        code_cache.write(name, found)
    return json.loads(found)


def at_once(mission: Mission, loops: list[Loops]) -> dict[str, str]:
    """The grade of loops of a mission, flown only where no rest is found at its start; empty where it takes longer."""
    with linearising():
        analyses, rests = [], []
        for one in loops:
            flown, first = after_warm_up(one)
            if one.count > MOST_TICKS or len(states(flown)) > MOST_STATES:
                return {}
            try:
                rest = newton(one, flown, first)
                if rest.period.period.bends and any(other_sides(rest)):
                    return {}
                rest = with_others(rest)
            except NoRestError:
                try:
                    rest = at_rest(one.plan)
                except NoRestError as error:
                    return {"grade": (none := grade_of_refusal(error)).word, "why": none.why}
            rests.append(rest)
            analyses += [of_loop(each, limits(mission)) for each in (rest.period, *rest.pieces)]
    found: Grade = graded(with_place(worst_of(analyses), mission, rests))
    return {"grade": found.word, "why": found.why}

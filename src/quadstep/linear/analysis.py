"""The full analysis of one linearised loop, and how it follows a step of its path: a metre, a radian of yaw."""

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from quadstep.engines.fly import FlightPlan
from quadstep.linear.equilibrium import Rest, aside, at_rest, hovering
from quadstep.linear.margins import TEXTBOOK, MarginLimits, Margins, margins
from quadstep.linear.modes import STILL, Pole, ReducedPeriod, poles
from quadstep.linear.sampled import WANTED, linearising, product
from quadstep.linear.states import Array, Channel, in_words, short
from quadstep.linear.transfer import frequencies, loci, opened
from quadstep.mission.schema import Mission
from quadstep.vehicle.multirotor import Multirotor

SHORTEST, LONGEST = 2.0, 40.0
"""Shortest and longest time shown of a step [s]."""

CONSTANTS = 6.0
"""The time shown, in multiples of the slowest time constant."""

SETTLED = 0.02
"""Share of the step within which the response has settled."""


class StepResponse(NamedTuple):
    """One step. t [s]; value, name, unit: of the stepped quantity."""

    name: str
    unit: str
    t: Array
    value: Array

    @property
    def rest(self) -> float:
        """Where it ends; the step where it does not come to rest in the time shown."""
        last = self.value[3 * len(self.value) // 4 :]
        end = float(last[-1])
        return end if end > 0.5 and float(np.ptp(last)) <= SETTLED * end else 1.0

    @property
    def overshoot(self) -> float:
        """Overshoot as a share of where it rests."""
        return max(0.0, float(self.value.max()) / self.rest - 1.0)

    @property
    def settling(self) -> float:
        """Time after which it stays within 2 % of where it rests [s]; infinite if it does not within the time shown."""
        outside = np.flatnonzero(np.abs(self.value / self.rest - 1.0) > SETTLED)
        last = int(outside[-1]) + 1 if len(outside) else 0
        return math.inf if last >= len(self.t) else float(self.t[last])


def steps(loop: ReducedPeriod, poles: list[Pole]) -> list[StepResponse]:
    names, rows = loop.period.pose
    inputs = [WANTED.index(name) for name in names]
    slowest = poles[0].time_constant
    duration = min(max(SHORTEST if slowest > 0.0 else 0.0, CONSTANTS * abs(slowest)), LONGEST)
    whole, moved = loop.period.map, np.zeros((len(loop.places), len(inputs)))
    for tick in loop.period.ticks:
        moved = product(tick.step, product(tick.tasks, moved) + tick.path[:, inputs])
    x = np.zeros_like(moved)
    made = [rows @ x]
    for _ in range(math.ceil(duration / loop.period.length)):
        x = whole @ x + moved
        made.append(rows @ x)
    t = np.array([k * loop.period.length for k in range(len(made))])
    values = np.array(made)
    return [
        StepResponse(name, "rad" if name == "yaw" else "m", t, np.ascontiguousarray(values[:, i, i]))
        for i, name in enumerate(names)
    ]


class Analysis(NamedTuple):
    """A loop at rest or at an instant of a flight. margins: by channel, empty if a mode grows.

    loop: the linearised period. not_held: the parts of the pose in which a deviation stays.
    limits: what a sound loop has. bends: places of the laws where slopes differ on both sides; near: states
    whose slopes are others near rest; tried: on which sides and where, in words; later: when it was linearised again,
    as it had become another loop [s]. aside: how far from where the path begins it rests [m]. eventful: whether
    events, which it leaves out, change the vehicle in flight. kinked: whether margins depend on the sides and states tried.
    """

    channels: tuple[Channel, ...]
    poles: list[Pole]
    margins: tuple[Margins, ...]
    loop: ReducedPeriod
    not_held: tuple[str, ...]
    limits: MarginLimits
    bends: tuple[str, ...] = ()
    near: tuple[str, ...] = ()
    tried: str = ""
    later: tuple[float, ...] = ()
    aside: float = 0.0
    eventful: bool = False
    kinked: bool = False

    @property
    def growing(self) -> list[Pole]:
        return [pole for pole in self.poles if pole.real * self.loop.period.length > STILL]

    def written(self, value: float, places: int = 1, up: bool = False) -> str:
        """A margin as text, "none" if infinite. Where it depends on what was tried it has no third digit, and is rounded
        towards zero, so that no more is promised: "49" for 49.9°. up: away from zero instead.
        """
        if not math.isfinite(value):
            return "none"
        if self.kinked:
            places = int(abs(value) < 10.0)
            value = (math.ceil if up else math.trunc)(value * 10.0**places) / 10.0**places
        return f"{value:.{places}f}"

    @property
    def stable(self) -> bool:
        return not self.growing

    def in_words(self, states: Iterable[str]) -> str:
        """States as people say them, so many as a sentence takes."""
        return in_words(states, short(self.loop.period.names), self.loop.period.pose.names)

    @property
    def holds(self) -> bool:
        """Whether, moreover, it holds position and heading."""
        return self.stable and not self.not_held


class RestAnalysis(NamedTuple):
    """A loop at rest, with its analysis. rest: for the rotors' rise time, where their fall time differs."""

    rest: Rest
    analysis: Analysis


def analyse_rest(mission: Mission) -> RestAnalysis:
    """The mission's loop at rest where its path begins. Raises UserError."""
    plans = of_even_rotors(hovering(mission))
    with linearising():
        rests = [at_rest(plan) for plan in plans]
        found = worst_of([of_loop(one, limits(mission)) for rest in rests for one in (rest.period, *rest.pieces)])
        return RestAnalysis(rests[0], with_place(found, mission, rests))


def with_place(analysis: Analysis, mission: Mission, rests: list[Rest]) -> Analysis:
    """With where its loops rest, what was tried about it, and whether the mission has events."""
    off, events, one = max(map(aside, rests)), bool(getattr(mission, "events", ())), rests[0]
    return analysis._replace(aside=off, eventful=events, near=one.near, tried=one.tried, later=one.later, kinked=one.kinked)


def limits(mission: Mission) -> MarginLimits:
    """What a mission asks of a sound loop."""
    asked = mission.margins
    return MarginLimits(asked.gain, asked.phase, asked.least_delay(mission.latency))


def of_loop(loop: ReducedPeriod, limits: MarginLimits = TEXTBOOK) -> Analysis:
    channels = loop.period.channels
    found = Analysis(channels, poles(loop), (), loop, loop.modes.not_held, limits, loop.period.bends)
    if not found.stable:
        return found
    omega, ready = frequencies(loop), opened(loop)
    grid = loci(ready, omega)
    return found._replace(margins=tuple(margins(ready.only(i), omega, grid[:, i]) for i in range(len(channels))))


def of_even_rotors(plan: FlightPlan) -> list[FlightPlan]:
    """The plan, or two if rotors do not rise as fast as they fall: at rest they would do neither, and the loop has no
    slope; so one plan has the rise time in both directions, the other the fall time.
    """
    if not isinstance(plan.loop.plant, Multirotor):
        return [plan]
    airframe = plan.parameters.airframe
    rotor = airframe.rotor
    if rotor.rise == rotor.fall:
        return [plan]
    both = [rotor._replace(fall=rotor.rise), rotor._replace(rise=rotor.fall)]
    return [plan._replace(parameters=plan.parameters._replace(airframe=airframe._replace(rotor=one))) for one in both]


def worst_of(analyses: list[Analysis]) -> Analysis:
    """The slowest of several loops of the same channels, with the least of all margins; or the unstable one, if any is."""
    slowest = max(analyses, key=lambda one: one.poles[0].real)
    if not slowest.stable:
        return slowest
    not_held = tuple(dict.fromkeys(name for one in analyses for name in one.not_held))
    worst = tuple(least(each) for each in zip(*(one.margins for one in analyses), strict=True))
    return slowest._replace(margins=worst, not_held=not_held, bends=analyses[0].bends)


def least(margins: tuple[Margins, ...]) -> Margins:
    turned = min(margins, key=lambda one: one.phase)
    return Margins(
        gain_up=min(one.gain_up for one in margins),
        gain_down=max(one.gain_down for one in margins),
        phase=turned.phase,
        phase_at=turned.phase_at,
        delay=min(one.delay for one in margins),
        disk=min(one.disk for one in margins),
        sensitivity=max(one.sensitivity for one in margins),
        complementary=max(one.complementary for one in margins),
    )

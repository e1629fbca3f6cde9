"""Equilibrium of the sampled loop: the state that a whole period reproduces, by Newton's method with the loop's own slopes."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from quadstep.engines.fly import FlightPlan, fly
from quadstep.interfaces.closed_loop import Outcome
from quadstep.interfaces.log import FlightLog
from quadstep.interfaces.plant import Reference
from quadstep.linear.modes import ReducedPeriod, reduced
from quadstep.linear.nearby import MOVED, NEAR, changed, later_ticks, nearby, nonlinear_states
from quadstep.linear.sampled import Loops, NoRestError, Period, approached, linearised
from quadstep.linear.states import (
    SAME,
    Array,
    LoopState,
    NoSlopeError,
    NotLinearError,
    commanded,
    in_words,
    relative_difference,
    short,
    states,
    with_states,
)
from quadstep.linear.wind_limit import cannot_hover
from quadstep.metrics.quantities import position_errors
from quadstep.mission.air import WindSection
from quadstep.mission.airframe import AirframeSection
from quadstep.mission.lagrange import LagrangeMission, VehicleSection
from quadstep.mission.multirotor import MultirotorMission
from quadstep.mission.paths import StepPath
from quadstep.mission.schema import Mission
from quadstep.numbers import Vector
from quadstep.report.units import number
from quadstep.sensing.sensors import filled

WARM = BEGUN = 0.1
"""Time flown before the search, so that memories of past samples are filled, and before a step [s]."""

LONG, KICK = 60.0, 1e-3
"""How long a flight from rest lasts unless it is lost [s], and the step along each axis that it begins with [m]."""

GROWING = "On this logarithmic scale, steady growth is a straight line; where an error oscillates, it is that of the peaks."

MOST_STEPS, AT_REST = 40, SAME
"""Most steps of Newton's method, and the largest change of a state in a period, relative to 1, that counts as rest."""

NEAR_REST = 1e-3
"""The same after which slopes are no longer rough, so that the last steps square what is left. They never are where a loop
bends: there the way decides which of many rests is found.
"""

FLOWN = 5.0, 25.0
"""Flights after which Newton's method is tried again where it fails at the start: on a limit, say, or far from rest [s]."""

MIXED, SMALL, SEED = 16, 80, 4
"""Mixtures of all states, and their opposites, towards which a loop of no more than so many states is linearised where it
bends; of a larger one a quarter of them. And what they are drawn from.
"""

SHARES = 1.0, 0.5, 0.2, 0.05
"""Of a step of Newton's method, tried in this order."""

PATIENCE = 3
"""Steps in a row without progress after which there is taken to be no equilibrium."""


class Rest(NamedTuple):
    """A loop at rest. flown: its state at tick `first`; period: linearised there. pieces: where it bends, on other sides, and
    near it; tried: which, in words; kinked: whether these differ. near: states whose slopes are others near rest. later: when
    it has become another loop [s], whose period is a piece too.
    """

    loops: Loops
    flown: LoopState
    first: int
    period: ReducedPeriod
    pieces: tuple[ReducedPeriod, ...] = ()
    tried: str = ""
    near: tuple[str, ...] = ()
    later: tuple[float, ...] = ()
    kinked: bool = False


def check_equilibrium(mission: Mission) -> None:
    """Raises UserError for a vehicle that cannot be held in the air."""
    vehicle = getattr(mission, "vehicle", None)
    for line in vehicle.warnings() if isinstance(vehicle, VehicleSection | AirframeSection) else ():
        raise NoRestError(f"no equilibrium: {line}")


def hovering(mission: Mission) -> FlightPlan:
    """The mission's vehicle held where its path begins, without events and noise, in its mean wind. Raises UserError."""
    check_equilibrium(mission)
    path = mission.path.build(mission.folder)
    return quiet(hover_mission(mission, path.law.reference(0.0, path.parameters), path.length).plan(warn=False))


def hover_mission(mission: Mission, reference: Reference, duration: float, aside: float = 0.0) -> Mission:
    """The mission held at a point of its path [s]. aside: how far beside it along each axis it begins [m]."""
    x, y, z = (float(entry) for entry in reference.position)
    path = StepPath(
        type="step",
        start=(x + aside, y + aside, z + aside),
        end=(x, y, z),
        time=0.0 if aside == 0.0 else BEGUN,
        duration=duration,
        yaw=float(reference.yaw),
    )
    changes: dict[str, object] = {"path": path}
    if isinstance(mission, MultirotorMission | LagrangeMission):
        changes["start"] = type(mission.start)()
    if isinstance(mission, MultirotorMission):
        changes |= {"events": (), "score_from": 0.0}
    wind = getattr(mission, "wind", None)
    if isinstance(wind, WindSection):
        changes["wind"] = WindSection(mean=wind.mean)
    return mission.model_copy(update=changes)


def stepped(mission: Mission, reference: Reference) -> tuple[FlightLog, Array, Array]:
    """A flight held at a point of its path, quiet, for at most `LONG` after a step of `KICK` along each axis; times since the
    step [s] and errors (samples, axes) [m]. Raises UserError.
    """
    log = fly(quiet(hover_mission(mission, reference, BEGUN + LONG, KICK).plan(warn=False)))
    since = log.column("t") >= BEGUN - 1e-9
    return log, log.column("t")[since] - BEGUN, position_errors(log)[since]


def quiet(plan: FlightPlan) -> FlightPlan:
    """The same without noise and turbulence, which disturb a loop but do not change it."""
    loop, every = plan.loop, plan.ticks.every
    if loop.sensing is not None and loop.sensing.noisy:
        loop = replace(loop, sensing=replace(loop.sensing, noisy=False))
    air: Any = loop.air  # a dataclass of the package's or of the user's own
    if isinstance(getattr(air, "stirs", None), bool) and air.stirs and hasattr(plan.parameters.wind, "turbulence"):
        loop, every = replace(loop, air=replace(air, stirs=False)), every[1:]
    return plan._replace(loop=loop, ticks=plan.ticks._replace(every=every))


def at_rest(plan: FlightPlan) -> Rest:
    """The loop at rest, linearised: by Newton's method from the start or, where that fails, from where flights get to. Raises
    NotLinearError where there is no equilibrium, or no slope.
    """
    loops = Loops(plan)
    flown, first = after_warm_up(loops)
    reasons: list[NotLinearError] = []
    bent: Rest | None = None
    for seconds in (0.0, *FLOWN):
        try:
            if seconds:
                first = round(seconds / (loops.count * loops.h)) * loops.count
                flown = flown_to(plan, first)
            found = newton(loops, flown, first)
            if bent and same(bent, found):
                break
            if found.period.period.bends:
                found = with_pieces(found)
            bent = found
            if not found.pieces:
                break  # else perhaps only on the way: a flight may rest elsewhere
        except (NoRestError, NoSlopeError) as error:
            reasons.append(error)
            if bent:
                break
    if bent is None:
        if why := cannot_hover(plan):
            raise NoRestError(f"no rest found: {why}")
        raise min(reversed(reasons), key=lambda one: getattr(one, "left", np.inf))
    return with_others(bent)


def aside(rest: Rest) -> float:
    """How far from where it should be a loop rests [m]."""
    loops, plant = rest.loops, rest.loops.loop.plant
    off = plant.error(rest.flown.cycle.state, loops.loop.reference(rest.first * loops.h, loops.p))
    return float(np.linalg.norm(np.array(list(off), dtype=np.float64)))


def same(one: Rest, other: Rest) -> bool:
    """Whether two rests of a loop are within `NEAR` of each other."""
    values, others = (np.array(states(each.flown)) for each in (one, other))
    return largest(still(others - values, (other.first - one.first) * one.loops.h), values) <= NEAR


def after_warm_up(loops: Loops) -> tuple[LoopState, int]:
    """The loop shortly after its start, and the tick."""
    first = max(1, round(WARM / (loops.count * loops.h))) * loops.count
    return loops.fly(loops.begin(), 0, first), first


def newton(loops: Loops, flown: LoopState, first: int) -> Rest:
    """The equilibrium near a state. Raises NotLinearError."""
    sizes: list[float] = []
    bends = False
    for _ in range(MOST_STEPS):
        rough = bool(sizes) and sizes[-1] > NEAR_REST and not bends
        period = reduced(approached(loops, flown, first, rough=rough))
        bends = bends or bool(period.period.bends)
        left = residual(period.period)
        size = largest(left, period.period.values)
        if not (np.isfinite(size) and np.isfinite(period.map).all()):
            if sizes:
                break  # the step before is what can be told of
            raise NoRestError("no rest found: a state or a derivative is no longer finite")
        worst = int(np.argmax(np.abs(left / (1.0 + np.abs(period.period.values)))))
        what = in_words([short(period.period.names)[worst]], short(period.period.names), period.period.pose.names)
        moves = f"{what} still changed by {number(left[worst])} (SI units) in {period.period.length:g} s"
        if size < AT_REST and not rough:
            outcome(loops, flown, first)
            if period.period.broken:
                raise NoSlopeError(period.period.broken)
            return Rest(loops, flown, first, period)
        sizes.append(size)
        if len(sizes) > PATIENCE and min(sizes[-PATIENCE:]) >= min(sizes[:-PATIENCE]):
            break
        change, *_ = np.linalg.lstsq(period.map - np.eye(len(left)), -left, rcond=1e-12)
        flown = better(loops, flown, first, period, change.astype(np.float64), size)
    raise NoRestError(f"no rest found: in the last of {len(sizes)} tries {moves}", sizes[-1])


def mixtures(rest: Rest) -> Array:
    """The deviations of all states to whose side a loop that bends is linearised."""
    count = len(states(rest.flown))
    mixed = np.random.default_rng(SEED).normal(size=(MIXED if count <= SMALL else MIXED // 4, count))
    return np.concatenate([mixed, -mixed])


def other_sides(rest: Rest) -> Iterator[ReducedPeriod]:
    """The loop linearised on other sides of where it bends, without those that are alike. Raises NotLinearError."""
    found = [rest.period]
    for way in mixtures(rest):
        one = reduced(linearised(rest.loops, rest.flown, rest.first, way / np.abs(way).max()))
        if all(one.map.shape != other.map.shape or relative_difference(one.map, other.map) > SAME for other in found):
            found.append(one)
            yield one


def with_pieces(rest: Rest) -> Rest:
    """The loop also linearised on other sides of where it bends. Raises NotLinearError."""
    pieces, sides = tuple(other_sides(rest)), 1 + len(mixtures(rest))
    some = "all different" if len(pieces) == sides - 1 else f"{1 + len(pieces)} of them different"
    differ = some if pieces else "all alike"
    return rest._replace(pieces=pieces, tried=f"{sides} one-sided linearisations ({differ})", kinked=bool(pieces))


def with_others(rest: Rest) -> Rest:
    """The loop also linearised where it is another one: near its rest, and later. Raises NotLinearError."""
    return with_later(with_near(rest))


def with_later(rest: Rest) -> Rest:
    """The loop also linearised at rest later in the flight, where it has become another one. Raises NotLinearError."""
    loops, now, tick = rest.loops, rest, rest.first
    ticks = later_ticks(loops, rest.first)
    while ticks and (found := changed(loops, now.flown, tick, ticks)):
        tick, flown = found
        try:
            now = newton(loops, flown, tick)
        except NoRestError as error:
            raise NoRestError(f"{error}, at t = {tick * loops.h:.3g} s of the flight") from None
        now = with_pieces(now) if now.period.period.bends else now
        rest = rest._replace(pieces=(*rest.pieces, now.period, *now.pieces), later=(*rest.later, tick * loops.h))
        ticks = [one for one in ticks if one > tick]
    return rest


def with_near(rest: Rest) -> Rest:
    """The loop also linearised at states near its rest, if it bends there. Raises NotLinearError."""
    place = rest.loops, rest.flown, rest.first
    near = nonlinear_states(*place, rest.period)
    if not near:
        return rest
    tried = " and ".join(filter(None, (rest.tried, f"{MOVED} at states within {1e3 * NEAR:g} mm of it")))
    return rest._replace(pieces=(*rest.pieces, *nearby(*place, rest.period)), tried=tried, near=near, kinked=True)


def better(loops: Loops, flown: LoopState, first: int, period: ReducedPeriod, change: Array, size: float) -> LoopState:
    """After a step of Newton's method: the longest share of it after which the loop moves less than `size`, or else least."""
    tried: list[tuple[float, LoopState]] = []
    for share in SHARES:
        values = np.array(states(flown))
        values[period.places] += share * change
        one = with_states(flown, values.tolist())
        tried.append((largest_change(loops, one, first, period), one))
        if tried[-1][0] < size:
            return one
    return min(tried, key=lambda pair: pair[0])[1]


def largest_change(loops: Loops, flown: LoopState, first: int, period: ReducedPeriod) -> float:
    """The largest change of a state over a period, relative to 1; infinite where it is not finite."""
    values, after = (np.array(states(one))[period.places] for one in (flown, loops.fly(flown, first, first + loops.count)))
    size = largest(still(after - values, loops.count * loops.h), values)
    return size if np.isfinite(size) else np.inf


def largest(left: Array, values: Array) -> float:
    """The largest change relative to 1."""
    return float(np.abs(left / (1.0 + np.abs(values))).max())


def still(left: Array, length: float) -> Array:
    """Changes over a time [s], without those of states that keep time."""
    return np.where(np.abs(left - length) < SAME, 0.0, left)


def residual(period: Period) -> Array:
    """The change of each state over a period; zero for states that keep time."""
    return still(period.after - period.values, period.length)


def outcome(loops: Loops, flown: LoopState, first: int) -> None:
    """Raises NoRestError if a flight would end here."""
    reference = loops.loop.reference(first * loops.h, loops.p)
    code = loops.loop.plant.outcome(loops.p, flown.cycle.state, flown.cycle.command, reference)
    if code:
        raise NoRestError(f"the equilibrium cannot be flown: it ends with {code}")


def flown_to(plan: FlightPlan, first: int) -> LoopState:
    """The loop before tick `first`, as flown. Raises NotLinearError where the flight ended before."""
    log = fly(plan._replace(ticks=plan.ticks._replace(last=first - 1)))
    if log.outcome is not Outcome.COMPLETED:
        raise NoRestError(f"no rest found: the flight ended after {log.ended:g} s")
    loops = Loops(plan)
    asked = Vector(commanded(loops.loop, loops.p, log.final.command))
    return loops.step(LoopState(log.final, filled(asked, loops.loop.late), asked), first - 1)

"""Equilibrium of the sampled loop: the state that a whole period reproduces, by Newton's method with the loop's own slopes."""

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from quadstep.flight.engines import FlightPlan
from quadstep.guidance.reference import Reference
from quadstep.linear.reduced import Reduced, reduced
from quadstep.linear.sampled import Loops, NoRestError, linearised
from quadstep.linear.states import Array, Flown, states, with_states
from quadstep.mission.air import WindSection
from quadstep.mission.airframe import AirframeSection
from quadstep.mission.lagrange import LagrangeMission
from quadstep.mission.multirotor import MultirotorMission
from quadstep.mission.paths import StepPath
from quadstep.mission.schema import Mission
from quadstep.mission.vehicles import VehicleSection

WARM = 0.1
"""Time flown before the search, so that memories of past samples are filled [s]."""

MOST_STEPS, AT_REST = 12, 1e-9
"""Most steps of Newton's method, and the largest change of a state in a period, relative to 1, that counts as rest."""


PATIENCE = 3
"""Steps in a row without progress after which there is taken to be no equilibrium."""


class Rest(NamedTuple):
    """A loop at rest. flown: its state at tick `first`; period: linearised there."""

    loops: Loops
    flown: Flown
    first: int
    period: Reduced


def check_equilibrium(mission: Mission) -> None:
    """Raises UserError for a vehicle that cannot be held in the air."""
    vehicle = getattr(mission, "vehicle", None)
    for line in vehicle.warnings() if isinstance(vehicle, VehicleSection | AirframeSection) else ():
        raise NoRestError(f"no equilibrium: {line}")


def hovering(mission: Mission) -> FlightPlan:
    """The mission's vehicle held where its path begins, without events and noise, in its mean wind. Raises UserError."""
    check_equilibrium(mission)
    path = mission.path.build(mission.folder)
    return quiet(held(mission, path.law.reference(0.0, path.parameters), path.length).plan(warn=False))


def held(mission: Mission, wanted: Reference, duration: float) -> Mission:
    """The mission held at a point of its path [s]."""
    x, y, z = (float(entry) for entry in wanted.position)
    path = StepPath(type="step", start=(x, y, z), end=(x, y, z), time=0.0, duration=duration, yaw=float(wanted.yaw))
    changes: dict[str, object] = {"path": path}
    if isinstance(mission, MultirotorMission | LagrangeMission):
        changes["start"] = type(mission.start)()
    if isinstance(mission, MultirotorMission):
        changes |= {"events": (), "score_from": 0.0}
        if isinstance(mission.wind, WindSection):
            changes["wind"] = WindSection(mean=mission.wind.mean)
    return mission.model_copy(update=changes)


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
    """The loop at rest, linearised. Raises NotLinearError where there is no equilibrium, or no slope."""
    loops = Loops(plan)
    first = max(1, round(WARM / (loops.count * loops.h))) * loops.count
    flown = loops.fly(loops.begin(), 0, first)
    sizes: list[float] = []
    for _ in range(MOST_STEPS):
        period = reduced(linearised(loops, flown, first))
        left = residual(period)
        size = float(np.abs(left / (1.0 + np.abs(period.period.values))).max())
        if not (np.isfinite(size) and np.isfinite(period.map).all()):
            raise NoRestError("there is no equilibrium: a state or a derivative is no longer finite")
        if size < AT_REST:
            outcome(loops, flown, first)
            return Rest(loops, flown, first, period)
        sizes.append(size)
        if len(sizes) > PATIENCE and min(sizes[-PATIENCE:]) >= min(sizes[:-PATIENCE]):
            break
        change, *_ = np.linalg.lstsq(period.map - np.eye(len(left)), -left, rcond=1e-12)
        values = np.array(states(flown)[0])
        values[period.places] += change
        flown = with_states(flown, values.tolist())
    worst = int(np.argmax(np.abs(left / (1.0 + np.abs(period.period.values)))))
    raise NoRestError(
        f"there is no equilibrium: {period.period.names[worst]} still changes by {left[worst]:.3g} in "
        f"{period.period.length:g} s after {len(sizes)} steps of Newton's method"
    )


def residual(period: Reduced) -> Array:
    """The change of each state over a period; zero for states that keep time."""
    whole = period.period
    left = whole.after - whole.values
    left[np.abs(left - whole.length) < AT_REST] = 0.0
    return left


def outcome(loops: Loops, flown: Flown, first: int) -> None:
    """Raises NoRestError if a flight would end here."""
    reference = loops.loop.wanted(first * loops.h, loops.p)
    code = loops.loop.plant.outcome(loops.p, flown.cycle.state, flown.cycle.command, reference)
    if code:
        raise NoRestError(f"the equilibrium cannot be flown: it ends with {code}")

"""`quadstep prove`: one mission from file to verdict."""

from __future__ import annotations

import math
from enum import IntEnum
from pathlib import Path
from typing import NamedTuple

import numpy as np

from quadstep.control.backstepping import Backstepping, BacksteppingGains, largest_inertia
from quadstep.exit_codes import DIVERGED, FAILED
from quadstep.flight.closed_loop import Outcome
from quadstep.flight.engines import FlightPlan, fly
from quadstep.flight.log import REASONS, FlightLog
from quadstep.mission.read import plan_mission, read_mission
from quadstep.prove.hover import Hover, Instability, hover, instability
from quadstep.prove.sampled import Sampled


class Kind(IntEnum):
    """A verdict, with its exit code."""

    PROVED = 0
    OPEN = FAILED
    DISPROVED = DIVERGED


class Verdict(NamedTuple):
    """What is certain. rows: axis, verdict, and in millimetres what it is about. says: sentences, the verdict first."""

    name: str
    kind: Kind
    rows: list[list[str]]
    says: list[str]


def prove_mission(path: Path) -> Verdict:
    """The verdict on the mission in `path`. Raises UserError."""
    mission = read_mission(path)
    plan = plan_mission(mission, path)
    loop = Sampled(plan)
    at = hover(mission, plan, loop)
    found = instability(loop, at) if at else None
    if at and found:
        return unstable(mission.name, plan, at, found)
    return Verdict(mission.name, Kind.OPEN, [[axis, "open", "-"] for axis in plan.loop.plant.axes], ["open: not tried"])


def unstable(name: str, plan: FlightPlan, at: Hover, found: Instability) -> Verdict:
    """Hover is no stable equilibrium."""
    log = fly(plan)
    place = ", ".join(f"{one:g}" for one in at.position)
    says = [
        f"disproved: hover at the path's end ({place}) m is an exact equilibrium of the sampled loop, and it is unstable: "
        f"{found.unstable} of the {found.states} eigenvalues of its Jacobian lie outside the unit circle, the law taken in "
        f"exact arithmetic. The fastest error grows at {down(found.slowest):g} to {up(found.fastest):g} 1/s, doubling every "
        f"{math.log(2.0) / found.slowest:.3g} s: there are starts as near as one likes that are driven away from it.",
        *consequence(plan),
        flight_says(log),
    ]
    return Verdict(name, Kind.DISPROVED, flown_rows(plan, log), says)


def down(x: float, digits: int = 6) -> float:
    """Rounded down to so many digits."""
    unit = 10.0 ** (math.floor(math.log10(abs(x))) - digits + 1)
    return math.floor(x / unit) * unit


def up(x: float, digits: int = 6) -> float:
    """Rounded up to so many digits."""
    return -down(-x, digits)


def consequence(plan: FlightPlan) -> list[str]:
    """What this means for Theorem 5.1, where its printed conditions hold."""
    gains = plan.parameters.gains
    if not isinstance(plan.loop.controller.alone, Backstepping) or not isinstance(gains, BacksteppingGains):
        return []
    outer = min(gains.gain_1 - gains.mass * gains.slope_1)
    inner = min(gains.gain_2 - largest_inertia(plan.parameters.vehicle.inertia) * gains.slope_2)
    if min(outer, inner) <= 0.0:
        return []
    return [
        f"Theorem 5.1: its printed conditions hold here (least K_r1 - m Lambda1 = {outer:g} N s/m, least K_r2 - J_M Lambda2 = "
        f"{inner:g} N m s at any attitude), so they do not keep the law as flown, sampled every "
        f"{1e3 * plan.ticks.step * plan.ticks.every[-1]:g} ms with its command filter, near its equilibrium. The theorem "
        "itself speaks of continuous time."
    ]


def flight_says(log: FlightLog) -> str:
    """How the mission's own flight ended."""
    if log.outcome is Outcome.COMPLETED:
        return f"The mission's own flight was completed in {log.ended:g} s; the table shows how far it was off the path."
    return (
        f"The mission's own flight ends at {log.ended:.4g} s ({REASONS[log.outcome]}); the table shows how far it was off the "
        "path by then."
    )


def flown_rows(plan: FlightPlan, log: FlightLog) -> list[list[str]]:
    """Axis by axis, how far the flight was off its path."""
    axes = plan.loop.plant.axes
    off = np.abs(log.table(*axes) - log.table(*(f"{axis}_d" for axis in axes))).max(axis=0)
    return [[axis, "disproved", f"{1e3 * one:.6g} mm off the path flown"] for axis, one in zip(axes, off, strict=True)]

"""A planner with LQR path following: the paper's reference [24].

Cowling, Yakimenko, Whidborne, Cooke, "A prototype of an autonomous controller for a quadrotor UAV", European Control
Conference (2007). The outputs, place and heading, determine every state and input of a quadrotor, so a plan is a polynomial
in them: from where the vehicle is to where the path is a second later. It is replanned before that, and followed by the
linear quadratic regulator of `lqr.py`.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

from quadstep.control.lqr import Lqr, LqrGains, LqrMemory
from quadstep.control.projection import project
from quadstep.interfaces.controller import Command, Measured
from quadstep.interfaces.reference import Reference
from quadstep.numbers import Number, Vector, atan2, cos, sin, vector
from quadstep.numbers.rotations import heading
from quadstep.world.guidance.minimum_jerk import Point, Quintic, along, quintic

HORIZON = 1.0
"""How far ahead a plan meets the path [s]."""


class PlannedLqrMemory(NamedTuple):
    """lqr: of the regulator. plan: of (x, y, z, yaw) [m, rad]. begun [s]: when it was made."""

    lqr: LqrMemory
    plan: Quintic
    begun: Number


def output(reference: Reference) -> Point:
    """Place and heading of a path, with their rates."""
    return Point(
        Vector((*reference.position, reference.yaw)),
        Vector((*reference.velocity, reference.yaw_rate)),
        Vector((*reference.acceleration, 0.0)),
    )


def planned(memory: PlannedLqrMemory, t: Number) -> Reference:
    """The plan at time t [s]."""
    values, rates, changes, jerks, snaps = along(memory.plan, t - memory.begun, HORIZON)
    *_, yaw = values
    *_, yaw_rate = rates
    place, speed, pull, jerk, snap = (Vector(list(one)[:3]) for one in (values, rates, changes, jerks, snaps))
    return Reference(place, speed, pull, yaw, yaw_rate, jerk, snap)


@dataclass(frozen=True)
class PlannedLqr(Lqr):
    """`plan` is the planner, `law` the regulator, with the weights of `lqr`."""

    name = "planned-lqr"
    label = "planner with LQR [24]"
    source = "Cowling, Yakimenko, Whidborne, Cooke 2007"
    preview = (HORIZON,)
    defaults: ClassVar[Mapping[str, object]] = {
        "level": (40.0, 40.0, 4.0, 1.0, 0.3, 0.002),
        "climb": (20.0, 40.0, 4.0, 1.0),
    }
    rates = {"plan": 0.4, "law": 0.002}  # noqa: RUF012 (as the base class declares it)

    def start(self, measured: Measured, gains: LqrGains) -> PlannedLqrMemory:  # type: ignore[override]
        """A plan that stays where the vehicle is."""
        rest = vector(0.0, 0.0, 0.0, 0.0)
        here = Vector((*measured.position, heading(measured.attitude)))
        return PlannedLqrMemory(super().start(measured, gains), Quintic(here, rest, rest, rest, rest, rest), 0.0)

    def enter(self, measured: Measured, reference: Reference, gains: LqrGains) -> PlannedLqrMemory:  # type: ignore[override]
        return self.start(measured, gains)._replace(lqr=super().enter(measured, reference, gains))

    def plan(
        self,
        memory: PlannedLqrMemory,
        measured: Measured,
        reference: Reference,
        gains: LqrGains,
        t: Number,
        period: Number,
    ) -> PlannedLqrMemory:
        """A plan from where the vehicle is. Its accelerations, of the heading too, are the plan's before: the measured tilt
        also holds the wind.
        """
        (later,) = reference.ahead
        turned = heading(measured.attitude) - reference.yaw
        yaw = reference.yaw + atan2(sin(turned), cos(turned))  # on the turn of the path's
        _, _, change, *_ = along(memory.plan, t - memory.begun, HORIZON)
        start = Point(Vector((*measured.position, yaw)), Vector((*measured.velocity, measured.rates[2])), change)
        return memory._replace(plan=quintic(start, output(later), HORIZON), begun=t)

    def law(  # type: ignore[override]
        self, memory: PlannedLqrMemory, measured: Measured, reference: Reference, gains: LqrGains, t: Number, period: Number
    ) -> tuple[Command, PlannedLqrMemory]:
        """The regulator's sample on the plan, its integral that of the error to the path: a plan starts without one."""
        command, _ = super().law(memory.lqr, measured, planned(memory, t), gains, t, period)
        integral = memory.lqr.integral + period * (measured.position - reference.position)
        return command, memory._replace(lqr=LqrMemory(project(integral, gains.integral_bound)))

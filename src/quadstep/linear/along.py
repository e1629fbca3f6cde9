"""Loops along a flight: at some instants the loop is linearised about the flown motion, as if that motion were frozen."""

from collections.abc import Iterator

import numpy as np

from quadstep.errors import UserError
from quadstep.flight.closed_loop import Outcome
from quadstep.flight.engines import FlightPlan, fly
from quadstep.linear.analysis import Analysis, limits, of_even_rotors, of_loop, worst_of
from quadstep.linear.channels import commanded
from quadstep.linear.equilibrium import quiet
from quadstep.linear.margins import Limits
from quadstep.linear.reduced import reduced
from quadstep.linear.sampled import Loops, NotLinearError, linearised, linearising
from quadstep.linear.states import Flown
from quadstep.mission.schema import Mission
from quadstep.numbers import Vector
from quadstep.sensing.delay import filled


def along(mission: Mission, instants: int) -> Iterator[tuple[float, Analysis | str]]:
    """Times [s] spread over the mission's noise-free flight, and the loop there, or why there is none. Raises UserError."""
    plans = of_even_rotors(quiet(mission.plan(warn=False)))
    period = Loops(plans[0]).count
    last = plans[0].ticks.last // period - 1
    if last < 1:
        raise UserError(f"the flight ends before the common period of its loops, {period * plans[0].ticks.step:g} s")
    for place in np.unique(np.linspace(1, last, instants).round().astype(int)):
        first = int(place) * period
        yield first * plans[0].ticks.step, at(plans, first, limits(mission))


def at(plans: list[FlightPlan], first: int, asked: Limits) -> Analysis | str:
    """The loop at a tick."""
    try:
        with linearising():
            loops = [reduced(linearised(Loops(plan), flown_to(plan, first), first)) for plan in plans]
            return worst_of([of_loop(one, asked) for one in loops])
    except NotLinearError as error:
        return str(error)


def flown_to(plan: FlightPlan, first: int) -> Flown:
    """The loop before tick `first`, as flown. Raises NotLinearError where the flight ended before."""
    log = fly(plan._replace(ticks=plan.ticks._replace(last=first - 1)))
    if log.outcome is not Outcome.COMPLETED:
        raise NotLinearError(f"the flight ended after {log.ended:g} s")
    loops = Loops(plan)
    asked = Vector(commanded(loops.loop, loops.p, log.final.command))
    return loops.step(Flown(log.final, filled(asked, loops.loop.late), asked), first - 1)

"""Loops along a flight: at some instants the loop is linearised about the flown motion, as if that motion were frozen."""

from collections.abc import Iterator

import numpy as np

from quadstep.engines.fly import FlightPlan
from quadstep.io.errors import UserError
from quadstep.linear.analysis import Analysis, limits, of_even_rotors, of_loop, worst_of
from quadstep.linear.equilibrium import flown_to, quiet
from quadstep.linear.margins import Limits
from quadstep.linear.reduced import reduced
from quadstep.linear.sampled import Loops, linearised, linearising
from quadstep.linear.side import NotLinearError
from quadstep.mission.schema import Mission


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

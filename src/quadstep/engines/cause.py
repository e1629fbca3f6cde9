"""Which output of a law ended a flight whose numbers were no longer finite."""

import math

from quadstep.engines.eager import always
from quadstep.engines.fly import FlightPlan
from quadstep.interfaces.closed_loop import Outcome
from quadstep.interfaces.log import LIMITS, REASONS, FlightLog
from quadstep.numbers import flatten, leaf_names


def reason(plan: FlightPlan, log: FlightLog) -> str:
    """Why a flight ended early: the limit that it passed, or the law's output that was not finite first."""
    text = REASONS[log.outcome]
    if limit := LIMITS.get(log.outcome):
        values = dict(zip(leaf_names(plan.parameters), flatten(plan.parameters), strict=True))
        return limit.text.format(f"{limit.factor * values[limit.name]:.4g}") if limit.name in values else text
    if log.outcome is not Outcome.NOT_FINITE or plan.loop.controller.one_at_a_time:
        return text
    loop, numbers = plan.loop, plan.parameters
    if not all(map(math.isfinite, flatten(log.final.state))):
        return text
    every = dict(zip((task.name for task in loop.tasks), plan.ticks.every, strict=True))["law"]
    given = loop.told(log.final, numbers), loop.wanted(log.ended, numbers), numbers.gains, log.ended
    command, _ = always(loop.controller.law)(log.final.memory, *given, every * plan.ticks.step)
    for leaf, name in zip(flatten(command), leaf_names(command), strict=True):
        if not (math.isfinite(leaf) or name.startswith("desired_attitude")):  # only logged, and NaN of a law without one
            return f"{text}: the law's {name} was {leaf:g}"
    return text

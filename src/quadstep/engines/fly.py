"""Flying a plan, or many, on an engine by name; what identifies a flight, and why it ended."""

import hashlib
import math
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple, TypeAlias

from quadstep.engines.eager import always, fly_floats
from quadstep.engines.engine import FLIGHTS, Engine, loaded
from quadstep.engines.loop import Loop, Numbers
from quadstep.interfaces.closed_loop import Advance, Outcome, Ticks
from quadstep.interfaces.controller import Controller
from quadstep.interfaces.log import LIMITS, REASONS, FlightLog
from quadstep.io.code_identity import own_code
from quadstep.io.errors import UserError
from quadstep.numbers import Table, flatten, in_matrix, leaf_names
from quadstep.world.air import DeclaredWind


class FlightPlan(NamedTuple):
    """A flight as laws and numbers, ready for an engine.

    parameters, start: the structures that its plant makes; warnings: about its numbers.
    """

    loop: Loop
    parameters: Any
    start: Any
    ticks: Ticks
    warnings: tuple[str, ...] = ()

    def with_controller(self, controller: Controller, gains: object) -> "FlightPlan":
        """The same flight under another controller: a law and its gains, as described in `quadstep.interfaces.controller`.

        Raises UserError for one with other loops, for which the plan has no sample times, or with further measurements.
        """
        controller = self.loop.controller.instead(controller)
        loop = replace(self.loop, controller=controller)
        same = [task.name for task in loop.tasks] == [task.name for task in self.loop.tasks]
        if not same or set(controller.also_measures) - set(self.loop.controller.also_measures):
            raise UserError("a controller with other loops or measurements needs a mission that names it")
        parameters = self.parameters._replace(gains=gains)
        return self._replace(loop=loop, parameters=parameters, warnings=())


def fly(plan: FlightPlan, engine: Engine = Engine.LANES, progress: Advance | None = None) -> FlightLog:
    return fly_all([plan], engine, progress)[0]


def fly_all(plans: Sequence[FlightPlan], engine: Engine = Engine.LANES, progress: Advance | None = None) -> list[FlightLog]:
    """The logs of many flights, in order. On lanes, flights of the same structure and clock are flown together."""
    controlled = [plan for plan in plans if isinstance(plan.loop, Loop)]  # the engines take any `ClosedLoop`
    flown: Flown = loaded(FLIGHTS, engine)(plans)
    if len(plans) > 1 and any(plan.loop.controller.one_at_a_time for plan in controlled):
        return [fly(plan, engine, progress) for plan in plans]
    for plan in controlled:
        announce(plan.loop, plan.parameters, plan.start)
    logs = flown(progress)
    for plan in controlled:
        plan.loop.controller.after_flight(plan.parameters.gains)
    return logs


def announce(loop: Loop, parameters: Numbers, start: tuple[object, ...]) -> None:
    """Notify a controller that flies one flight at a time of its next one. Raises UserError if it cannot fly."""
    if loop.controller.one_at_a_time:
        loop.controller.before_flight(loop.measurement(loop.start(start, parameters), parameters), parameters.gains)


Flown: TypeAlias = Callable[[Advance | None], list[FlightLog]]
"""What flies plans; it does not raise their controllers' exceptions."""


def on_floats(plans: Sequence[FlightPlan]) -> Flown:
    """What flies these one by one, without a compiler."""
    return lambda progress: [fly_floats(plan.loop, plan.parameters, plan.start, plan.ticks, progress) for plan in plans]


def on_lanes(plans: Sequence[FlightPlan]) -> Flown:
    """What flies these in groups of the same structure and clock. Raises UserError where there is no compiler."""
    try:
        from quadstep.engines.kernel import fly_lanes  # noqa: PLC0415 (the compiler is loaded only where it is used)
    except ModuleNotFoundError as error:
        if error.name != "llvmlite":
            raise
        raise UserError(
            "engine 'lanes' needs llvmlite, which this Python does not have; engine 'python' works without it"
        ) from None

    groups: dict[object, list[int]] = defaultdict(list)
    for i, plan in enumerate(plans):
        pairs = zip(flatten(plan.parameters), in_matrix(plan.parameters), strict=True)
        common = tuple(leaf for leaf, entry in pairs if entry or isinstance(leaf, Table))
        groups[plan.loop, plan.ticks, tuple(leaf_names(plan.parameters)), common].append(i)

    def fly(progress: Advance | None) -> list[FlightLog]:
        logs: dict[int, FlightLog] = {}
        for members in groups.values():
            first = plans[members[0]]
            parameters, starts = [plans[i].parameters for i in members], [plans[i].start for i in members]
            logs.update(zip(members, fly_lanes(first.loop, parameters, starts, first.ticks, progress), strict=True))
        return [logs[i] for i in range(len(plans))]

    return fly


def reason(plan: FlightPlan, log: FlightLog) -> str:
    """Why a flight ended early: the limit that it passed, or what was not finite first, the wind of a user or the law."""
    text = REASONS[log.outcome]
    if limit := LIMITS.get(log.outcome):
        values = dict(zip(leaf_names(plan.parameters), flatten(plan.parameters), strict=True))
        return limit.text.format(f"{limit.factor * values[limit.name]:.4g}") if limit.name in values else text
    if log.outcome is not Outcome.NOT_FINITE or plan.loop.controller.one_at_a_time:
        return text
    loop, numbers = plan.loop, plan.parameters
    wind = always(loop.wind)(log.final, numbers, log.ended, loop.start(plan.start, numbers).state)
    reference = loop.reference(log.ended, numbers)
    causes = [(f"the wind of {type(loop.air).__name__}", leaf) for leaf in wind if isinstance(loop.air, DeclaredWind)]
    causes += zip((f"the path's {name}" for name in leaf_names(reference)), flatten(reference), strict=True)
    for cause, leaf in causes:
        if not math.isfinite(leaf):
            return f"{text}: {cause} was {leaf:g}"
    if not all(map(math.isfinite, flatten(log.final.state))):
        return text
    every = dict(zip((task.name for task in loop.tasks), plan.ticks.every, strict=True))["law"]
    given = loop.measurement(log.final, numbers), reference, numbers.gains, log.ended
    command, _ = always(loop.controller.law)(log.final.memory, *given, every * plan.ticks.step)
    for leaf, name in zip(flatten(command), leaf_names(command), strict=True):
        if not (math.isfinite(leaf) or name.startswith("desired_attitude")):  # only logged, and NaN of a law without one
            return f"{text}: the law's {name} was {leaf:g}"
    return text


def fingerprint(plans: list[FlightPlan]) -> str:
    """A digest of everything that decides the flights: laws, with the user's own code, every number, clock and start."""
    digest = hashlib.sha256()
    for plan in plans:
        leaves = flatten((plan.parameters, plan.start, plan.ticks))
        numbers = [leaf.values if isinstance(leaf, Table) else leaf for leaf in leaves]
        code = "".join(f" {one}" for one in sorted(own_code(plan.loop)))
        digest.update(f"{plan.loop!r} {numbers!r}{code}\n".encode())
    return digest.hexdigest()[:16]

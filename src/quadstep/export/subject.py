"""What of a mission is exported."""

from quadstep.c99.law import Subject, recorded
from quadstep.c99.source import Clocked, Exported, c_name
from quadstep.control.opaque import Opaque
from quadstep.errors import UserError
from quadstep.flight.engines import FlightPlan
from quadstep.user_code.blame import blamed


def subject_of(plan: FlightPlan) -> Subject:
    """The law of a flight with its gains, and what its vehicle makes of commands. Raises UserError for an opaque law."""
    loop, parameters = plan.loop, plan.parameters
    if isinstance(loop.controller, Opaque):
        raise UserError(
            f"controller: {loop.controller.name or 'a function'} is any Python code, which has no equations to export; "
            "write it as a law (docs/own.md)"
        )
    reference = loop.path.reference(0.0, parameters.path)
    _, held = loop.plant.rest(plan.start, parameters)
    measured = loop.plant.told(loop.plant.truth(plan.start), held)
    return Subject(loop.controller, parameters.gains, loop.plant, parameters, measured, reference, loop.guided)


def clock_of(plan: FlightPlan) -> Clocked:
    """When its samples are due."""
    every = dict(zip((task.name for task in plan.loop.tasks), plan.ticks.every, strict=True))
    law = every["control"]
    return Clocked(plan.ticks.step, every.get("guidance", law), law, plan.ticks.last)


def exported(plan: FlightPlan, precise: bool, about: tuple[str, ...] = (), logged: bool = False) -> Exported:
    """The law in C. Raises UserError for one that cannot be written in it."""
    subject = subject_of(plan)
    name = c_name(subject.controller.name or type(subject.controller).__name__)
    try:
        code = recorded(subject, precise, logged)
    except (TypeError, AttributeError, ValueError, RecursionError) as error:
        if blamed(error):
            raise
        raise UserError(f"controller: {name} cannot be written in C: {error}") from error
    return Exported(subject, code, name, precise, clock_of(plan), about)

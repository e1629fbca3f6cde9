"""The part of a mission that is exported."""

from typing import Protocol

from quadstep.control.opaque import Opaque
from quadstep.engines.loop import Loop, Numbers
from quadstep.export.c.interface import Clocked, Exported, c_name
from quadstep.export.c.law import Subject, recorded
from quadstep.interfaces.closed_loop import Ticks
from quadstep.interfaces.controller import Controller
from quadstep.io.errors import UserError
from quadstep.io.user_code.blame import blamed


class Planned(Protocol):
    """A flight as laws and numbers."""

    @property
    def loop(self) -> Loop: ...

    @property
    def parameters(self) -> Numbers: ...

    @property
    def start(self) -> tuple[object, ...]: ...

    @property
    def ticks(self) -> Ticks: ...


def refuse_opaque(controller: Controller) -> None:
    """Raises UserError for a controller that cannot be written in C, whatever it flies."""
    if isinstance(controller, Opaque):
        raise UserError(
            f"controller: {controller.name or 'a function'} is {controller.nature}, which has no equations to export; "
            "write it as a law (docs/own.md)"
        )


def subject_of(plan: Planned) -> Subject:
    """The law of a flight with its gains, and its vehicle's response to commands. Raises UserError for an opaque law."""
    loop, parameters = plan.loop, plan.parameters
    refuse_opaque(loop.controller)
    measured = loop.told(loop.start(plan.start, parameters), parameters)
    return Subject(loop.controller, parameters.gains, loop.plant, parameters, measured, loop.wanted(0.0, parameters))


def clock_of(plan: Planned) -> Clocked:
    every = dict(zip((task.name for task in plan.loop.tasks), plan.ticks.every, strict=True))
    sampled = (*plan.loop.controller.loops(), "law")
    return Clocked(plan.ticks.step, {name: every[name] for name in sampled}, plan.ticks.last)


def exported(plan: Planned, precise: bool, about: tuple[str, ...] = (), logged: bool = False) -> Exported:
    """The law in C. Raises UserError if it cannot be written in C."""
    subject = subject_of(plan)
    name = c_name(subject.controller.name or type(subject.controller).__name__)
    try:
        code = recorded(subject, precise, logged)
    except (TypeError, AttributeError, ValueError, RecursionError) as error:
        if blamed(error):
            raise
        raise UserError(f"controller: {name} cannot be written in C: {error}") from error
    return Exported(subject, code, name, precise, clock_of(plan), about)

"""A controller of the user's own asked once before it flies: whether it answers as a controller must."""

from typing import Any

from quadstep.errors import UserError
from quadstep.flight.loop import Loop
from quadstep.numbers import leaf_names

SHOWN = 60
"""Characters of an answer in a line."""


def rehearse(kind: str, loop: Loop, parameters: Any, start: Any, period: float) -> None:
    """One sample at t = 0. kind: the controller's `type`. Raises UserError, and whatever the controller raises."""
    cycle, law = loop.start(start, parameters), type(loop.controller).__name__
    known, reference = loop.told(cycle), loop.path.reference(0.0, parameters.path)
    given = (known, reference, parameters.gains, 0.0, period)
    if loop.guided:
        memory = loop.controller.guide(cycle.memory, *given)
        check_memory(f"{kind}: {law}.guide", cycle.memory, memory)
    answer = loop.controller.law(cycle.memory, *given)
    said = f"{kind}: {law}.law"
    if not isinstance(answer, tuple) or len(answer) != len(("command", "memory")) or hasattr(answer, "_fields"):
        raise UserError(f"{said}: should return a command and the memory, not {answer!r:.{SHOWN}}")
    command, memory = answer
    wanted, got = leaf_names(cycle.command), leaf_names(command)
    if not isinstance(command, type(cycle.command)) or got != wanted:
        like = f"{type(cycle.command).__name__}({', '.join(cycle.command._fields[:2])}, ...)"
        raise UserError(f"{said}: should return a {like} with numbers {', '.join(wanted[:4])}, not {command!r:.{SHOWN}}")
    check_memory(said, cycle.memory, memory)


def check_memory(said: str, before: Any, after: Any) -> None:
    """Raises UserError for a memory of another shape."""
    wanted, got = leaf_names(before), leaf_names(after)
    if wanted != got:
        known, found = (", ".join(names) or "nothing" for names in (wanted, got))
        raise UserError(f"{said}: should return a memory like that of start: {known:.{SHOWN}}, not {found:.{SHOWN}}")

"""Checks that a user's controller or plant returns what a flight needs: one sample on floats, before anything is compiled."""

import math
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, cast

import numpy as np

from quadstep.control.opaque import Opaque
from quadstep.engines.eager import always
from quadstep.engines.loop import Cycle, Loop, Numbers
from quadstep.interfaces.closed_loop import Outcome, Ticks
from quadstep.interfaces.controller import Command, RotorSpeeds, RotorThrusts
from quadstep.interfaces.log import Metric, added, started
from quadstep.io.errors import UserError
from quadstep.io.user_code import blamed
from quadstep.numbers import Structure, Table, Vector, flatten, leaf_names, rebuild, vector
from quadstep.program.python_code import PythonCode, entered

if TYPE_CHECKING:
    from quadstep.vehicle.multirotor import Spun

NUMBERS = float, int, np.floating, np.integer
MADE_OF = "numbers, vectors and tuples of them"

MISUSED = AttributeError, IndexError, TypeError
"""What Python raises where a number is used as a vector."""

T = TypeVar("T")


class NotFiniteError(UserError):
    """The first answer of a user's own code is not finite."""


def try_out(loop: Loop, parameters: Any, start: Any, ticks: Ticks) -> None:
    """One sample of the loop's controller. Raises UserError if it returns anything of the wrong kind.

    An opaque controller (any Python function) is not called: it may have a memory.
    """
    law, gains = loop.controller, parameters.gains
    if isinstance(law, Opaque):
        return
    check_numbers(gains, "its gains")
    cycle = loop.start(start, parameters)
    check_numbers(cycle.memory, "start: the memory")
    periods = {task.name: every * ticks.step for task, every in zip(loop.tasks, ticks.every, strict=True)}
    given, memory = (loop.measurement(cycle, parameters), loop.reference(0.0, parameters), gains, 0.0), cycle.memory
    check_memory(always(law.enter)(*given[:3]), cycle.memory, "enter")
    for name in law.loops():
        memory = first_sample(name, always(partial(law.slower, name)), memory, *given, periods[name])
        check_memory(memory, cycle.memory, name)
    kind = type(cycle.command) if law.commands is Command else law.commands
    answer: object = first_sample("law", always(law.law), memory, *given, periods["law"])
    wanted = kind.__name__
    if not isinstance(answer, tuple) or len(answer) != 2 or not isinstance(answer[0], kind):
        raise UserError(f"law: should return a {wanted} and the memory; it returns {type_name(answer)}")
    check_command(loop, cycle, parameters, answer[0])
    check_memory(answer[1], cycle.memory, "law")
    check_finite(loop, cycle, parameters, answer[0])


def check_plant(loop: Loop, parameters: Numbers, start: tuple[Structure, ...]) -> None:
    """The methods of a plant, once each. Raises UserError if one returns something of the wrong shape."""
    cycle, plant = loop.start(start, parameters), loop.plant
    check_numbers(cycle.state, "begin: the state")
    check_same(always(plant.actuate)(parameters, cycle.command), cycle.held, "actuate: the command to the actuators")
    check_same(always(loop.rate)(cycle, parameters, 0.0, cycle.state), cycle.state, "rate: the rates")
    for method, given, key, wanted in (
        ("row", always(loop.row)(cycle, parameters, 0.0), "columns", plant.columns),
        ("error", always(plant.error)(cycle.state, loop.reference(0.0, parameters)), "axes", plant.axes),
        ("inputs", always(plant.inputs)(cycle.held), "efforts", plant.efforts),
    ):
        entries = tuple(given) if isinstance(given, list | Vector) else ()
        check_numbers(entries, method)
        if len(entries) != len(wanted):
            kind = "list" if method == "row" else "Vector"
            raise UserError(
                f"{method}: should be a {kind} of {len(wanted)} numbers, one for each of `{key}`, not {given!r:.60}"
            )


def try_metrics(metrics: Sequence[Metric], columns: Iterable[str]) -> None:
    """Records one sample of the metrics, as engines do that compile them. Raises what they raise where they cannot be."""
    code, names = PythonCode(precise=True), list(columns)
    sample = dict(zip(names, entered(code, [], tuple(0.0 for _ in names)), strict=True))
    added(metrics, entered(code, [], started(metrics)), sample)


def first_sample(method: str, sample: Callable[..., T], memory: object, *given: object) -> T:
    """A sample with this memory. Raises UserError where it fails since `start` gives a number for a vector, and where it
    gives something else when it is taken again.
    """
    try:
        answer, again = sample(memory, *given), sample(memory, *given)
    except MISUSED as error:
        leaves, names = flatten(memory), leaf_names(memory)
        for place, (leaf, name) in enumerate(zip(leaves, names, strict=True)):
            meant = rebuild(memory, iter([*leaves[:place], vector(0.0, 0.0, 0.0), *leaves[place + 1 :]]))
            try:
                sample(meant, *given)
            except Exception:  # another leaf, or another mistake
                continue
            found = blamed(error)
            where = f"{Path(found[0]).name}:{found[1]}" if found else "the law"
            raise UserError(
                f"start: the memory: {name or 'it'} is a number, {leaf!r:.60}, where {where} takes a vector"
            ) from error
        raise
    check_again(method, answer, again)
    return answer


def check_again(method: str, answer: object, again: object) -> None:
    """Refuses a law that does not depend on its arguments alone: engines record it once. Raises UserError."""
    for name, one, other in zip(leaf_names(answer), flatten(answer), flatten(again), strict=False):
        if (
            isinstance(one, NUMBERS)
            and isinstance(other, NUMBERS)
            and not (one == other or (math.isnan(one) and math.isnan(other)))
        ):
            what = name.removeprefix("0.") or "it"
            digits = 6 if f"{one:.6g}" != f"{other:.6g}" else 17
            values = f"{what} is {other:.{digits}g} after {one:.{digits}g}"
            raise UserError(
                f"{method}: should depend on its arguments alone; called again with them, {values}. What changes from "
                "sample to sample belongs in the memory; random numbers come from `noise` (docs/own.md)"
            )


def check_command(loop: Loop, cycle: Cycle, parameters: object, command: object) -> None:
    """Refuses a command that the vehicle cannot take. Raises UserError."""
    what = f"law: the {type(command).__name__}"
    check_numbers(command, what)
    if isinstance(command, RotorThrusts | RotorSpeeds):
        told, rotors = len(command[0]), len(cast("Spun", cycle.held).speeds)
        if told != rotors:
            raise UserError(f"{what}: should have an entry for each of the {rotors} rotors, not {told}")
    check_same(loop.plant.logged_command(parameters, command), cycle.command, what)


def check_finite(loop: Loop, cycle: Cycle, parameters: Numbers, command: object) -> None:
    """Refuses a law whose flight ends with its first command. Raises NotFiniteError."""
    asked, reference = loop.plant.logged_command(parameters, command), loop.reference(0.0, parameters)
    if always(loop.plant.outcome)(parameters, cycle.state, asked, reference) != Outcome.NOT_FINITE:
        return
    check_first(command, f"law: the {type(command).__name__}")


def check_first(answer: object, what: str) -> None:
    """Refuses an answer at t = 0 that is not finite. Raises NotFiniteError."""
    for leaf, name in zip(flatten(answer), leaf_names(answer), strict=True):
        if isinstance(leaf, NUMBERS) and not math.isfinite(leaf):
            raise NotFiniteError(f"{what}: {name} is {leaf:g} at t = 0 s; it should be finite")


def check_wind(loop: Loop, parameters: Numbers, start: tuple[Structure, ...], where: str) -> None:
    """Refuses a wind of the user's own, defined there, that is not finite at once. Raises NotFiniteError."""
    cycle = loop.start(start, parameters)
    wind = [*always(loop.wind)(cycle, parameters, 0.0, cycle.state)]
    if not all(map(math.isfinite, wind)):
        given = ", ".join(f"{axis:g}" for axis in wind)
        raise NotFiniteError(f"wind: {type(loop.air).__name__}: is ({given}) m/s at t = 0 s; it should be finite{where}")


def type_name(answer: object) -> str:
    """The type of something, for a tuple entry by entry."""
    if type(answer) is tuple and answer:
        return f"a tuple of {', '.join(type(one).__name__ for one in answer)}"
    return type(answer).__name__


def check_numbers(structure: object, what: str) -> None:
    """Refuses anything not made of numbers. Raises UserError."""
    for leaf, name in zip(flatten(structure), leaf_names(structure), strict=True):
        if not isinstance(leaf, (*NUMBERS, Table)):
            inside = f"{name} is" if name else "it is"
            raise UserError(f"{what}: should be made of {MADE_OF}; {inside} a {type(leaf).__name__}")


def check_same(structure: object, first: object, what: str) -> None:
    """Refuses a structure with other leaves than at the start. Raises UserError."""
    check_numbers(structure, what)
    now, then = leaf_names(structure), leaf_names(first)
    if now != then:
        changes = "; ".join(filter(None, (set_aside("missing", then, now), set_aside("new", now, then))))
        raise UserError(f"{what}: should keep the shape it has at the start; {changes}")


def check_memory(memory: object, first: object, method: str) -> None:
    """Refuses a memory of another shape than `start` gave. Raises UserError."""
    check_numbers(memory, f"{method}: the memory")
    now, then = leaf_names(memory), leaf_names(first)
    for name in then:
        entries = [one for one in now if one.startswith(f"{name}." if name else "")]
        if name not in now and len(entries) > 1:
            raise UserError(
                f"start: the memory: {name or 'it'} is a number, but `{method}` returns {len(entries)} numbers for it; "
                "both should return the same shape"
            )
    check_same(memory, first, f"{method}: the memory")


def set_aside(word: str, names: list[str], others: list[str]) -> str:
    """The names that are not among the others, after a word; nothing where there are none."""
    aside = [name or "a number" for name in names if name not in others]
    return f"{word}: {', '.join(aside)}" if aside else ""

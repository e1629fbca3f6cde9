"""Hover that holds for ever: the largest box of starts from which no flight leaves a set about the loop's rest."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from quadstep.errors import UserError
from quadstep.numbers import flatten
from quadstep.numbers.enclosure import UndefinedError
from quadstep.prove.invariant import Held, Set, largest
from quadstep.prove.modes import Modes, modes
from quadstep.prove.rest import Rest, rest
from quadstep.prove.sampled import Array, Sampled
from quadstep.prove.unknown import Unknown

UNITS = {"velocity": (1.0, "m/s"), "rates": (np.degrees(1.0), "deg/s"), "speeds": (1.0, "rad/s")}
"""The quantities reported besides position and attitude, with their units."""


class Hold(NamedTuple):
    """at: where the loop rests. own: whether the starts are the mission's own except for the position; else those of the
    rest. reach: how far each state of the loop may be from its rest.
    """

    at: Rest
    modes: Modes
    found: Held
    own: bool
    reach: Array


def held(loop: Sampled, unknown: Unknown, told: Callable[[int], None] = lambda _: None) -> Hold | str:
    """The largest set that is found, or the reason why there is none."""
    try:
        at = rest(loop)
        chosen = modes(at.slopes)
    except (UserError, UndefinedError) as error:
        return str(error)
    except np.linalg.LinAlgError:
        return "the loop has no eigenvectors to use as coordinates"
    fastest = int(np.argmax(np.abs(chosen.values)))
    if np.abs(chosen.values[fastest]) >= 1.0:
        rate = float(np.log(np.abs(chosen.values[fastest]))) / loop.period
        return f"the loop does not return to its rest: a mode grows at {rate:.3g} 1/s"
    why = ""
    for patient, own in ((False, True), (False, False), (True, True), (True, False)):
        begun = np.array(loop.at_rest(loop.like)) if own else at.state
        try:
            arithmetic = Set(loop, at, chosen, unknown, begun)
            found = largest(arithmetic, told, patient)
        except UndefinedError as error:
            found = str(error)
        if not isinstance(found, str):
            reach = np.zeros(len(at.state))
            reach[list(at.live)] = np.abs(chosen.spread @ arithmetic.parted) @ found.radii
            for place, other in at.twins.items():
                reach[place] = reach[other]
            if at.unit >= 0:
                turn = slice(at.unit + 1, at.unit + 4)
                moved, away = float(np.linalg.norm(reach[turn])), float(np.linalg.norm(np.abs(at.state[turn]) + reach[turn]))
                reach[at.unit] = away * moved / np.sqrt(1.0 - min(away, 0.9) ** 2)
            return Hold(at, chosen, found, own, reach)
        why = why or found
    return why


def described(loop: Sampled, one: Hold) -> list[tuple[str, str]]:
    """The set's extent besides the position: quantity, and how far it may be from its rest."""
    groups: dict[str, list[float]] = {}
    moving = len(flatten(loop.like.state))
    for place, name, reach in zip(loop.places, loop.names, one.reach, strict=True):
        if place < moving:
            groups.setdefault(name.partition(".")[0], []).append(float(reach))
    rows = []
    if "attitude" in groups:
        size = float(np.sqrt(np.square(groups["attitude"]).sum()))
        turn = 4.0 * np.arcsin(min(0.5 * size, 1.0)) if len(groups["attitude"]) == 4 else max(groups["attitude"])
        rows.append(("attitude", f"{np.degrees(turn) * 1.001:.3g} deg"))
    rows += [
        (name, f"{max(groups[name]) * size * 1.001:.3g} {unit}") for name, (size, unit) in UNITS.items() if name in groups
    ]
    return rows

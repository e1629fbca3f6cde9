"""Hover that holds for ever: the largest box of starts from which no flight leaves a set about the loop's rest."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from quadstep.io.errors import UserError
from quadstep.numbers import flatten
from quadstep.numbers.enclosure import UndefinedError
from quadstep.proofs.prove.escape import escape
from quadstep.proofs.prove.invariant import Held, Set, largest
from quadstep.proofs.prove.modes import Modes, modes
from quadstep.proofs.prove.rest import Rest, rest
from quadstep.proofs.prove.sampled import Array, Sampled
from quadstep.proofs.prove.unknown import Unknown
from quadstep.proofs.prove.verdict import up

UNITS = {"velocity": (1.0, "m/s"), "rates": (np.degrees(1.0), "°/s"), "speeds": (1.0, "rad/s")}
"""The quantities reported besides position and attitude, with their units."""


MOST_STATES = 200
"""A set is sought of loops with so many moving numbers at the most: its second-order terms are their cube."""


class Hold(NamedTuple):
    """at: where the loop rests. own: whether the starts are the mission's own except for the position; else those of the
    rest. reach: how far each state of the loop may be from its rest.
    """

    at: Rest
    modes: Modes
    found: Held
    own: bool
    reach: Array


class Left(NamedTuple):
    """Hover that is unstable. begun: how far a flight is off the rest at any sample but its first, reach: the box about the
    rest that it leaves, of each state of the loop. seconds: in which it does [s].
    """

    begun: Array
    reach: Array
    seconds: float


def invariant_set(loop: Sampled, unknown: Unknown, told: Callable[[int], None] = lambda _: None) -> Hold | Left | str:
    """The largest set that is found, or the proof that flights leave, or the reason why there is neither."""
    try:
        at = rest(loop)
        if len(at.live) > MOST_STATES:
            return f"{len(at.live)} numbers move from sample to sample, and sets are computed for {MOST_STATES} at the most"
        chosen = modes(at.slopes)
    except (UserError, UndefinedError) as error:
        return str(error)
    except np.linalg.LinAlgError:
        return "the loop has no eigenvectors to use as coordinates"
    fastest = int(np.argmax(np.abs(chosen.values)))
    if np.abs(chosen.values[fastest]) >= 1.0:
        rate = float(np.log(np.abs(chosen.values[fastest]))) / loop.period
        return left(Set(loop, at, chosen, unknown), fastest) or (
            f"the loop does not return to its rest: a mode grows at {rate:.3g} 1/s"
        )
    why = ""
    for patient, own in ((False, True), (False, False), (True, True), (True, False)):
        try:
            arithmetic = Set(loop, at, chosen, unknown, own)
            found = largest(arithmetic, told, patient)
        except UndefinedError as error:
            found = str(error)
        if not isinstance(found, str):
            return Hold(at, chosen, found, own, everywhere(at, arithmetic.reach @ found.radii))
        why = why or found
    return why


def left(arithmetic: Set, mode: int) -> Left | None:
    """The proof that flights leave along this mode, if there is one."""
    found, at = escape(arithmetic, mode), arithmetic.at
    if found is None:
        return None
    seconds = found.samples * arithmetic.loop.period
    return Left(everywhere(at, np.abs(found.begun)), everywhere(at, found.box), seconds)


def everywhere(at: Rest, live: Array) -> Array:
    """How far each state of the loop may be from its rest, from how far those that move may be."""
    reach = np.zeros(len(at.state))
    reach[list(at.live)] = live
    for place, other in at.twins.items():
        reach[place] = reach[other]
    if at.unit >= 0:
        turn = slice(at.unit + 1, at.unit + 4)
        moved, away = float(np.linalg.norm(reach[turn])), float(np.linalg.norm(np.abs(at.state[turn]) + reach[turn]))
        reach[at.unit] = away * moved / np.sqrt(1.0 - min(away, 0.9) ** 2)
    return reach


def described(loop: Sampled, reach: Array) -> list[tuple[str, str]]:
    """The extent of a set besides the position: quantity, and how far it may be from its rest, rounded up.

    reach: of the loop's numbers.
    """
    groups, found = grouped(loop, reach), []
    if "attitude" in groups:
        size = float(np.sqrt(np.square(groups["attitude"]).sum()))
        turn = 4.0 * np.arcsin(min(0.5 * size, 1.0)) if len(groups["attitude"]) == 4 else max(groups["attitude"])
        found.append(("attitude", float(np.degrees(turn)), "°"))
    found += [(name, max(groups[name]) * size, unit) for name, (size, unit) in UNITS.items() if name in groups]
    return [(name, f"{up(value, 3) if value else 0.0:.3g} {unit}".replace(" °", "°")) for name, value, unit in found]


def grouped(loop: Sampled, reach: Array) -> dict[str, list[float]]:
    """The entries of a vector of the loop's numbers that are the vehicle's, by quantity."""
    groups: dict[str, list[float]] = {}
    moving = len(flatten(loop.like.state))
    for place, name, far in zip(loop.places, loop.names, reach, strict=True):
        if place < moving:
            groups.setdefault(name.partition(".")[0], []).append(float(far))
    return groups


def each(loop: Sampled, reach: Array) -> dict[str, tuple[list[float], str]]:
    """The same number by number: quantity, its numbers, their unit. An attitude as a quaternion counts with twice its vector
    part, the turns about the axes to first order.
    """
    groups, found = grouped(loop, reach), {}
    if "attitude" in groups:
        turns = groups["attitude"]
        turns = [2.0 * one for one in turns[1:]] if len(turns) == 4 else turns
        found["attitude"] = [float(np.degrees(one)) for one in turns], "°"
    found |= {name: ([one * size for one in groups[name]], unit) for name, (size, unit) in UNITS.items() if name in groups}
    return found

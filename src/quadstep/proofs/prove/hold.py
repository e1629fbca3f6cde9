"""Hover that holds for ever: the largest box of starts from which no flight leaves a set about the loop's rest.
And that hover is unstable: a set that flights leave if a growing mode has a small share in them.

The set is that of `invariant`, |z_i| <= r_i. Inside, for a mode u with |L_uu| = 1 + s > 1,

    |z_u'| >= (1 + s) |z_u| - c,    c = sum_j |L_uj| r_j (j not u) + sum_jk |Q_ujk| r_j r_k + ...,

so that |z_u| - c / s grows by the factor 1 + s a sample, and a flight with |z_u| = 2 c / s is outside log(r_u s / c - 1) /
log(1 + s) samples later, whatever its other modes do. Where the modes that decay map into their radii, it leaves by one that
grows. Rounding is part of c: this holds for the law as flown.

z' is seen through T near V^-1, and may lie outside the set: with A = I - T V and |A| <= 1/2, all in the norm of row sums,

    z' = T e' + A z',    |z_i'| <= |T e'|_i + 2 |A|_i max |T e'|.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadstep.io.errors import UserError
from quadstep.io.grouping import by_first
from quadstep.linear.states import quantity
from quadstep.numbers import flatten
from quadstep.numbers.affine import HALF_UNIT, UP
from quadstep.numbers.enclosure import UndefinedError
from quadstep.proofs.prove.invariant import Growth, InvariantSet, SetArithmetic, largest
from quadstep.proofs.prove.linear_maps import ROUNDING, Eigenbasis, modes
from quadstep.proofs.prove.rest import RestingLoop, rest
from quadstep.proofs.prove.sampled import Array, SampledLoop
from quadstep.proofs.prove.unknown import Unknown
from quadstep.report.units import rounded_up

LARGEST, SMALLEST, STEP = 100.0, 1e-9, 10.0**-0.5
"""Sizes of the sets that are tried: the largest entry of each mode."""

NEAR = 1e-6
"""A vehicle that leaves no larger box than this [m] counts as being at its place."""

WITHIN = 0.5
"""The start is at most so much of the box that its flight leaves."""

ASTRAY = 0.5
"""T V may differ by less than this from the identity."""

NARROW, WIDER, ROUNDS = 1e-6, 1.5, 3
"""Of the modes that decay: the least radius, how much more than they need they are given, and how often it is found anew."""

EXACT = 1e-9
"""More than quotients and logarithms here lose by rounding; growth that is slower shows nothing."""


class Escape(NamedTuple):
    """begun: how far off the loop's rest a flight is at any sample but its first. box: about the rest, which it leaves. Both
    are of the moving numbers; the others are as at rest. samples: in which it does.
    """

    begun: Array
    box: Array
    samples: int


def escape(at: SetArithmetic, mode: int) -> Escape | None:
    """The proof that flights leave along this mode, by the largest set that shows it; None if there is none."""
    grows = np.abs(at.modes.values) >= 1.0
    size = LARGEST
    while size >= SMALLEST:
        try:
            radii, growth = narrow(at, grows, at.even(size / np.abs(at.modes.spread).max(axis=0)))
        except UndefinedError:
            size *= STEP
            continue
        box = inner(at, grows, radii)
        found = escaped(at, mode, grows, radii, growth, box)
        if found is not None or box[at.axes].max() < NEAR:
            return found
        size *= STEP
    return None


def narrow(at: SetArithmetic, grows: NDArray[np.bool_], radii: Array) -> tuple[Array, Growth]:
    """The set with radii as small as can be of the modes that decay, and its image. Raises UndefinedError."""
    least = radii * NARROW
    current = np.where(grows, radii, least)
    for _ in range(ROUNDS):
        growth = at.after(current)
        own = np.diag(growth.lines)
        decay = 1.0 - own / current
        settled = (growth.whole - own) / np.where(decay > 0.0, decay, 1.0)
        current = at.even(np.where(grows, radii, np.clip(WIDER * settled, least, radii)))
    return current, at.after(current)


def escaped(at: SetArithmetic, mode: int, grows: NDArray[np.bool_], radii: Array, found: Growth, box: Array) -> Escape | None:
    """The start along the mode from which flights leave the set with these radii, and so the box, if this shows it."""
    radius = float(radii[mode])
    own = float(found.lines[mode, mode] - at.astray[mode, mode] * radius)  # counted there, as if the image were in the set
    growth = own / radius * (1.0 - EXACT) - 1.0
    whole = state_bounds(at, found.whole)
    others = float(whole[mode] - own * (1.0 - EXACT))
    if not (growth > EXACT and np.all(whole[~grows] <= radii[~grows])):
        return None
    share = others / (growth * radius) * (1.0 + EXACT)
    off = state_bounds(
        at, np.abs(at.into) @ (4.0 * HALF_UNIT * (np.abs(at.at.state[at.place]) + box))
    )  # a start's own rounding
    if not (share < WITHIN and np.all(off <= (1.0 - 2.0 * share) * radii)):
        return None
    begun = (2.0 * share * radius + float(off[mode])) * at.modes.spread[:, mode]
    if not np.all(np.abs(begun) <= WITHIN * box):
        return None
    samples = np.ceil(np.log((1.0 - share) / share) / np.log1p(growth) * (1.0 + EXACT))
    return Escape(begun, box, int(samples) + 1)  # it is outside where that is exceeded


def inner(at: SetArithmetic, grows: NDArray[np.bool_], radii: Array) -> Array:
    """A box of the moving numbers in which the modes that grow are within their radii."""
    shape = at.reach @ radii
    reached = state_bounds(at, np.abs(at.into) @ shape)
    return shape * (1.0 - EXACT) / float((reached / radii)[grows].max())


def state_bounds(at: SetArithmetic, seen: Array) -> Array:
    """Bounds of |z| from those of |T e|, e = V z; infinite where T is too far from the inverse of V."""
    astray = at.astray.sum(axis=1) * UP
    if not astray.max() < ASTRAY:
        return np.full_like(seen, np.inf)
    return (seen + 2.0 * astray * seen.max()) * UP


UNITS = {"velocity": (1.0, "m/s"), "rates": (np.degrees(1.0), "°/s"), "speeds": (1.0, "rad/s")}
"""The quantities reported besides position and attitude, with their units."""


MOST_STATES = 200
"""A set is sought of loops with so many moving numbers at the most: its second-order terms are their cube."""


class Hold(NamedTuple):
    """at: where the loop rests. own: whether the starts are the mission's own except for the position; else those of the
    rest. reach: how far each state of the loop may be from its rest.
    """

    at: RestingLoop
    modes: Eigenbasis
    found: InvariantSet
    own: bool
    reach: Array


class Departure(NamedTuple):
    """Hover that is unstable. begun: how far a flight is off the rest at any sample but its first, reach: the box about the
    rest that it leaves, of each state of the loop. seconds: in which it does [s].
    """

    begun: Array
    reach: Array
    seconds: float


def invariant_set(
    loop: SampledLoop, unknown: Unknown, progress: Callable[[int], None] = lambda _: None
) -> Hold | Departure | str:
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
    sizes = np.abs(chosen.values)
    fastest = int(np.argmax(sizes > (1.0 - ROUNDING) * sizes.max()))  # the first of equal ones
    if sizes[fastest] >= 1.0:
        rate = float(np.log(sizes[fastest])) / loop.period
        return prove_departure(SetArithmetic(loop, at, chosen, unknown), fastest) or (
            f"the loop does not return to its rest: a mode grows at {rate:.3g} 1/s"
        )
    why = ""
    for patient, own in ((False, True), (False, False), (True, True), (True, False)):
        try:
            arithmetic = SetArithmetic(loop, at, chosen, unknown, own)
            found = largest(arithmetic, progress, patient)
        except UndefinedError as error:
            found = str(error)
        if not isinstance(found, str):
            return Hold(at, chosen, found, own, everywhere(at, arithmetic.reach @ found.radii))
        why = why or found
    return why


def prove_departure(arithmetic: SetArithmetic, mode: int) -> Departure | None:
    """The proof that flights leave along this mode, if there is one."""
    found, at = escape(arithmetic, mode), arithmetic.at
    if found is None:
        return None
    seconds = found.samples * arithmetic.loop.period
    return Departure(everywhere(at, np.abs(found.begun)), everywhere(at, found.box), seconds)


def everywhere(at: RestingLoop, live: Array) -> Array:
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


def described(loop: SampledLoop, reach: Array) -> list[tuple[str, str]]:
    """The extent of a set besides the position: quantity, and how far it may be from its rest, rounded up.

    reach: of the loop's numbers.
    """
    groups, found = vehicle_numbers(loop, reach), []
    if "attitude" in groups:
        size = float(np.sqrt(np.square(groups["attitude"]).sum()))
        turn = 4.0 * np.arcsin(min(0.5 * size, 1.0)) if len(groups["attitude"]) == 4 else max(groups["attitude"])
        found.append(("attitude", float(np.degrees(turn)), "°"))
    found += [(quantity(name), max(groups[name]) * size, unit) for name, (size, unit) in UNITS.items() if name in groups]
    return [(name, f"{rounded_up(value, 3) if value else 0.0:.3g} {unit}".replace(" °", "°")) for name, value, unit in found]


def vehicle_numbers(loop: SampledLoop, reach: Array) -> dict[str, list[float]]:
    """The entries of a vector of the loop's numbers that are the vehicle's, by quantity."""
    moving, every = len(flatten(loop.like.state)), zip(loop.places, loop.names, reach, strict=True)
    return by_first((name.partition(".")[0], float(far)) for place, name, far in every if place < moving)


def number_extents(loop: SampledLoop, reach: Array) -> dict[str, tuple[list[float], str]]:
    """The same number by number: quantity, its numbers, their unit. An attitude as a quaternion counts with twice its vector
    part, the turns about the axes to first order.
    """
    groups, found = vehicle_numbers(loop, reach), {}
    if "attitude" in groups:
        turns = groups["attitude"]
        turns = [2.0 * one for one in turns[1:]] if len(turns) == 4 else turns
        found["attitude"] = [float(np.degrees(one)) for one in turns], "°"
    found |= {name: ([one * size for one in groups[name]], unit) for name, (size, unit) in UNITS.items() if name in groups}
    return found

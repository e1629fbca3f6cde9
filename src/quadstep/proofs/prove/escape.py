"""A proof that hover is unstable: a set about the loop's rest that flights leave if a growing mode has a small share in them.

The set is that of `invariant`, |z_i| <= r_i. Inside, for a mode u with |L_uu| = 1 + s > 1,

    |z_u'| >= (1 + s) |z_u| - c,    c = sum_j |L_uj| r_j (j not u) + sum_jk |Q_ujk| r_j r_k + ...,

so that |z_u| - c / s grows by the factor 1 + s a sample, and a flight with |z_u| = 2 c / s is outside log(r_u s / c - 1) /
log(1 + s) samples later, whatever its other modes do. Where the modes that decay map into their radii, it leaves by one that
grows. Rounding is part of c: this holds for the law as flown.

z' is seen through T near V^-1, and may lie outside the set: with A = I - T V and |A| <= 1/2, all in the norm of row sums,

    z' = T e' + A z',    |z_i'| <= |T e'|_i + 2 |A|_i max |T e'|.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadstep.numbers.enclosure import UndefinedError
from quadstep.proofs.prove.invariant import Growth, Set
from quadstep.proofs.prove.sampled import Array
from quadstep.proofs.prove.spectrum import HALF_UNIT, UP

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


def escape(at: Set, mode: int) -> Escape | None:
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


def narrow(at: Set, grows: NDArray[np.bool_], radii: Array) -> tuple[Array, Growth]:
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


def escaped(at: Set, mode: int, grows: NDArray[np.bool_], radii: Array, found: Growth, box: Array) -> Escape | None:
    """The start along the mode from which flights leave the set with these radii, and so the box, if this shows it."""
    radius = float(radii[mode])
    own = float(found.lines[mode, mode] - at.astray[mode, mode] * radius)  # counted there, as if the image were in the set
    growth = own / radius * (1.0 - EXACT) - 1.0
    whole = settled(at, found.whole)
    others = float(whole[mode] - own * (1.0 - EXACT))
    if not (growth > EXACT and np.all(whole[~grows] <= radii[~grows])):
        return None
    share = others / (growth * radius) * (1.0 + EXACT)
    off = settled(at, np.abs(at.into) @ (4.0 * HALF_UNIT * (np.abs(at.at.state[at.place]) + box)))  # a start's own rounding
    if not (share < WITHIN and np.all(off <= (1.0 - 2.0 * share) * radii)):
        return None
    begun = (2.0 * share * radius + float(off[mode])) * at.modes.spread[:, mode]
    if not np.all(np.abs(begun) <= WITHIN * box):
        return None
    samples = np.ceil(np.log((1.0 - share) / share) / np.log1p(growth) * (1.0 + EXACT))
    return Escape(begun, box, int(samples) + 1)  # it is outside where that is exceeded


def inner(at: Set, grows: NDArray[np.bool_], radii: Array) -> Array:
    """A box of the moving numbers in which the modes that grow are within their radii."""
    shape = at.reach @ radii
    reached = settled(at, np.abs(at.into) @ shape)
    return shape * (1.0 - EXACT) / float((reached / radii)[grows].max())


def settled(at: Set, seen: Array) -> Array:
    """Bounds of |z| from those of |T e|, e = V z; infinite where T is too far from the inverse of V."""
    astray = at.astray.sum(axis=1) * UP
    if not astray.max() < ASTRAY:
        return np.full_like(seen, np.inf)
    result: Array = (seen + 2.0 * astray * seen.max()) * UP
    return result

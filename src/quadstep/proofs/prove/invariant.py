"""A set about a loop's rest that no flight ever leaves: sampled, e' = A e + B w + q(e, e) + r.

In eigenvectors, e = V z, with a complex pair as the coordinates of one complex number, the set is |z_i| <= r_i: a box of
intervals and discs. Its image after one sample, with slopes and second-order terms exact up to rounding and the others
enclosed, lies in the set if for every i

    sum_j |L_ij| r_j + sum_jk |Q_ijk| r_j r_k + |T| r + ... <= r_i,    T near V^-1.

Then flights that start in it stay in it for ever, sample by sample. z' itself, V z' = e', is z' = T e' + (I - T V) z', and
lies in the box as soon as |T e'| + |I - T V| r does (the map contracts it).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from quadstep.engines.loop import Numbers
from quadstep.numbers import flatten
from quadstep.numbers.affine import UP
from quadstep.numbers.enclosure import Operand, UndefinedError
from quadstep.proofs.prove.linear_maps import ComplexArray, Eigenbasis, products
from quadstep.proofs.prove.rest import RestingLoop, always, next_numbers
from quadstep.proofs.prove.sampled import Array, SampledLoop
from quadstep.proofs.prove.unknown import (
    CONSTANTS,
    PUSHES,
    STARTS,
    Leaf,
    Unknown,
    displaced,
    image,
    seeded,
    summed,
    widened,
    with_unknown,
)

MOST_ROUNDS, MOST_STEPS, HALVINGS = 400, 40, 16
LARGER, CLOSER, SMALLER, SPARE, GROWN = 1.01, 1.001, 0.85, 1e-9, 1e3
BEGIN, LEAST, MOST = 1e-3, 1e-8, 1.0
"""Half sides of the box of starts [m]: the first guess, the smallest and the largest tried."""


class Growth(NamedTuple):
    """Bounds on the set's image after a sample. lines: (modes, modes), of r_j. curves: (modes, modes, modes), of r_j r_k.
    pushes: of the unknowns, rest: the remainder, (modes,).
    """

    lines: Array
    curves: Array
    pushes: Array
    rest: Array

    @property
    def whole(self) -> Array:
        terms = self.lines.sum(axis=1) + self.curves.sum(axis=(1, 2)) + self.pushes + self.rest
        return terms * summed(self.curves[0].size)


class InvariantSet(NamedTuple):
    """radii: of the set's intervals and discs, one a column of `Eigenbasis.spread`. start: half the side of the box of starts
    [m]. limit: what stopped a larger one.
    """

    radii: Array
    start: float
    limit: str


class SetArithmetic:
    """The set's own arithmetic, for one loop, its rest and its modes."""

    def __init__(self, loop: SampledLoop, at: RestingLoop, basis: Eigenbasis, unknown: Unknown, own: bool = False) -> None:
        self.loop, self.at, self.modes, self.unknown, self.own = loop, at, basis, unknown, own
        count = len(at.live)
        self.place = list(at.live)
        self.axes = [self.place.index(axis) for axis in range(len(loop.loop.plant.axes))]
        self.joined = np.eye(count, dtype=complex)  # a pair (a, b) as a - i b and a + i b
        self.parted = np.eye(count, dtype=complex)
        for i in basis.pairs:
            self.joined[i : i + 2, i : i + 2] = [[1.0, -1.0j], [1.0, 1.0j]]
            self.parted[i : i + 2, i : i + 2] = [[0.5, 0.5], [0.5j, -0.5j]]
        self.into: ComplexArray = self.joined @ np.linalg.inv(basis.spread)
        size = np.abs(self.into)
        spread = basis.spread @ self.parted
        self.reach = np.abs(spread)
        self.astray = np.abs(np.eye(count) - self.into @ spread) + products(count + 4) * (size @ np.abs(spread))

    def even(self, radii: Array) -> Array:
        """The same, equal for both of a pair."""
        result = radii.copy()
        for i in self.modes.pairs:
            result[i : i + 2] = radii[i : i + 2].max()
        return result

    def after(self, radii: Array) -> Growth:
        """The set's image after a sample, at any tick but the first. Raises UndefinedError."""
        count = len(self.place)
        also = count * count + PUSHES + CONSTANTS
        numbers = seeded(self.at.state[self.place][:, None], self.modes.spread * radii, also, second=count)
        p = with_unknown(self.loop.parameters, self.unknown, count + count * count, count + also, 1)
        centre, parts, rest = self.run(self.at.numbers(numbers), always(self.loop), p, count + also)
        size = np.abs(self.into)
        seen = self.into @ parts
        lines = np.abs(seen[:, :count] @ self.parted)
        curves = seen[:, count : count + count * count].reshape(-1, count, count)
        curves = 0.5 * (curves + curves.transpose(0, 2, 1))
        curves = np.einsum("iab,aj,bk->ijk", curves, self.parted, self.parted, optimize=True)
        pushes = np.abs(seen[:, count + count * count :]).sum(axis=1)
        rounded = products(4 * count) * (size @ (np.abs(parts).sum(axis=1) + np.abs(centre)))
        more = np.abs(self.into @ centre) + size @ rest + 2.0 * rounded
        return Growth(lines + self.astray * radii, np.abs(curves), pushes, more)

    def starts(self, side: float) -> tuple[Array, Array]:
        """|z| of the starts after the first sample: of their centre, and added by the sides of the box of positions.

        Raises UndefinedError.
        """
        loop, count, also = self.loop, len(self.place), PUSHES + CONSTANTS
        unknown = self.unknown._replace(start=side)
        if self.own:
            numbers = loop.starts(unknown)
        else:
            body, state = len(flatten(loop.like.state)), self.at.state.tolist()
            numbers = displaced(loop.like.state, state[:body], loop.loop, unknown) + state[body:]
        p = with_unknown(loop.parameters, unknown, STARTS, STARTS + also, 1)
        moving = {*self.place, *self.at.twins, self.at.unit}
        numbers = [widened(one, also) if place in moving else one for place, one in enumerate(numbers)]
        centre, parts, rest = self.run(numbers, np.array([0.0]), p, STARTS + also)
        size, seen = np.abs(self.into), np.abs(self.into @ parts)
        rounded = products(4 * count) * (size @ (np.abs(parts).sum(axis=1) + np.abs(centre)))
        middle = np.abs(self.into @ centre) + seen[:, 3:].sum(axis=1)
        return middle * UP, (seen[:, :3].sum(axis=1) + size @ rest + rounded) * UP

    def run(self, numbers: Sequence[Leaf], tick: Operand, p: Numbers, directions: int) -> tuple[Array, Array, Array]:
        """One sample of the moving states: centre less the rest, parts, remainder. Raises UndefinedError."""
        found = image(next_numbers(self.loop, self.at, numbers, tick, p), directions, 1)
        if not all(np.all(np.isfinite(one)) for one in found):
            raise UndefinedError("a number grew beyond all bounds")
        gap = found.centre[:, 0] - self.at.state[self.place]
        return gap, found.parts[:, :, 0], found.rest[:, 0] + np.abs(gap) * 2.0**-52


def closed(growth: Growth, begun: Array, radii: Array) -> bool:
    """Whether the set maps into itself, and the starts into it."""
    return bool(np.all(growth.whole <= radii) and np.all(begun <= radii))


class GrowthGuess(NamedTuple):
    """A guess of how a set grows, from one whose growth was computed: slopes and curves stay, third-order terms grow with
    the cube of the size. reach: of the loop's numbers, of radii. side: of the starts; middle, sides: see `Set.starts`.
    """

    growth: Growth
    radii: Array
    reach: Array
    middle: Array
    sides: Array
    side: float

    def radii_for(self, side: float) -> Array | None:
        """The guessed least set for starts in a box of this size; None if there is none."""
        count, first = len(self.radii), (self.middle + self.sides * (side / self.side)) * LARGER
        begun: Array = np.maximum(first, SPARE * first.max())  # of a mode that starts at its rest and stays there too
        try:
            into = np.linalg.inv(np.eye(count) - self.growth.lines / self.radii)
        except np.linalg.LinAlgError:
            return None
        if not np.all(np.isfinite(into)) or np.any(into < -SPARE * np.abs(into).max()):
            return None  # not a contraction
        curves = (self.growth.curves / (self.radii[:, None] * self.radii)).reshape(count, -1)
        least = np.minimum(self.growth.rest, SPARE * self.radii)
        floor, size = self.growth.pushes + least, self.reach @ self.radii
        radii = begun
        for _ in range(MOST_ROUNDS):
            share = float(np.max(self.reach @ radii / size))
            added = floor + (self.growth.rest - least) * share**3 + curves @ np.outer(radii, radii).ravel()
            wanted = np.maximum(begun, into @ added * LARGER)
            if np.all(wanted <= radii):
                return radii
            if not np.all(wanted < GROWN * begun.max()):
                return None
            radii = np.maximum(radii, wanted * CLOSER)
        return None

    def largest(self, least: float, most: float) -> float:
        """The largest box of starts that has a set; 0 for none."""
        if self.radii_for(least) is None:
            return 0.0
        for _ in range(HALVINGS):
            middle = float(np.sqrt(least * most))
            least, most = (middle, most) if self.radii_for(middle) is not None else (least, middle)
        return least


def first_guess(at: SetArithmetic) -> tuple[GrowthGuess, float]:
    """From a box of starts as large as the law has values and contracting slopes for; nothing is said of third order.

    And the largest box of starts that it reaches [m], 0 for none.

    Raises UndefinedError.
    """
    side = BEGIN
    while True:
        try:
            middle, sides = at.starts(side)
            radii = at.even(np.maximum(middle + sides, SPARE * (middle + sides).max()))
            growth = at.after(radii)
            rest = np.minimum(growth.rest, SPARE * radii)
            guess = GrowthGuess(growth._replace(rest=rest), radii, at.reach, middle, sides, side)
            reached = guess.largest(LEAST, MOST)
            if reached or side < LEAST:
                return guess, reached
        except UndefinedError:
            if side < LEAST:
                raise
        side *= 0.1


def largest(at: SetArithmetic, progress: Callable[[int], None] = lambda _: None, patient: bool = False) -> InvariantSet | str:
    """The largest set that is found, or why there is none. patient: a guess whose slopes do not contract, from too far out, is
    dropped for the one before. Raises UndefinedError.
    """
    (guess, side), best = first_guess(at), None
    most, limit = MOST, "the nonlinear terms outgrow the decay"
    if not side:
        return unsettled(guess)
    side *= 0.6
    for step in range(MOST_STEPS):
        progress(step)
        found = guess.radii_for(side)
        if found is None:
            side *= SMALLER
            continue
        found = at.even(found)
        try:
            middle, sides = at.starts(side)
            growth = at.after(found)
        except UndefinedError as error:
            limit, most, side = str(error), min(most, side), side * SMALLER
            continue
        if closed(growth, middle + sides, found) and (best is None or side > best.start):
            best = InvariantSet(found, side, limit)
        nearer = GrowthGuess(growth, found, at.reach, middle, sides, side)
        wanted = min(nearer.largest(LEAST, MOST), 0.97 * most)
        if best is not None and wanted < 1.02 * best.start:
            break
        if wanted or not patient:
            guess = nearer
        side = wanted if wanted else side * SMALLER
    return best or f"no set closes: {limit}"


def unsettled(guess: GrowthGuess) -> str:
    """The reason why there is no set at all."""
    lines = guess.growth.lines / guess.radii
    fastest = float(np.abs(np.linalg.eigvals(lines)).max())
    if fastest >= 1.0:
        return f"its slopes do not contract (a mode times {fastest:.7g} a sample)"
    return "even close to its rest, its start or the unknowns outgrow the decay"

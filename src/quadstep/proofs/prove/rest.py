"""The rest of a sampled loop, by Newton's method on enclosures of points; no proof depends on how it was found."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from quadstep.engines.loop import Numbers
from quadstep.io.errors import UserError
from quadstep.numbers import Number
from quadstep.numbers.enclosure import ENCLOSURES, Enclosure, Operand, UndefinedError, ball
from quadstep.proofs.prove.sampled import Array, SampledLoop
from quadstep.proofs.prove.unknown import image, seeded
from quadstep.vehicle.multirotor import Multirotor

LONGEST = 1e6
"""The meaning of `for ever` here [s], eleven days: the sine of much longer times is NaN (`numbers.sin`)."""

QUATERNION = "attitude.0"
LENGTH = 1e-14
"""More than a quaternion's length can differ from one after `renormalised`, a few units in the last place."""

SMALL, MOST_STEPS, AT_REST, SAME = 1e-9, 20, 1e-9, 1e-12
NEUTRAL = 1e-11
"""A combination of numbers that returns by less than this share a sample does not return."""

CURVED = 0.05
"""How much of a change of `SMALL` may be off its slope; of the laws without an edge at rest it is 0.004 at the most."""


class RestingLoop(NamedTuple):
    """state: the loop's numbers at rest. live: places of those that move; slopes: of these, (live, live). The others are
    constants of the flight, or `twins`: a sample leaves the same number there as at another place, to the bit; or `unit`:
    the first number of a quaternion whose length is one (-1: none).
    """

    state: Array
    live: tuple[int, ...]
    twins: dict[int, int]
    unit: int
    slopes: Array

    def numbers(self, live: list[Enclosure]) -> list[Enclosure | float]:
        """The loop's numbers, with these values for the moving ones."""
        found: list[Enclosure | float] = self.state.tolist()
        for place, number in zip(self.live, live, strict=True):
            found[place] = number
        for place, other in self.twins.items():
            found[place] = found[other]
        if self.unit >= 0:
            x, y, z = (live[self.live.index(self.unit + i)] for i in (1, 2, 3))
            root = ENCLOSURES.sqrt(1.0 - (x * x + y * y + z * z))
            found[self.unit] = root.made(root.centre, root.parts, root.rest, root.reach, LENGTH)
        return found


def next_numbers(
    loop: SampledLoop, at: RestingLoop, numbers: Sequence[Enclosure | float], tick: Operand, p: Numbers
) -> list[Operand]:
    """The moving numbers one sample after all `numbers`. Raises UndefinedError if others do not behave as they should."""
    with np.errstate(all="ignore"):
        found = loop.step(numbers, tick, p)
    if at.unit >= 0:
        first = found[at.unit]
        if not np.all((first.low if isinstance(first, Enclosure) else first) > 0.5):
            raise UndefinedError("the attitude may turn by more than 120 degrees")
    for place, value in enumerate(at.state):
        if place == at.unit:
            continue
        other = at.twins.get(place)
        as_it_was = isinstance(found[place], float) and found[place] == value
        if other is not None and found[place] is not found[other]:
            raise UndefinedError(f"{loop.in_words(loop.names[place])} may differ from {loop.in_words(loop.names[other])}")
        if place not in at.live and other is None and not as_it_was:
            raise UndefinedError(f"{loop.in_words(loop.names[place])} does not stay as it is")
    return [found[place] for place in at.live]


def always(loop: SampledLoop) -> Enclosure:
    """All ticks after the first sample, as one enclosure."""
    middle = 0.5 * (LONGEST / loop.ticks.step + loop.span)
    return ball(np.array([middle]), middle - loop.span)


def path_rests(loop: SampledLoop) -> bool:
    """Whether the path is at rest at all ticks after the first sample."""
    wanted = loop.loop.path.reference(cast(Number, always(loop) * loop.ticks.step), loop.parameters.path)
    rates: tuple[object, ...] = (*wanted.velocity, *wanted.acceleration, wanted.yaw_rate)
    still = not any(one.size.any() if isinstance(one, Enclosure) else one != 0.0 for one in rates)
    return still and all(not isinstance(one, Enclosure) or not one.tight.any() for one in (*wanted.position, wanted.yaw))


def rest(loop: SampledLoop) -> RestingLoop:
    """Raises UserError where there is none, UndefinedError."""
    state, count = np.array(loop.at_rest(loop.like)), len(loop.places)
    tick, unit = np.array([float(loop.span)]), np.eye(count)
    for _ in range(MOST_STEPS):
        with np.errstate(all="ignore"):
            numbers = loop.step(seeded(state[:, None], unit * SMALL), tick)
        found = image(numbers, count, 1)
        slopes, left = found.parts[:, :, 0] / SMALL, found.centre[:, 0] - state
        constant = (found.rest[:, 0] == 0.0) & np.all(np.abs(slopes - unit) < SAME, axis=1) & (left == 0.0)
        twins = equal_places(numbers)
        live = np.array([i for i in np.flatnonzero(~constant) if i not in twins])
        for place, other in twins.items():
            slopes[:, other] += slopes[:, place]
            left[place] = 0.0
        inner = slopes[np.ix_(live, live)]
        change, rows = np.zeros(len(live)), np.flatnonzero(~idle(inner))
        returns = (np.eye(len(live)) - inner)[np.ix_(rows, rows)]
        refuse_neutral(loop, [loop.names[live[i]] for i in rows], returns)
        try:
            change[rows] = np.linalg.solve(returns, left[live][rows])
        except np.linalg.LinAlgError:
            break
        if not np.all(np.isfinite(change)):
            break
        state[live] += change
        for place, other in twins.items():
            state[place] = state[other]
        if np.all(np.abs(change) <= AT_REST * (1.0 + np.abs(state[live]))):
            refuse_idle(loop, [loop.names[place] for place in live], inner)
            size = np.maximum(np.abs(found.parts[live, :, 0]).sum(axis=1), SMALL)
            refuse_edge(loop, [loop.names[place] for place in live], found.rest[live, 0] > CURVED * size)
            return reduced(loop, RestingLoop(state, tuple(map(int, live)), twins, -1, inner))
    raise UserError("no state was found in which the loop rests")


def idle(slopes: Array) -> NDArray[np.bool_]:
    """The numbers that keep any value they are given, to first order."""
    return np.all(np.abs(slopes - np.eye(len(slopes))) < SAME, axis=1)


def refuse_idle(loop: SampledLoop, names: list[str], slopes: Array) -> None:
    """Raises UserError for numbers that keep any value they are given."""
    found = [name for name, stays in zip(names, idle(slopes), strict=True) if stays]
    if found:
        raise UserError(
            f"{loop.in_words(*found)}: to first order these stay wherever they are, and do not return by themselves"
        )


def refuse_neutral(loop: SampledLoop, names: list[str], returns: Array) -> None:
    """Raises UserError where a combination of numbers keeps any value. returns: one less the slopes, (count, count)."""
    _, sizes, ways = np.linalg.svd(returns)
    if len(names) and sizes[-1] < NEUTRAL:
        named = loop.in_words(*(names[i] for i in np.argsort(-np.abs(ways[-1]), stable=True)[:3]))
        raise UserError(f"{named}: to first order a combination of these stays wherever it is, and does not return by itself")


def refuse_edge(loop: SampledLoop, names: list[str], bent: NDArray[np.bool_]) -> None:
    """Raises UserError for numbers that a sample leaves on no straight line, however small the deviation."""
    found = [name for name, bends in zip(names, bent, strict=True) if bends]
    if found:
        named = loop.in_words(*found)
        raise UserError(f"{named} have no slopes: the loop rests exactly on an edge of the law (a limit, a sign, a `where`)")


def reduced(loop: SampledLoop, at: RestingLoop) -> RestingLoop:
    """The places without the first number of the vehicle's quaternion, which the plant normalises at every step."""
    names = loop.names
    if not isinstance(loop.loop.plant, Multirotor) or QUATERNION not in names:
        return at
    unit = names.index(QUATERNION)
    others = [unit + 1, unit + 2, unit + 3]
    if not {unit, *others} <= set(at.live):
        return at
    state, slopes, row = at.state.copy(), at.slopes.copy(), at.live.index(unit)
    state[unit] = np.sqrt(1.0 - np.square(state[others]).sum())
    for place in others:
        slopes[:, at.live.index(place)] -= slopes[:, row] * state[place] / state[unit]
    slopes = np.delete(np.delete(slopes, row, 0), row, 1)
    return at._replace(state=state, live=tuple(place for place in at.live if place != unit), unit=unit, slopes=slopes)


def equal_places(numbers: Sequence[object]) -> dict[int, int]:
    """Places of numbers that are always equal to an earlier one, and its place."""
    first: dict[int, int] = {}
    found = {}
    for place, number in enumerate(numbers):
        earlier = first.setdefault(id(number), place)
        if earlier != place and isinstance(number, Enclosure):
            found[place] = earlier
    return found

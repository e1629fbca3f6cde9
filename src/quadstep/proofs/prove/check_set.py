"""An independent check that no flight leaves the set of a certificate: it shares the laws and the enclosure arithmetic
with the prover, nothing else.

The set is mapped through one sample at all ticks but the first, its starts through the first. The image, e' = V z', is
decomposed by an approximate inverse of V, in extended precision, each rounding counted, and z' must lie in the set again.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple, cast

import numpy as np

from quadstep.io.documents import parse_toml
from quadstep.io.errors import UserError
from quadstep.mission.read import check_mission, plan_mission
from quadstep.numbers import flatten
from quadstep.numbers.affine import MOST_SUMMED, UP
from quadstep.numbers.enclosure import ENCLOSURES, Array, Enclosure, Fresh, Operand, UndefinedError
from quadstep.proofs.prove.certificate_file import SetCertificate, read_set
from quadstep.proofs.prove.check_loop import CONSTANTS, PUSHES, STARTS, CheckedLoop, all_finite, moved, number, pushed
from quadstep.proofs.prove.unknown import Unknown
from quadstep.vehicle.multirotor import Multirotor

LONGEST = 1e6
"""Time up to which clocks are followed [s]."""

UNKNOWNS = PUSHES + CONSTANTS


class CheckedSet(NamedTuple):
    """failed: what does not hold, empty if all does. begun: the middle of the starts [m]. position: how far each axis may be
    from its rest [m].
    """

    name: str
    axes: tuple[str, ...]
    unknown: Unknown
    failed: str
    start: float
    own: bool
    begun: Array
    position: Array
    seconds: float


class CheckedImage(NamedTuple):
    """The image of the moving states: centre less the rest, the part of each direction, and the remainder."""

    gap: Array
    parts: Array
    left: Array


def start_states(loop: CheckedLoop, proof: SetCertificate) -> list[Operand]:
    """All states of the loop at the start: the mission's, or as at rest, off them by as much as is unknown."""
    if proof.own:
        return [loop.begun[place] for place in loop.places]
    leaves: list[Operand] = [*loop.start]
    for place, value in zip(loop.places, proof.rest.tolist(), strict=True):
        leaves[place] = value
    body = len(flatten(loop.plan.start))
    leaves[:body] = moved(loop.plan, cast(list[float], leaves[:body]), starts_of(proof))
    return [leaves[place] for place in loop.places]


def starts_of(proof: SetCertificate) -> Unknown:
    return proof.unknown._replace(start=proof.start)


def with_room(one: Operand, directions: int) -> Enclosure:
    """The same number with more directions."""
    if not isinstance(one, Enclosure):
        return number(np.ravel(one).astype(np.float64), np.zeros(1), directions)
    if one.parts is None:
        return one
    parts = np.concatenate([one.parts, np.zeros((directions - len(one.parts), 1))])
    return Enclosure(one.centre, parts, one.rest, one.reach, None, one.floor)


def box(proof: SetCertificate, width: Array, second: int, directions: int) -> list[Operand]:
    """All states of the loop: the moving ones fill rest + width e, the others are as at rest, or equal to another.

    Raises UserError.
    """
    fresh = Fresh(directions, directions, second)
    numbers: list[Operand] = [float(one) for one in proof.rest]
    for i, place in enumerate(proof.live):
        numbers[place] = number(np.array([proof.rest[place]]), width[i], directions, fresh)
    for place, other in proof.twins.items():
        numbers[place] = numbers[other]
    if proof.unit >= 0:  # of a quaternion of length one, up to rounding
        x, y, z = numbers[proof.unit + 1 : proof.unit + 4]
        square = 1.0 - (x * x + y * y + z * z)
        if not isinstance(square, Enclosure):
            raise UserError("its attitude does not move")
        w = ENCLOSURES.sqrt(square)
        off = w.rest + 1e-14
        numbers[proof.unit] = Enclosure(w.centre, w.parts, off, w.reach + 1e-14, w.fresh)
    return numbers


def mapped_image(
    loop: CheckedLoop, proof: SetCertificate, numbers: list[Operand], ticks: Operand, directions: int
) -> CheckedImage:
    """The image one sample later. Raises UndefinedError, UserError."""
    p = pushed(loop.plan.parameters, proof.unknown, directions - UNKNOWNS, directions, 1)
    after = loop.after(numbers, ticks, p)
    for place in range(len(proof.states)):
        other = proof.twins.get(place)
        if place == proof.unit:
            first = after[place]
            if not isinstance(first, Enclosure) or not first.low[0] > 0.5:
                raise UndefinedError("the attitude may turn by more than 120 degrees")
        elif place not in proof.live:
            constant = isinstance(after[place], float) and after[place] == proof.rest[place]
            if not (constant if other is None else after[place] is after[other]):
                raise UserError(f"{proof.states[place]} does not stay as the certificate says")
    gap, left = np.zeros(len(proof.live)), np.zeros(len(proof.live))
    parts = np.zeros((len(proof.live), directions))
    for i, place in enumerate(proof.live):
        one = after[place]
        if isinstance(one, float):  # as the law writes it, whatever it was
            one = number(np.array([one]), np.zeros(1), 1)
        if not isinstance(one, Enclosure):
            raise UserError(f"the loop does not return {proof.states[place]} as a state")
        gap[i] = one.centre[0] - proof.rest[place]
        left[i] = one.rest[0] + abs(gap[i]) * 2.0**-50
        if one.parts is not None:
            parts[i, : len(one.parts)] = one.parts[:, 0]
    all_finite(gap, parts, left)
    return CheckedImage(gap, parts, left)


class Discs:
    """The set's coordinates as numbers w: a real number for an interval, a complex one and its conjugate for a disc."""

    def __init__(self, proof: SetCertificate) -> None:
        count = len(proof.radii)
        self.apart = np.eye(count, dtype=np.clongdouble)  # z = apart w
        joined = np.eye(count, dtype=np.clongdouble)
        self.radii = proof.radii.astype(np.longdouble)
        for i in proof.pairs:
            self.apart[i : i + 2, i : i + 2] = np.array([[1, 1], [1j, -1j]]) / 2
            joined[i : i + 2, i : i + 2] = [[1, -1j], [1, 1j]]
            self.radii[i : i + 2] = min(proof.radii[i : i + 2])
        self.unit = 8.0 * (count + 8) * np.finfo(np.longdouble).eps
        self.spread = proof.spread.astype(np.longdouble) @ self.apart
        self.into = joined @ np.linalg.inv(proof.spread).astype(np.longdouble)
        off = np.abs(np.eye(count) - self.into @ self.spread)
        self.off = off + self.unit * (np.abs(self.into) @ np.abs(self.spread))

    def reached(self, image: CheckedImage, first: int, second: bool) -> Array:
        """Bounds of |w| after the sample. first: whether the directions are those of the set, else of a box."""
        size, count = np.abs(self.into), len(self.radii)
        seen = self.into @ image.parts.astype(np.longdouble)
        bound = np.abs(self.into @ image.gap.astype(np.longdouble)) + size @ image.left
        bound += 2.0 * self.unit * (size @ (np.abs(image.parts).sum(axis=1) + np.abs(image.gap)))
        if not second:
            return np.asarray(bound + np.abs(seen).sum(axis=1))
        bound += np.abs(seen[:, :first] @ self.apart).sum(axis=1) + np.abs(seen[:, first + first * first :]).sum(axis=1)
        for i in range(count):
            square = seen[i, first : first + first * first].reshape(first, first)
            bound[i] += np.abs(self.apart.T @ ((square + square.T) / 2) @ self.apart).sum()
        return np.asarray(bound)


def failing(loop: CheckedLoop, proof: SetCertificate) -> str:
    """What is not shown, in words; empty if everything is. Raises UserError."""
    count = len(proof.live)
    try:
        discs = Discs(proof)
    except np.linalg.LinAlgError:
        return "its coordinates depend on each other"
    axes = len(loop.plan.loop.plant.axes)
    middle = 0.5 * (LONGEST / loop.plan.ticks.step + loop.span)
    away = np.array([middle - loop.span])
    later = Enclosure(np.array([middle]), None, away, away)
    directions = count + count * count + UNKNOWNS
    if directions > MOST_SUMMED:
        return f"{count} moving states have more pairs than the rounding of a sum is bounded for"
    radii = np.asarray(discs.radii, dtype=np.float64)
    try:
        numbers = box(proof, proof.spread * radii, count, directions)
        kept = discs.reached(mapped_image(loop, proof, numbers, later, directions), count, second=True)
        moving = {*proof.live, *proof.twins, proof.unit}
        numbers = [
            with_room(one, STARTS + UNKNOWNS) if i in moving else one for i, one in enumerate(start_states(loop, proof))
        ]
        first = discs.reached(mapped_image(loop, proof, numbers, np.array([0.0]), STARTS + UNKNOWNS), STARTS, second=False)
    except UndefinedError as error:
        return f"nothing bounds a sample over the set: {error}"
    astray = discs.off @ discs.radii
    for what, bound in (("a flight in the set", kept), ("a start", first)):
        inside = (bound + astray) * UP <= discs.radii  # false for NaN
        if not np.all(inside):
            return f"{what} is not shown to be in the set a sample later (coordinate {int(np.argmin(inside)) + 1} of {count})"
    reach = np.abs(discs.spread) @ discs.radii * UP
    if not np.all(reach[[proof.live.index(axis) for axis in range(axes)]] <= proof.position):
        return "the set is larger than the file claims"
    return ""


def check_set(path: Path) -> CheckedSet:
    """Whether the claim of the certificate in `path` holds. Raises UserError if it contains nothing that can be checked."""
    found = read_set(path)
    folder = path.parent / found.folder
    mission = check_mission(parse_toml(found.mission, str(path)), str(path), folder)
    plan = plan_mission(mission, path, folder)
    axes = plan.loop.plant.axes
    try:
        if found.states[: len(axes)] != tuple(f"position.{i}" for i in range(len(axes))) or len(found.position) != len(axes):
            raise UserError("its first states are not the position")  # noqa: TRY301 (one message for all)
        if set(range(len(axes))) - set(found.live):
            raise UserError("its position does not move")  # noqa: TRY301
        loop = CheckedLoop(plan, found.states, starts_of(found))
        if found.unit >= 0 and not isinstance(plan.loop.plant, Multirotor):
            raise UserError("its attitude is not a unit quaternion")  # noqa: TRY301
        with np.errstate(all="ignore"):  # what is not finite fails
            failed = failing(loop, found)
    except (UserError, UndefinedError) as error:
        raise UserError(f"{path}: {error}") from None
    place = np.array(loop.start[: len(axes)]) if found.own else found.rest[: len(axes)]
    seconds = loop.span * plan.ticks.step
    return CheckedSet(mission.name, tuple(axes), found.unknown, failed, found.start, found.own, place, found.position, seconds)

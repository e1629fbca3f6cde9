"""The unknowns of a flight, and boxes of states as enclosures: whatever is proved holds for all of their values.

All that lives at the start of a flight, over all starts, too: memories, delay lines and estimates move with it.
Images of a law are arrays; products of matrices have bounds on their rounding.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, TypeAlias, cast

import numpy as np

from quadstep.engines.fly import FlightPlan
from quadstep.engines.loop import Loop, Numbers
from quadstep.io.errors import UserError
from quadstep.numbers import Number, Structure, Vector, flatten, leaf_names, rebuild
from quadstep.numbers.affine import HALF_UNIT, UP
from quadstep.numbers.enclosure import Array, Enclosure, Fresh, Operand, ball
from quadstep.numbers.rotations import from_rotation_vector, multiply
from quadstep.vehicle.lagrange import Parameters
from quadstep.vehicle.multirotor import Multirotor
from quadstep.vehicle.paper import Disturbance


def sum_rounding(count: int) -> float:
    """Bound on a sum's rounding for `count` products, relative to their sizes, in any order (Higham 2002, section 3.5)."""
    return count * HALF_UNIT / (1.0 - count * HALF_UNIT) * UP


def summed(count: int) -> float:
    """More than a sum of so many products of positive numbers loses by rounding, relative to itself."""
    return UP * (1.0 + sum_rounding(count + 2))


class BoundedMatrix(NamedTuple):
    """Matrices, and bounds on their distance from the exact ones, entry by entry; with the same leading axes."""

    middle: Array
    off: Array

    def times(self, other: BoundedMatrix) -> BoundedMatrix:
        size = np.abs(self.middle)
        rounded = sum_rounding(self.middle.shape[-1] + 2) * (size @ np.abs(other.middle))
        off = (rounded + size @ other.off + self.off @ (np.abs(other.middle) + other.off)) * UP
        return BoundedMatrix(self.middle @ other.middle, off)

    @property
    def size(self) -> Array:
        """A bound of the entries' magnitudes."""
        return (np.abs(self.middle) + self.off) * UP


def powers(base: BoundedMatrix, count: int) -> BoundedMatrix:
    """base^0 to base^count, stacked."""
    n = len(base.middle)
    now = BoundedMatrix(np.eye(n), np.zeros((n, n)))
    found = [now]
    for _ in range(count):
        now = now.times(base)
        found.append(now)
    return BoundedMatrix(np.stack([one.middle for one in found]), np.stack([one.off for one in found]))


def seeded(centres: Array, spread: Array, spare: int = 0, second: int = 0) -> list[Enclosure]:
    """Numbers that fill a box: centres + spread e, with e in [-1, 1].

    centres: (numbers, samples). spread: (numbers, directions), or (numbers, directions, samples). spare: directions left for
    nonlinear terms; with `second`, for the products of that many first directions and for more, see `Fresh`.
    """
    count, samples = centres.shape
    directions = spread.shape[1]
    parts = np.zeros((count, directions + spare, samples))
    parts[:, :directions] = spread if spread.ndim == 3 else spread[:, :, None]
    reach = np.abs(parts).sum(axis=1) * UP
    fresh = Fresh(directions, directions if second else directions + spare, second) if spare else None
    nothing = np.zeros(samples)
    return [Enclosure(c, p, nothing, r, fresh) for c, p, r in zip(centres, parts, reach, strict=True)]


def widened(number: Enclosure | float, directions: int) -> Enclosure:
    """The same with so many further directions, on which it does not depend."""
    if not isinstance(number, Enclosure) or number.parts is None:
        return number if isinstance(number, Enclosure) else ball(np.array([number]))
    parts = np.concatenate([number.parts, np.zeros((directions, *number.centre.shape))])
    return Enclosure(number.centre, parts, number.rest, number.reach, None, number.floor)


class Image(NamedTuple):
    """A law's image of a box: centre + parts e + rest. Shapes (numbers, samples), of parts (numbers, directions, samples)."""

    centre: Array
    parts: Array
    rest: Array


def image(numbers: Sequence[Operand], directions: int, samples: int) -> Image:
    """The numbers as arrays; directions beyond those asked for count as rest."""
    centre, rest = np.zeros((len(numbers), samples)), np.zeros((len(numbers), samples))
    parts = np.zeros((len(numbers), directions, samples))
    for i, number in enumerate(numbers):
        one = number if isinstance(number, Enclosure) else ball(number)
        centre[i], rest[i] = one.centre, one.rest
        if one.parts is not None:
            parts[i] = one.parts[:directions]
            rest[i] += np.abs(one.parts[directions:]).sum(axis=0) * UP
    return Image(centre, parts, rest)


PUSHES, CONSTANTS = 6, 4


class Unknown(NamedTuple):
    """Bounds. force [N], torque [N m]: per axis, constant from sample to sample, otherwise arbitrary. mass, inertia:
    of the vehicle, constant, relative to the mission's (0.01: within 1 %). start [m], start_velocity [m/s], start_attitude
    [rad], start_rates [rad/s]: of the state at the start, per axis, in the coordinates of the plant's state; a quaternion is
    turned about the vehicle's axes. Whatever else a start determines (memories, delay lines, estimates) moves with it.
    """

    force: float = 0.0
    torque: float = 0.0
    mass: float = 0.0
    inertia: float = 0.0
    start: float = 0.0
    start_velocity: float = 0.0
    start_attitude: float = 0.0
    start_rates: float = 0.0

    @property
    def pushes(self) -> Array:
        """Bounds on the unknowns that may change at every sample: three forces, three torques."""
        return np.array([self.force] * 3 + [self.torque] * 3)

    @property
    def shares(self) -> Array:
        """Bounds on the constant unknowns: mass, three inertias, each as a share."""
        return np.array([self.mass] + [self.inertia] * 3)


LARGEST = Unknown(1e3, 1e3, 0.9, 0.9, start=1e3, start_velocity=1e3, start_attitude=1.0, start_rates=1e3)
"""The largest bounds."""


def refuse_out_of_range(unknown: Unknown, key: str) -> None:
    """Raises UserError for a bound that is negative, too large or not a number. key: its name, with {} for the field's."""
    for name, value, most in zip(Unknown._fields, unknown, LARGEST, strict=True):
        if not 0.0 <= value <= most:
            raise UserError(f"{key.format(name.replace('_', '-'))}: should be from 0 to {most:g}, not {value:g}")


def check_unknown(plan: FlightPlan, unknown: Unknown) -> None:
    """Raises UserError if a plan has no such numbers, or for invalid bounds."""
    refuse_out_of_range(unknown, "--{}")
    given = [name for name, value in zip(Unknown._fields[:4], unknown, strict=False) if value]
    paper = isinstance(plan.parameters, Parameters) and isinstance(plan.parameters.disturbance, Disturbance)
    if given and not paper:
        raise UserError(f"--{given[0]}: supported only on the paper's plant with its own disturbance; leave it out")


def with_unknown(p: Numbers, unknown: Unknown, first: int, total: int, samples: int) -> Numbers:
    """The parameters as enclosures whose directions begin at `first`, of `total`."""

    def number(value: float, radius: float, place: int) -> Number:
        if not radius:
            return value
        parts = np.zeros((total, samples))
        parts[first + place] = radius
        width = np.full(samples, abs(radius))
        return cast(Number, Enclosure(np.full(samples, float(value)), parts, np.zeros(samples), width))

    if not isinstance(p, Parameters) or not any(unknown[:4]):
        return p
    force, torque, shares = unknown.pushes[:3], unknown.pushes[3:], unknown.shares
    before = cast(Disturbance, p.disturbance)
    disturbance = before._replace(
        force=Vector(number(x, r, i) for i, (x, r) in enumerate(zip(before.force, force, strict=True))),
        torque=Vector(number(x, r, 3 + i) for i, (x, r) in enumerate(zip(before.torque, torque, strict=True))),
    )
    inertia = p.vehicle.inertia
    vehicle = p.vehicle._replace(
        mass=number(p.vehicle.mass, shares[0] * p.vehicle.mass, PUSHES),
        inertia=Vector(number(x, r * x, PUSHES + 1 + i) for i, (x, r) in enumerate(zip(inertia, shares[1:], strict=True))),
    )
    return p._replace(disturbance=disturbance, vehicle=vehicle)


Leaf: TypeAlias = Enclosure | float

NAMES = {
    "start": ("position",),
    "start_velocity": ("velocity",),
    "start_attitude": ("attitude", "pitch"),
    "start_rates": ("rates", "rate"),
}
"""What plants call the parts of their states that an `Unknown` bounds."""

STARTS = 3 * len(NAMES)
"""Directions of a start."""


def displaced(state: Structure, values: Sequence[float], loop: Loop, unknown: Unknown) -> list[Leaf]:
    """The leaves of a plant's state, off these values by as much as is unknown. Raises UserError for a plant without one."""
    found: list[Leaf] = list(values)
    names = leaf_names(state)
    for part, (field, called) in enumerate(NAMES.items()):
        radius = float(getattr(unknown, field))
        places = [i for i, name in enumerate(names) if name.partition(".")[0] in called]
        turned = field == "start_attitude" and isinstance(loop.plant, Multirotor)
        if not radius:
            continue
        if not 0 < len(places) <= 3 and not turned:
            option = field.replace("_", "-")
            raise UserError(
                f"--{option}: this plant's state has no {' or '.join(f'`{name}`' for name in called)} of 1 to 3 numbers"
            )
        size = min(3, len(places))
        spread = np.zeros((size, STARTS))
        spread[range(size), range(3 * part, 3 * part + size)] = radius
        middle = np.zeros(3) if turned else np.array([values[i] for i in places])
        moved: Sequence[Enclosure] = seeded(middle[:, None], spread)
        if turned:
            moved = multiply(Vector([values[i] for i in places]), from_rotation_vector(Vector(moved)))  # type: ignore[arg-type, assignment]
        for place, number in zip(places, moved, strict=True):
            found[place] = number
    return found


def started(loop: Loop, start: tuple[Structure, ...], parameters: Numbers, unknown: Unknown) -> list[Leaf]:
    """All leaves of the cycle before the first tick, over all starts. Raises UserError, UndefinedError."""
    values = [float(leaf) for leaf in flatten(start)]
    leaves = displaced(start, values, loop, unknown)
    try:
        return flatten(loop.start(rebuild(start, iter(leaves)), parameters))
    except TypeError as error:
        raise UserError(f"controller: nothing can be proved about its memory at the start: {error}") from None

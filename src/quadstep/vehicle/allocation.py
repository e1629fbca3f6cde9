"""Control allocation: the rotor speeds for a commanded thrust and torque, and what can be achieved at the rotors' limits.

Within the limits the rotor thrusts are those of least norm, by the pseudo-inverse of the map from rotor thrusts to thrust and
torque. At the limits thrust and tilt (the torques about body x and y) come first: they hold the vehicle up and on its path.

1. The yaw torque is scaled down until every rotor fits.
2. If the tilt torque does not fit even without yaw, the thrust is shifted to the nearest one at which it does; the yaw torque
   gets what is left.
3. If it fits at no thrust, it is scaled down, both axes alike, until it does.

Nothing changes its sign or grows, and no step takes more than it needs (step 3 may take a little more where rotors share the
thrust unevenly). The order is that of Faessler, Falanga and Scaramuzza, "Thrust mixing, saturation, and body-rate control for
accurate aggressive quadrotor flight" (2017), carried from four rotors to any number by scaling along columns of the
pseudo-inverse; its reason is in Brescianini and D'Andrea, "Tilt-prioritized quadrocopter attitude control" (2018).
With more than four rotors other thrusts than those of least norm may reach a little farther; they are not searched for.
"""

from collections.abc import Sequence
from functools import partial
from typing import NamedTuple, TypeAlias

from quadstep.numbers import Matrix, Number, Vector, absolute, largest, maximum, minimum, smallest, sqrt, total, vector, where
from quadstep.numbers.kinds import Condition
from quadstep.numbers.rotations import cross
from quadstep.numbers.scan import shortcut
from quadstep.numbers.solve import least_norm_inverse
from quadstep.numbers.solve import rank as rank_of
from quadstep.vehicle.rigid_body import Geometry
from quadstep.vehicle.rotor import RotorParameters

NONE = 1e-30
"""Added to a divisor that may be zero where its quotient is not used: lost beside any thrust or torque."""


class Allocation(NamedTuple):
    """How thrust and torque are shared among the rotors.

    matrix: a row for each rotor, whose thrust is row @ (u, tau_x, tau_y, tau_z) [N]. least, most: thrust of one rotor [N].
    thrust [N s^2]: k_f, thrust over speed squared.
    """

    matrix: tuple[Vector, ...]
    least: Number
    most: Number
    thrust: Number


def columns(geometry: Geometry, moment: Number) -> list[Vector]:
    """Thrust and torque from one newton of each rotor: (u [N], tau_x, tau_y, tau_z [N m]) about the body's origin.

    moment: torque per thrust k_m / k_f [m]. u is the part along body z; a rotor with a tilted axis also pushes sideways.
    """
    result = []
    for mount in geometry.mounts:
        axis = Vector(mount.axis)
        result.append(Vector((axis[2], *(cross(Vector(mount.position), axis) - (mount.spin * moment) * axis))))
    return result


def mixing(geometry: Geometry, moment: Number) -> tuple[Vector, ...]:
    """The same as `columns`, as four rows: thrust and the torques about x, y and z from one newton of each rotor."""
    return Matrix(columns(geometry, moment)).T.rows


def mix(geometry: Geometry, moment: Number, thrusts: Vector) -> tuple[Number, Vector]:
    """(u [N], torque about the body's axes [N m]) that rotor thrusts [N] produce; moment: k_m / k_f [m]."""
    pairs = zip(columns(geometry, moment), thrusts, strict=True)
    thrust, *torque = total(thrust * column for column, thrust in pairs)
    return thrust, Vector(torque)


def rank(geometry: Geometry, moment: float) -> int:
    """How many of thrust, roll, pitch and yaw the rotors can make independently of each other: 4 for a vehicle that flies."""
    return rank_of(mixing(geometry, moment), 1e-6)


def allocation(geometry: Geometry, rotor: RotorParameters) -> Allocation:
    """The shares of least norm for these rotors. Needs the rank to be 4."""
    return Allocation(
        matrix=tuple(least_norm_inverse(mixing(geometry, rotor.torque / rotor.thrust))),
        least=rotor.thrust * rotor.slowest * rotor.slowest,
        most=rotor.thrust * rotor.fastest * rotor.fastest,
        thrust=rotor.thrust,
    )


def allocate(geometry: Geometry, allocation: Allocation, thrust: Number, torque: Vector) -> tuple[Vector, Number, Vector]:
    """Rotor speeds [rad/s] for a commanded thrust [N] and torque about body axes [N m], and the thrust and torque produced.

    These are the commanded ones unless a rotor is at a limit; see the module. Every rotor must carry part of the thrust.
    """
    alike, asked = shares_evenly(geometry), (thrust, torque, allocation)
    return shortcut(asked, plain, partial(within_limits, alike)) if alike else within_limits(alike, asked)


Asked: TypeAlias = tuple[Number, Vector, Allocation]
"""Thrust [N] and torque [N m], and how they are shared."""

Made: TypeAlias = tuple[Vector, Number, Vector]
"""Rotor speeds [rad/s], thrust [N] and torque [N m]."""


def plain(asked: Asked) -> tuple[Condition, Made]:
    """What rotors that share the thrust evenly make where all of them are away from their limits by more than rounding."""
    thrust, torque, allocation = asked
    roll, pitch, yaw = torque
    bases = [thrust * share[0] + (share[1] * roll + share[2] * pitch) for share in allocation.matrix]
    turn = [share[3] * yaw for share in allocation.matrix]
    lowest = smallest(base - absolute(part) for base, part in zip(bases, turn, strict=True))
    highest = largest(base + absolute(part) for base, part in zip(bases, turn, strict=True))
    clear = 1e-3 * allocation.most
    holds = (lowest > allocation.least + clear) & (highest < allocation.most - clear)
    thrusts = [base + part for base, part in zip(bases, turn, strict=True)]
    return holds, (spun(allocation, thrusts), thrust, torque)


def within_limits(alike: bool, asked: Asked) -> Made:
    """The same at any limits. alike: whether rotors share the thrust evenly."""
    thrust, torque, allocation = asked
    roll, pitch, yaw = torque
    least, most = allocation.least, allocation.most
    lift = [share[0] for share in allocation.matrix]
    per_lift = [1.0 / part for part in lift]
    tilt = [share[1] * roll + share[2] * pitch for share in allocation.matrix]
    slopes = [part * inverse for part, inverse in zip(tilt, per_lift, strict=True)]  # thrust that makes up for the tilt
    bottoms, tops = [least * inverse for inverse in per_lift], [most * inverse for inverse in per_lift]

    bottom, top = largest(bottoms), smallest(tops)
    tilt_kept = share_within(largest(slopes) - smallest(slopes), top - bottom, absolute(top - bottom))
    if not alike:
        level = clamped(thrust, bottom, top)
        tilt_kept = maximum(tilt_kept, fitting_all(tilt, [level * part for part in lift], least, most))

    bottom = largest(low - tilt_kept * slope for low, slope in zip(bottoms, slopes, strict=True))
    top = smallest(high - tilt_kept * slope for high, slope in zip(tops, slopes, strict=True))
    lifted = clamped(thrust, bottom, top)
    carried = [lifted * part + tilt_kept * leaning for part, leaning in zip(lift, tilt, strict=True)]

    turn = [share[3] * yaw for share in allocation.matrix]
    yaw_kept = fitting_all(turn, carried, least, most)
    thrusts = [clamped(base + yaw_kept * part, least, most) for base, part in zip(carried, turn, strict=True)]
    return spun(allocation, thrusts), lifted, vector(tilt_kept * roll, tilt_kept * pitch, yaw_kept * yaw)


def spun(allocation: Allocation, thrusts: Sequence[Number]) -> Vector:
    """Rotor speeds [rad/s] for thrusts [N] of at least 0."""
    per_thrust = 1.0 / allocation.thrust
    return Vector(sqrt(one * per_thrust) for one in thrusts)


def thrusts_of(allocation: Allocation, speeds: Vector) -> Vector:
    """The thrust [N] of every rotor at these speeds [rad/s], in still air."""
    return Vector(allocation.thrust * speed * speed for speed in speeds)


def shares_evenly(geometry: Geometry) -> bool:
    """Whether a thrust without torque is shared evenly by all rotors, whatever their coefficients."""
    axes = [Vector(mount.axis) for mount in geometry.mounts]
    levers = total(cross(Vector(mount.position), axis) for mount, axis in zip(geometry.mounts, axes, strict=True))
    spins = total(mount.spin * axis for mount, axis in zip(geometry.mounts, axes, strict=True))
    upward = [axis[2] for axis in axes]
    return max(upward) - min(upward) < 1e-9 and levers.norm() < 1e-9 and spins.norm() < 1e-9


def largest_fitting_share(part: Number, low: Number, high: Number) -> Number:
    """The largest share in [0, 1] of `part` that stays between `low` and `high`, which lie on either side of zero."""
    up = part > 0.0
    return share_within(absolute(part), where(up, high, -low), where(up, absolute(high), absolute(low)))


def share_within(asked: Number, room: Number, size: Number) -> Number:
    """The largest share in [0, 1] of what is asked for, at least 0, that is no larger than `room`; none where that is below 0.

    size: |room|. The divisor is never below it, so an enclosure has a quotient even where it is not decided which is larger.
    """
    return where(asked > size, maximum(room, 0.0) / maximum(asked, size + NONE), 1.0)


def fitting_all(parts: list[Number], bases: list[Number], low: Number, high: Number) -> Number:
    """The largest share of all `parts` with which every `base + share part` stays between `low` and `high`."""
    return smallest(largest_fitting_share(part, low - base, high - base) for part, base in zip(parts, bases, strict=True))


def clamped(x: Number, low: Number, high: Number) -> Number:
    """`x` held between `low` and `high`; unlike `clip` it propagates NaN."""
    return minimum(high, maximum(low, x))

"""From a wanted force and heading to the attitude that makes it, and how fast that attitude turns."""

from typing import NamedTuple

from quadstep.control.projection import shrink
from quadstep.numbers import Matrix, Number, Vector, clip, cos, sin, sqrt, vector, where
from quadstep.numbers.rotations import cross


class WantedAttitude(NamedTuple):
    """rotation: R_c, body to world, shape (3, 3). rates: Omega_c [rad/s], acceleration: Omega_c_dot [rad/s^2], both in its
    own axes.
    """

    rotation: Matrix
    rates: Vector
    acceleration: Vector


class Direction(NamedTuple):
    """A unit vector with its first and second rate."""

    value: Vector
    rate: Vector
    change: Vector


def direction(v: Vector, rate: Vector, change: Vector) -> Direction:
    """v / |v| and its rates, from those of v; straight up for no force at all."""
    length = v.norm()
    some = length > 1e-6
    over = 1.0 / where(some, length, 1.0)
    unit = Vector(where(some, over * entry, up) for entry, up in zip(v, (0.0, 0.0, 1.0), strict=True))
    growth = unit @ rate
    unit_rate = over * (rate - growth * unit)
    unit_change = over * (change - (2.0 * growth) * unit_rate - (unit @ change + unit_rate @ rate) * unit)
    return Direction(unit, unit_rate, unit_change)


def crossed(a: Direction, b: Direction) -> tuple[Vector, Vector, Vector]:
    """a x b with its first and second rate."""
    bend = cross(a.change, b.value) + 2.0 * cross(a.rate, b.rate) + cross(a.value, b.change)
    return cross(a.value, b.value), cross(a.rate, b.value) + cross(a.value, b.rate), bend


def wanted_attitude(force: Vector, rate: Vector, change: Vector, yaw: Number, yaw_rate: Number) -> WantedAttitude:
    """The attitude whose third axis is along `force` [N] and whose first is nearest the heading `yaw` [rad].

    rate, change: of the force [N/s, N/s^2]. Lee, Leok, McClamroch (2010), Eqs 22 and 23. Undefined for a level force along
    the heading.
    """
    third = direction(force, rate, change)
    s, c = sin(yaw), cos(yaw)
    ahead = Direction(vector(c, s, 0.0), yaw_rate * vector(-s, c, 0.0), -(yaw_rate * yaw_rate) * vector(c, s, 0.0))
    second = direction(*crossed(third, ahead))
    first = Direction(*crossed(second, third))
    axes = (first, second, third)
    rotation = Matrix([axis.value for axis in axes]).T
    # Omega_c from R_c^T R_c_dot = hat(Omega_c); its rate from R_c^T R_c_dd = hat(Omega_c_dot) + hat(Omega_c)^2
    rates = vector(third.value @ second.rate, first.value @ third.rate, second.value @ first.rate)
    p, q, r = rates
    acceleration = vector(
        third.value @ second.change - q * r, first.value @ third.change - p * r, second.value @ first.change - p * q
    )
    return WantedAttitude(rotation, rates, acceleration)


def up_axis(rotation: Matrix) -> Vector:
    """b3, the direction of the thrust in world axes."""
    return Vector(row[2] for row in rotation)


def within(force: Vector, most: Number) -> Vector:
    """The force at a length of at most `most` [N], pointing up; height goes before the way sideways."""
    x, y, z = force
    lift = clip(z, 0.1 * most, 0.95 * most)
    room = sqrt(most * most - lift * lift)
    sideways = shrink(sqrt(x * x + y * y), room)
    return vector(sideways * x, sideways * y, lift)


def tilted_within(force: Vector, most: Number) -> Vector:
    """A force that points up, tilted from the vertical by at most `most` [rad]; its height stays. 1.5 and more: no limit on
    what `within` returns.
    """
    x, y, z = force
    sideways = where(most < 1.5, shrink(sqrt(x * x + y * y), z * sin(most) / cos(most)), 1.0)
    return vector(sideways * x, sideways * y, z)

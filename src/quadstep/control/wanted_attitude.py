"""Which thrust and attitude make a wanted force (kinematic inversion, Eq. 40 to Eq. 52), and what keeps it within bounds."""

from typing import NamedTuple

from quadstep.numbers import Matrix, Number, Vector, atan2, clip, cos, sin, sqrt, vector, where
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


def invert_force(force: Vector) -> tuple[Number, Number, Number]:
    """(u_d [N], theta_d [rad], phi_d [rad]) with u_d (-sin theta_d, cos theta_d sin phi_d, cos theta_d cos phi_d) = force.

    `force` is F_d_hat [N], inertial. Eq. 52 prints atan(f_y / f_z), the wrong branch for f_z < 0; atan2 flies inverted too.
    theta_d lies in [-pi/2, pi/2], phi_d in (-pi, pi]. Where the force leaves an angle free it is zero: phi_d for a force
    along x, both for no force at all.
    """
    f_x, f_y, f_z = force
    b = sqrt(f_y * f_y + f_z * f_z)  # Eq. 45
    u_d = sqrt(f_x * f_x + b * b)  # Eq. 48
    theta_d = where(u_d > 0.0, atan2(-f_x, b), 0.0)  # Eq. 43, Eq. 50
    phi_d = where(b > 0.0, atan2(f_y, f_z), 0.0)  # Eq. 52
    return u_d, theta_d, phi_d


def project(entries: Vector, bound: Number) -> Vector:
    """The nearest vector of length at most `bound`."""
    return shrink(entries.norm(), bound) * entries


def integral_for(part: Vector, gain: Vector, bound: Number) -> Vector:
    """The integral, within its bound, that adds `part` to a law with this gain; 0 along axes whose gain is 0."""
    return project(Vector(where(k > 0.0, one / where(k > 0.0, k, 1.0), 0.0) for one, k in zip(part, gain, strict=True)), bound)


def project_weights(weights: Matrix, bound: Number) -> Matrix:
    """The nearest matrix of Frobenius norm at most `bound`."""
    return shrink(weights.norm(), bound) * weights


def shrink(length: Number, bound: Number) -> Number:
    """The factor, at most 1, that brings `length` down to `bound`."""
    long = length > bound
    return where(long, bound / where(long, length, 1.0), 1.0)

"""The motion of a rigid body, free of singularities: Newton and Euler on quaternions. Its centre of gravity need not be the
body's origin. The positions of its rotors and the effects to compute are structure: fixed when a flight is compiled.

World axes x, y, z with z up; body axes x forward, y left, z up along the thrust; both right-handed.

Legs on level ground are springs and dampers under the rotors, with friction, so that a vehicle stands, takes off and lands.
Each foot is pushed up by k d - c v while it is d below the ground, never pulled, and held back by friction of at most mu times
that, in proportion to its speed where it hardly slides (regularised Coulomb friction).
"""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

from quadstep.numbers import Matrix, Number, Vector, matrix, maximum, solve_symmetric, sqrt, vector, where
from quadstep.numbers.rotations import cross, quaternion_rate


@dataclass(frozen=True)
class Mount:
    """A rotor's mount: position of its hub [m], and axis, the unit vector along which it pushes; body axes.

    spin: +1 turns counter-clockwise seen against its axis (right-handed about it), -1 clockwise; the reaction is opposite.
    """

    position: tuple[float, float, float]
    axis: tuple[float, float, float]
    spin: int

    @cached_property
    def frame(self) -> Matrix:
        """The rotor's own axes as rows, its axis last: frame @ body = rotor. The unit matrix for a rotor that pushes along
        z.
        """
        x, y, z = self.axis
        flat = vector(y, z).norm()
        if flat > 0.5:  # the first in the plane of the axis and body x
            return matrix((flat, -x * y / flat, -x * z / flat), (0.0, z / flat, -y / flat), (x, y, z))
        flat = vector(x, z).norm()
        return matrix((z / flat, 0.0, -x / flat), (-x * y / flat, flat, -y * z / flat), (x, y, z))


@dataclass(frozen=True)
class Geometry:
    """The rotors, four to eight of them, in order."""

    mounts: tuple[Mount, ...]


@dataclass(frozen=True)
class Effects:
    """battery: sag. ground: its cushion. gyroscopic: torques of turning and accelerating rotors. drag: of body and rotors."""

    battery: bool = False
    ground: bool = False
    gyroscopic: bool = True
    drag: bool = True


class Motion(NamedTuple):
    """position [m] and velocity [m/s]: world, of the body's origin. attitude: unit quaternion (w, x, y, z), body to world.

    rates: (p, q, r), of the body about its own axes [rad/s].
    """

    position: Vector
    velocity: Vector
    attitude: Vector
    rates: Vector


class AirframeState(NamedTuple):
    """Everything that is integrated: the motion, each rotor's speed [rad/s], and the charge drawn from the battery [C]."""

    position: Vector
    velocity: Vector
    attitude: Vector
    rates: Vector
    speeds: Vector
    charge: Number

    @property
    def motion(self) -> Motion:
        return Motion(self.position, self.velocity, self.attitude, self.rates)


class MassProperties(NamedTuple):
    """mass [kg]. offset: centre of gravity in body axes [m]. inertia: about it, shape (3, 3) [kg m^2]."""

    mass: Number
    offset: Vector
    inertia: Matrix


def motion_rate(
    properties: MassProperties, rotation: Matrix, motion: Motion, force: Vector, torque: Vector, spin: Vector, gravity: Number
) -> Motion:
    """Rate of the motion under a force [N] and a torque about the body's origin [N m], both in body axes, and gravity [m/s^2].

    rotation: R of the motion's attitude. spin: the rotors' angular momentum relative to the body [N m s], body axes; torque
    includes the effect of its rate.

    With c the centre of gravity and I the inertia about it: I alpha = torque - c x force - omega x (I omega + spin), and the
    origin's acceleration is that of the centre, force / m + g, less alpha x c + omega x (omega x c).
    """
    c, inertia, rates = properties.offset, properties.inertia, motion.rates
    alpha = solve_symmetric(inertia, torque - cross(c, force) - cross(rates, inertia @ rates + spin))
    felt = force * (1.0 / properties.mass) - (cross(alpha, c) + cross(rates, cross(rates, c)))
    x, y, z = rotation @ felt
    return Motion(motion.velocity, Vector((x, y, z - gravity)), quaternion_rate(motion.attitude, rates), alpha)


def renormalised(state: AirframeState) -> AirframeState:
    """The state with its quaternion normalised; integration changes its length a little."""
    length = state.attitude.norm()  # zero only where a diverging one has overflowed
    return state._replace(attitude=state.attitude * (1.0 / where(length > 0.0, length, 1.0)))


SAG = 0.005
"""How far the legs give under the weight [m]."""

DAMPING, FRICTION = 0.7, 0.6
"""Of bouncing on them, as a ratio; mu."""

CREEP = 0.05
"""The sideways speed at which friction is near its most [m/s]."""


class Contact(NamedTuple):
    """legs: from the body's origin down to the feet [m]. stiffness [N/m], damping [N s/m]: of a foot. friction: mu."""

    legs: Number
    stiffness: Number
    damping: Number
    friction: Number


def contact(legs: float, mass: float, gravity: float, feet: int) -> Contact:
    """Legs that fit a vehicle. legs: their length [m]; feet: as many as rotors."""
    stiffness = mass * gravity / (SAG * feet)
    return Contact(legs, stiffness, 2.0 * DAMPING * math.sqrt(stiffness * mass / feet), FRICTION)


def ground_loads(
    legs: Contact, geometry: Geometry, ground: Number, rotation: Matrix, state: AirframeState
) -> tuple[Vector, Vector]:
    """Force [N] and torque about the body's origin [N m] on the feet, body axes. ground: its height [m]."""
    force, torque = vector(0.0, 0.0, 0.0), vector(0.0, 0.0, 0.0)
    for mount in geometry.mounts:
        foot = vector(mount.position[0], mount.position[1], -legs.legs)
        depth = ground - state.position[2] - rotation.rows[2] @ foot
        x, y, z = state.velocity + rotation @ cross(state.rates, foot)
        push = where(depth > 0.0, maximum(legs.stiffness * depth - legs.damping * z, 0.0), 0.0)
        held = legs.friction * push / sqrt(x * x + y * y + CREEP * CREEP)
        each = rotation.T @ vector(-held * x, -held * y, push)
        force, torque = force + each, torque + cross(foot, each)
    return force, torque

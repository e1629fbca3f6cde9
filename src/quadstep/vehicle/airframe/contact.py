"""Legs on level ground: springs and dampers under the rotors, with friction, so that a vehicle stands, takes off and lands.

Each foot is pushed up by k d - c v while it is d below the ground, never pulled, and held back by friction of at most mu times
that, in proportion to its speed where it hardly slides (regularised Coulomb friction).
"""

import math
from typing import NamedTuple

from quadstep.numbers import Matrix, Number, Vector, maximum, sqrt, vector, where
from quadstep.numbers.rotations import cross
from quadstep.vehicle.airframe.geometry import Geometry
from quadstep.vehicle.airframe.motion import AirframeState

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

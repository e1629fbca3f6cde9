"""The motion of a rigid body, free of singularities.

World axes x, y, z with z up; body axes x forward, y left, z up along the thrust; both right-handed.
"""

from typing import NamedTuple

from quadstep.numbers import Number, Vector


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
        """The rigid body alone."""
        return Motion(self.position, self.velocity, self.attitude, self.rates)

"""A rigid body in NumPy with ideal, undelayed thrust and torques, to check laws of real vehicles against."""

import numpy as np
from scipy.spatial.transform import Rotation

from quadstep.interfaces.controller import Measured
from tests.flights import column

GRAVITY = 9.81


def turn(quaternion):
    """The rotation of an attitude of the laws."""
    return Rotation.from_quat(np.roll([float(one) for one in quaternion], -1))


def quaternion(rotation):
    """The attitude of a rotation as the laws have it, w first."""
    return column(np.roll(rotation.as_quat(), 1))


def told(x, thrust=0.0, torque=(0.0, 0.0, 0.0)):
    """What a law is told of a state: position, velocity, rotation vector, body rates, shape (12,)."""
    attitude = quaternion(Rotation.from_rotvec(x[6:9]))
    return Measured(column(x[:3]), column(x[3:6]), attitude, column(x[9:]), float(thrust), column(torque))


def accelerations(x, thrust, torque, mass, inertia, push=(0.0, 0.0, 0.0), twist=(0.0, 0.0, 0.0)):
    """Of the place, world axes, and of the body rates. push [N], world; twist [N m], body."""
    rotation, rates, inertia = Rotation.from_rotvec(x[6:9]).as_matrix(), x[9:], np.asarray(inertia)
    linear = rotation[:, 2] * thrust / mass - [0.0, 0.0, GRAVITY] + np.asarray(push) / mass
    angular = (np.asarray(torque) + twist - np.cross(rates, inertia * rates)) / inertia
    return linear, angular


def moved(x, linear, angular, h):
    """The state h [s] later under fixed accelerations, to second order; h may be negative."""
    spin = x[9:] + 0.5 * h * angular
    turned = Rotation.from_rotvec(x[6:9]) * Rotation.from_rotvec(h * spin)
    return np.concatenate(
        [x[:3] + h * x[3:6] + 0.5 * h * h * linear, x[3:6] + h * linear, turned.as_rotvec(), x[9:] + h * angular]
    )


def linearised(command, mass, inertia, at=None, h=1e-5):
    """Jacobian of the closed loop about hover, shape (12, 12). command(measured) -> thrust, torque; at: the state.

    Of states near a turn about z alone: there the rotation vector's rate is the body rates' turned into the world.
    """
    at = np.zeros(12) if at is None else at

    def rate(offset):
        x = at.copy()
        x[:6] += offset[:6]
        x[6:9] = (Rotation.from_rotvec(at[6:9]) * Rotation.from_rotvec(offset[6:9])).as_rotvec()
        x[9:] += offset[9:]
        thrust, torque = command(told(x, mass * GRAVITY))
        linear, angular = accelerations(x, float(thrust), np.array(list(torque), float), mass, inertia)
        return np.concatenate([x[3:6], linear, x[9:], angular])

    return np.array([(rate(h * unit) - rate(-h * unit)) / (2.0 * h) for unit in np.eye(12)]).T

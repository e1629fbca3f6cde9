"""Newton and Euler on quaternions: a rigid body whose centre of gravity need not be the body's origin."""

from typing import NamedTuple

from quadstep.numbers import Matrix, Number, Vector, solve_symmetric, where
from quadstep.numbers.rotations import cross, quaternion_rate
from quadstep.vehicle.airframe.motion import AirframeState, Motion


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

"""Thrust with its first rate as states of the controller, so that snap can be commanded: position is then a chain of four
integrators in each axis, by a change of inputs that is exact wherever there is thrust.

Mistler, Benallegue, M'Sirdi (2001), the paper's [20]; Mahony, Hamel, Dzul (1999), its [26].
"""

from typing import NamedTuple, Protocol

from quadstep.control.vectoring import torque_for
from quadstep.control.wanted_attitude import up_axis, wanted_attitude
from quadstep.interfaces.controller import Measured
from quadstep.interfaces.plant import Body
from quadstep.interfaces.reference import Reference
from quadstep.numbers import Number, Vector, clip, maximum, minimum, vector, where
from quadstep.numbers.rotations import rotation_matrix

LEAST, MOST = 0.2, 0.95
"""Specific thrust held between these shares of gravity and of what a position loop may ask for."""


class Push(NamedTuple):
    """value [m/s^2]: specific thrust u / m. rate [m/s^3]: of the value."""

    value: Number
    rate: Number


class ThrustMotion(NamedTuple):
    """Third axis of the body, and the specific force that the thrust makes [m/s^2] with its rate [m/s^3]; world axes."""

    axis: Vector
    force: Vector
    force_rate: Vector


class Extended(Body, Protocol):
    """Gains of a law that drives the thrust's rate: what it believes of the vehicle, and those of the heading."""

    @property
    def most_thrust(self) -> Number: ...
    @property
    def heading(self) -> Number: ...
    @property
    def turning(self) -> Number: ...


class Driving(NamedTuple):
    """Thrust [N] and torque [N m] now, and the extended thrust one period later."""

    thrust: Number
    torque: Vector
    push: Push


class Inputs(NamedTuple):
    """Second rate of the specific thrust [m/s^4]; angular acceleration about body x and y [rad/s^2]."""

    push: Number
    about_x: Number
    about_y: Number


def motion(measured: Measured, push: Push) -> ThrustMotion:
    """What the extended thrust does now: d/dt (push b3) = rate b3 + push R (Omega x e3)."""
    rotation, (p, q, _) = rotation_matrix(measured.attitude), measured.rates
    axis = up_axis(rotation)
    return ThrustMotion(axis, push.value * axis, push.rate * axis + push.value * (rotation @ vector(q, -p, 0.0)))


def inputs(measured: Measured, push: Push, snap: Vector) -> Inputs:
    """What gives the specific force this second rate [m/s^4], world axes:

    R^T snap = push_dd e3 + 2 push_d (Omega x e3) + push (Omega (Omega . e3) - |Omega|^2 e3 + Omega_d x e3).
    """
    p, q, r = measured.rates
    along_x, along_y, along_z = rotation_matrix(measured.attitude).T @ snap
    over = 1.0 / push.value
    return Inputs(
        push=along_z + push.value * (p * p + q * q),
        about_x=q * r - over * (along_y + 2.0 * push.rate * p),
        about_y=over * (along_x - 2.0 * push.rate * q) - p * r,
    )


def driven(push: Push, change: Number, gravity: Number, most: Number, period: Number) -> Push:
    """The specific thrust one period [s] later, within its limits; at a limit its rate does not lead beyond it.

    change: its second rate [m/s^4]. most: the largest specific thrust that the rotors can make [m/s^2].
    """
    rate = push.rate + period * change
    free = push.value + period * push.rate + 0.5 * period * period * change
    lower, upper = LEAST * gravity, MOST * most
    held = where(free > upper, minimum(rate, 0.0), where(free < lower, maximum(rate, 0.0), rate))
    return Push(clip(free, lower, upper), held)


def turning(measured: Measured, axis: Vector, reference: Reference, stiffness: Number, damping: Number) -> Number:
    """Angular acceleration about body z [rad/s^2] that turns the heading to the wanted one; the third axis stays."""
    zero = vector(0.0, 0.0, 0.0)
    wanted = wanted_attitude(axis, zero, zero, reference.yaw, 0.0).rotation
    across = rotation_matrix(measured.attitude).T @ wanted
    error = 0.5 * (across[1, 0] - across[0, 1])
    return stiffness * error + damping * (axis[2] * reference.yaw_rate - measured.rates[2])


def driving(push: Push, snap: Vector, measured: Measured, reference: Reference, gains: Extended, period: Number) -> Driving:
    """What a wanted snap [m/s^4] makes of the extended thrust, with the heading turned to the wanted one."""
    asked = inputs(measured, push, snap)
    axis = up_axis(rotation_matrix(measured.attitude))
    around = turning(measured, axis, reference, gains.heading, gains.turning)
    return Driving(
        thrust=gains.mass * push.value,
        torque=torque_for(vector(asked.about_x, asked.about_y, around), measured, gains),
        push=driven(push, asked.push, gains.gravity, gains.most_thrust / gains.mass, period),
    )

"""Linear quadratic regulator about hover: one gain matrix for position, velocity, tilt and turn.

The errors are taken in axes turned by the heading alone, so the same gains serve any heading. Small tilt makes level
acceleration g times tilt, and torque over inertia the angular acceleration (Bouabdallah, Noth, Siegwart 2004).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadstep.control.controller import AirframeLaw, Command, Measured
from quadstep.control.projection import project
from quadstep.guidance.reference import Reference
from quadstep.numbers import Number, Vector, cos, sin, vector
from quadstep.numbers.rotations import (
    conjugate,
    from_yaw_pitch_roll,
    heading,
    multiply,
    rotation_vector,
)

Array = NDArray[np.float64]


class LqrGains(NamedTuple):
    """mass [kg], inertia (diagonal) [kg m^2], gravity [m/s^2]: what the controller believes.

    level: of one level axis, on integral of the position error, position, velocity, tilt and its rate, giving an angular
    acceleration. climb: on integral, position and velocity, giving an acceleration. turn: on heading and its rate.
    integral_bound [m s].
    """

    mass: Number
    inertia: Vector
    gravity: Number
    level: Vector
    climb: Vector
    turn: Vector
    integral_bound: Number


class LqrMemory(NamedTuple):
    """integral: of the position error, world axes [m s]."""

    integral: Vector


def regulator(a: Array, b: Array, q: Sequence[float], r: float) -> Array:
    """Gains K, u = -K x, that minimise the integral of x^T diag(q) x + r u^2 along x' = a x + b u; one input.

    The stable invariant subspace of the Hamiltonian matrix gives the Riccati solution (Potter 1966).
    """
    n = len(a)
    hamiltonian = np.block([[a, -np.outer(b, b) / r], [-np.diag(q), -a.T]])
    values, vectors = np.linalg.eig(hamiltonian)
    stable = vectors[:, np.argsort(values.real)[:n]]
    p = np.real(stable[n:] @ np.linalg.inv(stable[:n]))
    gains: Array = b @ p / r
    return gains


def chain(length: int) -> tuple[Array, Array]:
    """The integrator chain of `length` states: each the rate of the one before it, the input that of the last."""
    return np.diag(np.ones(length - 1), 1), np.eye(length)[-1]


def hover_gains(
    mass: float,
    inertia: Sequence[float],
    gravity: float,
    level: Sequence[float],
    climb: Sequence[float],
    turn: Sequence[float],
    integral_bound: float = 5.0,
) -> LqrGains:
    """Gains about hover. level, climb, turn: weights on the squared states of `LqrGains`, in its order, then on the input."""
    a, b = chain(5)
    a[2, 3] = gravity
    return LqrGains(
        mass=mass,
        inertia=Vector(inertia),
        gravity=gravity,
        level=Vector(regulator(a, b, level[:-1], level[-1]).tolist()),
        climb=Vector(regulator(*chain(3), climb[:-1], climb[-1]).tolist()),
        turn=Vector(regulator(*chain(2), turn[:-1], turn[-1]).tolist()),
        integral_bound=integral_bound,
    )


@dataclass(frozen=True)
class Lqr(AirframeLaw):
    """State feedback at the attitude loop's rate, with the path's acceleration fed forward as thrust and tilt."""

    def start(self, measured: Measured, gains: LqrGains) -> LqrMemory:
        """Nothing integrated."""
        return LqrMemory(vector(0.0, 0.0, 0.0))

    def law(
        self, memory: LqrMemory, measured: Measured, reference: Reference, gains: LqrGains, t: Number, period: Number
    ) -> tuple[Command, LqrMemory]:
        """One sample. Errors are state less wanted state; positive tilt is what accelerates along the axis."""
        yaw = heading(measured.attitude)
        s, c = sin(yaw), cos(yaw)

        def levelled(v: Vector) -> tuple[Number, Number]:
            return c * v[0] + s * v[1], c * v[1] - s * v[0]

        position, velocity = measured.position - reference.position, measured.velocity - reference.velocity
        forward, left = zip(*(levelled(v) for v in (memory.integral, position, velocity, reference.acceleration)), strict=True)
        tilt = rotation_vector(multiply(conjugate(from_yaw_pitch_roll(vector(yaw, 0.0, 0.0))), measured.attitude))
        lean_x = vector(*forward[:3], tilt[1] - forward[3] / gains.gravity, measured.rates[1])
        lean_y = vector(*left[:3], -tilt[0] - left[3] / gains.gravity, -measured.rates[0])
        turned = rotation_vector(
            multiply(
                conjugate(from_yaw_pitch_roll(vector(reference.yaw, 0.0, 0.0))), from_yaw_pitch_roll(vector(yaw, 0.0, 0.0))
            )
        )
        around = -(gains.turn @ vector(turned[2], measured.rates[2] - reference.yaw_rate))
        rising = -(gains.climb @ vector(memory.integral[2], position[2], velocity[2]))
        angular = vector(gains.level @ lean_y, -(gains.level @ lean_x), around)
        command = Command(
            thrust=gains.mass * (gains.gravity + reference.acceleration[2] + rising),
            torque=gains.inertia * angular,
            desired_attitude=vector(reference.yaw, forward[3] / gains.gravity, -left[3] / gains.gravity),
            r1=-position - velocity,
            r2=-measured.rates,
        )
        return command, LqrMemory(project(memory.integral + period * position, gains.integral_bound))

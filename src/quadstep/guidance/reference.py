"""What a path gives the controller at an instant."""

from typing import Any, NamedTuple, Protocol

from quadstep.numbers import Number, Vector, vector


class Reference(NamedTuple):
    """The wanted motion.

    position: xi_d [m]. velocity: xi_d_dot [m/s]. acceleration: xi_d_dd [m/s^2].
    yaw: psi_d [rad], any number of turns. yaw_rate: psi_d_dot [rad/s].
    jerk [m/s^3], snap [m/s^4]: third and fourth rate of the position; zero where a path does not know them.
    """

    position: Vector
    velocity: Vector
    acceleration: Vector
    yaw: Number
    yaw_rate: Number
    jerk: Vector = vector(0.0, 0.0, 0.0)
    snap: Vector = vector(0.0, 0.0, 0.0)


class PathLaw(Protocol):
    """A path as a law over numbers. Its numbers live in `parameters`; the law itself holds only structure."""

    def reference(self, t: Number, parameters: Any) -> Reference:
        """The wanted motion at time t [s] after the start."""
        ...

"""The reference motion that a path gives the controller."""

from typing import Any, NamedTuple, Protocol

from quadstep.numbers import Number, Vector, vector


class Reference(NamedTuple):
    """The reference motion at an instant, in the world frame, z up.

    position: xi_d [m]. velocity: xi_d_dot [m/s]. acceleration: xi_d_dd [m/s^2].
    yaw: psi_d [rad], not wrapped. yaw_rate: psi_d_dot [rad/s].
    jerk [m/s^3], snap [m/s^4]: third and fourth rate of the position; yaw_acceleration: psi_d_dd [rad/s^2]. Zero if a
    path does not provide them. Vectors have length 3. ahead: the reference motion at the times of a controller's `preview`;
    paths leave it empty.

    >>> from quadstep.interfaces.reference import Reference
    >>> from quadstep.numbers import vector
    >>> hover = Reference(vector(0.0, 0.0, 2.0), vector(0.0, 0.0, 0.0), vector(0.0, 0.0, 0.0), yaw=0.0, yaw_rate=0.0)
    >>> hover.position, hover.jerk
    (Vector([0.0, 0.0, 2.0]), Vector([0.0, 0.0, 0.0]))
    """

    position: Vector
    velocity: Vector
    acceleration: Vector
    yaw: Number
    yaw_rate: Number
    jerk: Vector = vector(0.0, 0.0, 0.0)
    snap: Vector = vector(0.0, 0.0, 0.0)
    yaw_acceleration: Number = 0.0
    ahead: "tuple[Reference, ...]" = ()


class PathLaw(Protocol):
    """A path as a law over numbers. Its numbers live in `parameters`; the law itself holds only structure and is hashable.

    >>> from dataclasses import dataclass
    >>> from quadstep.interfaces.reference import Reference
    >>> from quadstep.numbers import vector
    >>> @dataclass(frozen=True)
    ... class Climb:  # parameters: the speed [m/s]
    ...     def reference(self, t, parameters):
    ...         rest = vector(0.0, 0.0, 0.0)
    ...         return Reference(vector(0.0, 0.0, parameters * t), vector(0.0, 0.0, parameters), rest, 0.0, 0.0)
    >>> Climb().reference(2.0, 0.5).position
    Vector([0.0, 0.0, 1.0])
    """

    def reference(self, t: Number, parameters: Any) -> Reference:
        """The reference motion at time t [s] after the start."""
        ...

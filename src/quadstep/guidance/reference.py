"""What a path gives the controller at an instant."""

from typing import Any, NamedTuple, Protocol

from quadstep.numbers import Number, Vector, vector


class Reference(NamedTuple):
    """The wanted motion at an instant, in the world's frame, z up.

    position: xi_d [m]. velocity: xi_d_dot [m/s]. acceleration: xi_d_dd [m/s^2].
    yaw: psi_d [rad], any number of turns. yaw_rate: psi_d_dot [rad/s].
    jerk [m/s^3], snap [m/s^4]: third and fourth rate of the position; yaw_acceleration: psi_d_dd [rad/s^2]. Zero where a
    path does not know them. Vectors have length 3. ahead: the wanted motion at the instants that a controller's `preview`
    names; paths leave it out.

    >>> from quadstep.guidance import Reference
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
    >>> from quadstep.guidance import Reference
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
        """The wanted motion at time t [s] after the start."""
        ...

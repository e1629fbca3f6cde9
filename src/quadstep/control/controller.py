"""What a controller is: one sampled law over numbers.

To add one, write a frozen dataclass with the two methods of `ControllerLaw`, a `NamedTuple` of gains and a `NamedTuple`
of memory. It then flies on every engine. See "Add a controller" in the README.

There are two kinds, by what they fly. On the paper's plant a law measures a `State` of Euler angles and gives generalised
torques. On a real airframe it measures a `Measured` on quaternions and gives torques about the body's axes; there its position
loop may have a rate of its own, see `AirframeLaw`.
"""

import math
from typing import Any, NamedTuple, Protocol

from quadstep.guidance.reference import Reference
from quadstep.numbers import Number, Vector, vector
from quadstep.vehicle.state import State

NOT_SAID = vector(math.nan, math.nan, math.nan)
"""Of a command that names no attitude: the log has no columns for it, and nothing is made of them."""


class Command(NamedTuple):
    """What a controller asks for, held until its next sample, and what it was thinking.

    thrust: u [N]. torque [N m]: on the paper's plant (tau_psi, tau_theta, tau_phi), generalised; on an airframe about its
    body axes. The rest is only logged: desired_attitude: (psi_d, theta_d, phi_d), on an airframe (yaw, pitch, roll),
    right-handed [rad], left out by a law that has none in mind; r1 [m/s] and r2 [rad/s], the filtered errors; stored: the
    integral terms of Eq. 55; weight_norms: Frobenius norms of both nets' weights.
    """

    thrust: Number
    torque: Vector
    desired_attitude: Vector = NOT_SAID
    r1: Vector = vector(0.0, 0.0, 0.0)
    r2: Vector = vector(0.0, 0.0, 0.0)
    stored: Number = 0.0
    weight_norms: Vector = vector(0.0, 0.0)


class ControllerLaw(Protocol):
    """A sampled law. Its numbers live in `gains`; the object itself holds only structure and is hashable."""

    def start(self, measured: State, gains: Any) -> Any:
        """The memory before the first sample."""
        ...

    def law(
        self, memory: Any, measured: State, reference: Reference, gains: Any, t: Number, period: Number
    ) -> tuple[Command, Any]:
        """The command for the next `period` [s] from time t [s] on, and the memory for the sample after it."""
        ...


class Measured(NamedTuple):
    """What a controller of an airframe gets to know, measured or estimated.

    position [m], velocity [m/s]: world, z up. attitude: unit quaternion (w, x, y, z), body to world. rates: about the body's
    axes [rad/s]. thrust [N], torque [N m]: what the rotors were asked for since the last sample, after their limits.
    """

    position: Vector
    velocity: Vector
    attitude: Vector
    rates: Vector
    thrust: Number
    torque: Vector


class AirframeLaw(Protocol):
    """A sampled law for a real airframe: a `ControllerLaw` on `Measured`, with a position loop at its own, slower rate.

    Subclass it to get the `guide` that does nothing.
    """

    def start(self, measured: Measured, gains: Any) -> Any:
        """The memory before the first sample."""
        ...

    def guide(self, memory: Any, measured: Measured, reference: Reference, gains: Any, t: Number, period: Number) -> Any:
        """The position loop, every `period` [s]: the memory that tells `law` which thrust and attitude are wanted."""
        return memory

    def law(
        self, memory: Any, measured: Measured, reference: Reference, gains: Any, t: Number, period: Number
    ) -> tuple[Command, Any]:
        """The attitude loop: the command for the next `period` [s] from time t [s] on, and the memory for the sample after
        it.
        """
        ...

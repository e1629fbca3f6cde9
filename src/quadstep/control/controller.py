"""What a controller is: one sampled law over numbers.

To add one, write a frozen dataclass with the two methods of `ControllerLaw`, a `NamedTuple` of gains and a `NamedTuple`
of memory. It then flies on every engine. See "Add a controller" in the README.
"""

from typing import Any, NamedTuple, Protocol

from quadstep.guidance.reference import Reference
from quadstep.numbers import Number, Vector, vector
from quadstep.vehicle.state import State


class Command(NamedTuple):
    """What a controller asks for, held until its next sample, and what it was thinking.

    thrust: u [N]. torque: (tau_psi, tau_theta, tau_phi), generalised [N m].
    The rest is only logged: desired_attitude: (psi_d, theta_d, phi_d) [rad]; r1 [m/s] and r2 [rad/s], the filtered errors;
    stored: the integral terms of Eq. 55; weight_norms: Frobenius norms of both nets' weights.
    """

    thrust: Number
    torque: Vector
    desired_attitude: Vector = vector(0.0, 0.0, 0.0)
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

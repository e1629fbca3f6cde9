"""A disturbance in a file of one's own, which missions on the paper's plant name.

    [disturbance]
    type = "my_disturbance.py:Tether"

Its numbers are a `NamedTuple` of declarations (`interfaces/gain.py`), from which the keys of `[disturbance]` follow.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

from quadstep.numbers import Number, Vector
from quadstep.vehicle.paper.state import State


@dataclass(frozen=True)
class DeclaredDisturbance(ABC):
    """A_xyz and A_eta of Eqs 9 and 10 in place of Eq. 67; structure only, so it has no fields.

    Numbers: declared, each with a default.

    >>> from typing import NamedTuple
    >>> from quadstep.interfaces.gain import gain
    >>> from quadstep.numbers import vector
    >>> from quadstep.vehicle.paper.own_disturbance import DeclaredDisturbance
    >>> from quadstep.vehicle.paper.state import State
    >>> class SpringNumbers(NamedTuple):
    ...     stiffness: float = gain(2.0, "N/m", "how strongly it is pulled back")
    >>> class Spring(DeclaredDisturbance):
    ...     Numbers = SpringNumbers
    ...     def disturb(self, state, numbers, time):
    ...         return -numbers.stiffness * state.position, vector(0.0, 0.0, 0.0)
    >>> still = vector(0.0, 0.0, 0.0)
    >>> Spring().disturb(State(vector(1.0, 0.0, 0.5), still, still, still), SpringNumbers(2.0), 0.0)
    (Vector([-2.0, -0.0, -1.0]), Vector([0.0, 0.0, 0.0]))
    """

    Numbers: ClassVar[type]

    @abstractmethod
    def disturb(self, state: State, numbers: object, time: Number) -> tuple[Vector, Vector]:
        """Force [N] in the world's frame and generalised torque [N m] (psi, theta, phi) at time t [s]."""

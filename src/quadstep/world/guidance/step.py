"""A step: the wanted position jumps, and is held before and after."""

from dataclasses import dataclass
from typing import NamedTuple

from quadstep.interfaces.reference import Reference
from quadstep.numbers import Number, Vector, vector, where


class StepParameters(NamedTuple):
    """start, end: xi_d before and after [m]. time: of the jump [s]. yaw [rad]."""

    start: Vector
    end: Vector
    time: Number
    yaw: Number


@dataclass(frozen=True)
class Step:
    """Not a motion a vehicle can follow; what a controller makes of it is told by its overshoot and settling.

    >>> from quadstep.world.guidance import Step, StepParameters
    >>> from quadstep.numbers import vector
    >>> jump = StepParameters(vector(0.0, 0.0, 1.0), vector(0.0, 0.0, 2.0), time=1.0, yaw=0.0)
    >>> [Step().reference(t, jump).position[2] for t in (0.5, 1.0, 1.5)]
    [1.0, 2.0, 2.0]
    """

    def reference(self, t: Number, parameters: StepParameters) -> Reference:
        """The wanted position at time t [s], all rates zero."""
        after = where(t >= parameters.time, 1.0, 0.0)
        zero = vector(0.0, 0.0, 0.0)
        position = parameters.start + after * (parameters.end - parameters.start)
        return Reference(position, zero, zero, parameters.yaw, 0.0)

"""Positions that jump, and are held before and after, without velocity or acceleration: a step, and setpoints of a log."""

from dataclasses import dataclass
from typing import NamedTuple

from quadstep.interfaces.reference import Reference
from quadstep.numbers import Number, Table, Vector, maximum, vector, where
from quadstep.numbers.functions import number, word


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


class SetpointParameters(NamedTuple):
    """position: x, y, z [m]; yaw [rad]; from time 0 on every `period` [s]."""

    position: tuple[Table, Table, Table]
    yaw: Table
    period: Number


@dataclass(frozen=True)
class Setpoints:
    """What a vehicle was told while it flew.

    >>> from quadstep.world.guidance.setpoints import SetpointParameters, Setpoints
    >>> from quadstep.numbers import Table
    >>> still = Table([0.0, 0.0])
    >>> Setpoints().reference(0.15, SetpointParameters((Table([1.0, 2.0]), still, still), still, 0.1)).position
    Vector([2.0, 0.0, 0.0])
    """

    def reference(self, t: Number, parameters: SetpointParameters) -> Reference:
        """The setpoint held at time t [s]."""
        place = number(word(maximum(t * (1.0 / parameters.period) + 1e-6, 0.0)))
        zero = vector(0.0, 0.0, 0.0)
        position = Vector(table.at(place) for table in parameters.position)
        return Reference(position, zero, zero, parameters.yaw.at(place), 0.0)

"""Setpoints of a log: positions at even times, each held to the next, without velocity or acceleration."""

from dataclasses import dataclass
from typing import NamedTuple

from quadstep.interfaces.reference import Reference
from quadstep.numbers import Number, Table, Vector, maximum, vector
from quadstep.numbers.functions import number, word


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

"""How fast the loops of a vehicle can be."""

from quadstep.airframe.allocation import Allocation, allocate
from quadstep.airframe.geometry import Geometry
from quadstep.airframe.plant import Airframe
from quadstep.numbers import Number, Vector, maximum, minimum, sqrt

LIVELY = 60.0
"""Angular acceleration about a horizontal body axis that suffices for the default gains [rad/s^2]."""


def agility(geometry: Geometry, airframe: Airframe, allocation: Allocation) -> Number:
    """How fast the loops of a vehicle can be, relative to those of the 2.6 kg one on which the default gains were found.

    At most 1; less where the rotors take longer than its 40 ms, or turn the vehicle with less than `LIVELY`.
    """
    weight, enough = airframe.mass * airframe.gravity, 1e3 * LIVELY
    turns = []
    for axis in range(2):
        torque = [0.0, 0.0, 0.0]
        torque[axis] = enough * airframe.inertia[axis]
        _, _, made = allocate(geometry, allocation, weight, Vector(torque))
        turns.append(made[axis] / airframe.inertia[axis])
    lag = maximum(airframe.rotor.rise, airframe.rotor.fall)
    return minimum(minimum(1.0, 0.04 / lag), sqrt(minimum(*turns) / LIVELY))

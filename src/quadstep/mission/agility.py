"""Gains that suit a vehicle: what a controller believes of it, and how fast its loops can be."""

from typing import Any, ClassVar, NamedTuple

from quadstep.airframe.allocation import allocate
from quadstep.mission.airframe import BuiltAirframe
from quadstep.mission.fields import Positive, PositiveDiagonal, Section
from quadstep.numbers import Number, Vector, maximum, minimum, sqrt

MARGIN = 0.85
"""Share of all rotors' thrust that a position loop may ask for; the rest is for turning."""

LIVELY = 60.0
"""Angular acceleration about a level axis that suffices for the usual gains [rad/s^2]."""


class Usual(NamedTuple):
    """A gain for the 2.6 kg vehicle, about x, y, z; for others it is times their agility to this power: 1/s to the power."""

    values: tuple[float, float, float]
    power: int


class BelievedSection(Section):
    """What a controller believes of the vehicle: the vehicle's own mass [kg] and inertia [kg m^2] if left out.

    Gains that are left out are the usual ones, slowed to the vehicle's agility.
    """

    mass: Positive | None = None
    inertia: PositiveDiagonal | None = None

    usual: ClassVar[dict[str, Usual]] = {}

    def gains_for(self, vehicle: BuiltAirframe) -> dict[str, Any]:
        """Every gain as a vector, by key."""
        pace = agility(vehicle)
        paces = {1: pace, 2: pace * pace, 3: pace * pace * pace}
        return {
            key: Vector(getattr(self, key) or tuple(value * paces[usual.power] for value in usual.values))
            for key, usual in self.usual.items()
        }

    def warnings(self, vehicle: BuiltAirframe) -> list[str]:
        """What is to be said against these gains."""
        return []

    def believed(self, vehicle: BuiltAirframe) -> dict[str, Any]:
        """mass, inertia and gravity as gains."""
        airframe = vehicle.airframe
        inertia = Vector(self.inertia) if self.inertia else airframe.inertia
        return {"mass": airframe.mass if self.mass is None else self.mass, "inertia": inertia, "gravity": airframe.gravity}


def agility(vehicle: BuiltAirframe) -> Number:
    """How fast the loops of a vehicle can be, against those of the 2.6 kg one on which the usual gains were found.

    At most 1; less where the rotors take longer than its 40 ms, or turn the vehicle with less than `LIVELY`.
    """
    airframe = vehicle.airframe
    weight, enough = airframe.mass * airframe.gravity, 1e3 * LIVELY
    turns = []
    for axis in range(2):
        torque = [0.0, 0.0, 0.0]
        torque[axis] = enough * airframe.inertia[axis]
        _, _, made = allocate(vehicle.geometry, vehicle.allocation, weight, Vector(torque))
        turns.append(made[axis] / airframe.inertia[axis])
    lag = maximum(airframe.rotor.rise, airframe.rotor.fall)
    return minimum(minimum(1.0, 0.04 / lag), sqrt(minimum(*turns) / LIVELY))


def most_thrust(vehicle: BuiltAirframe) -> float:
    """What a position loop may ask for [N]."""
    return MARGIN * len(vehicle.geometry.mounts) * vehicle.allocation.most

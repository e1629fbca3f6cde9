"""The vehicle section of a mission; defaults are the paper's vehicle (Section 6), rotors chosen where it is silent."""

import math
from typing import Annotated, Literal

from pydantic import BeforeValidator, model_validator

from quadstep.interfaces.model import MARGIN, Kinematics, Model
from quadstep.mission.fields import NonNegative, Positive, PositiveDiagonal, Quantity, Section, as_tuple
from quadstep.numbers import Vector, total
from quadstep.vehicle.paper import Rotors, Vehicle


class RotorsSection(Section):
    """The four rotors of the paper's vehicle."""

    arm: Annotated[Positive, Quantity("m", "l, from the centre to a rotor")] = 0.25
    moment: Annotated[Positive, Quantity("m", "c, torque per thrust")] = 0.05
    limits: Annotated[
        Annotated[tuple[NonNegative, Positive], BeforeValidator(as_tuple)] | None,
        Quantity("N", "smallest and largest thrust of one rotor; default: no limits"),
    ] = None

    @model_validator(mode="after")
    def _ordered(self) -> "RotorsSection":
        if self.limits and self.limits[0] >= self.limits[1]:
            raise ValueError(f"limits must be [smallest, largest] thrust of one rotor, not {list(self.limits)}")
        return self


class VehicleSection(Section):
    """The paper's vehicle."""

    mass: Annotated[Positive, Quantity("kg", "mass m")] = 1.0
    inertia: Annotated[PositiveDiagonal, Quantity("kg m^2", "diagonal of Sigma")] = (5.0, 5.0, 5.0)
    gravity: Annotated[Positive, Quantity("m/s^2", "gravity g")] = 9.81
    kinematics: Annotated[
        Literal["standard", "printed", "rigid"],
        Quantity("", "which T_eta: that of Newton-Euler, the paper's, or the one consistent with its thrust"),
    ] = "standard"
    rotors: RotorsSection = RotorsSection()

    @model_validator(mode="after")
    def _rigid(self) -> "VehicleSection":
        for axis in range(3):
            others = total(self.inertia) - self.inertia[axis]
            if self.inertia[axis] > others * (1.0 + 1e-12):
                raise ValueError(
                    f"inertia breaks the triangle inequality: {self.inertia[axis]:g} is more than the sum of the other two, "
                    f"{others:g}; no rigid body has it"
                )
        return self

    def warnings(self) -> list[str]:
        """Limits with which no controller could hover."""
        if self.rotors.limits:
            lift, weight = 4.0 * self.rotors.limits[1], self.mass * self.gravity
            if lift <= weight:
                return [f"vehicle.rotors.limits: four rotors lift at most {lift:g} N, the weight is {weight:g} N"]
        return []

    def model(self) -> Model:
        """What it is to a controller."""
        greatest = self.rotors.limits[1] if self.rotors.limits else math.inf
        kinematics = Kinematics(self.kinematics)
        return Model(self.mass, Vector(self.inertia), self.gravity, MARGIN * 4 * greatest, kinematics=kinematics)

    def build(self) -> Vehicle:
        least, greatest = self.rotors.limits or (-1e300, 1e300)
        rotors = Rotors(self.rotors.arm, self.rotors.moment, least, greatest)
        return Vehicle(self.mass, Vector(self.inertia), self.gravity, rotors)

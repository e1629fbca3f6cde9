"""The paper's law as a controller of a real vehicle, in a mission file."""

from pathlib import Path
from typing import Any, Literal

from quadstep.control.paper_on_airframe import PaperOnAirframe
from quadstep.mission.agility import agility
from quadstep.mission.airframe import BuiltAirframe
from quadstep.mission.check import check
from quadstep.mission.controllers import BacksteppingSection, BuiltController, NetsSection
from quadstep.mission.fields import NonNegative, NonNegativeDiagonal, Positive, PositiveDiagonal, Section
from quadstep.mission.vehicles import VehicleSection


class PaperNets(NetsSection):
    """The two nets, damped as suits real vehicles; F1 and F2 follow the vehicle if left out."""

    F1: NonNegative | None = None  # type: ignore[assignment]
    F2: NonNegative | None = None  # type: ignore[assignment]
    kappa1: NonNegative = 0.008
    kappa2: NonNegative = 0.008


class PaperSection(Section):
    """The paper's law on a real vehicle, through its Euler angles; gains as in the paper, in newtons.

    What is left out is scaled to the vehicle so that the conditions of Theorem 5.1 hold. With a its agility: Lambda1 = 0.82 a,
    K_r1 = 6.3 m a, K_i1 = K_r1 / 15, Lambda2 = 12 a, K_r2 = 4.5 max(J) Lambda2 (J_M is 2 max(J)), K_i2 = K_r2 / 15, the
    command filter 14 a, and the nets' F1 = 3.2 m a^2, F2 = 0.1 max(J) a^2, kappa = 0.008.
    """

    type: Literal["backstepping"]
    mass: Positive | None = None
    Lambda1: PositiveDiagonal | None = None
    K_r1: PositiveDiagonal | None = None
    K_i1: NonNegativeDiagonal | None = None
    Lambda2: PositiveDiagonal | None = None
    K_r2: PositiveDiagonal | None = None
    K_i2: NonNegativeDiagonal | None = None
    filter_frequency: Positive | None = None
    nets: PaperNets = PaperNets()

    def scaled(self, vehicle: BuiltAirframe) -> dict[str, Any]:
        """All keys of the paper's section."""
        mass, largest, pace = self.mass or vehicle.airframe.mass, max(vehicle.airframe.inertia), agility(vehicle)
        slope_1, slope_2 = self.Lambda1 or (0.82 * pace,) * 3, self.Lambda2 or (12.0 * pace,) * 3
        force = self.K_r1 or (6.3 * mass * pace,) * 3
        torque = self.K_r2 or (4.5 * largest * max(slope_2),) * 3
        rate_1 = 3.2 * mass * (pace * pace) if self.nets.F1 is None else self.nets.F1
        rate_2 = 0.1 * largest * (pace * pace) if self.nets.F2 is None else self.nets.F2
        return {
            "mass": mass,
            "Lambda1": slope_1,
            "K_r1": force,
            "K_i1": self.K_i1 or tuple(gain / 15.0 for gain in force),
            "Lambda2": slope_2,
            "K_r2": torque,
            "K_i2": self.K_i2 or tuple(gain / 15.0 for gain in torque),
            "filter_frequency": self.filter_frequency or 14.0 * pace,
            "nets": self.nets.model_copy(update={"F1": rate_1, "F2": rate_2}),
        }

    def section(self, vehicle: BuiltAirframe) -> BacksteppingSection:
        """The paper's section."""
        content = {"type": "backstepping", **self.scaled(vehicle)}
        return check(BacksteppingSection, content, "controller, scaled to the vehicle")

    def warnings(self, vehicle: BuiltAirframe) -> list[str]:
        """The gain conditions of Theorem 5.1 that these gains break."""
        return self.section(vehicle).warnings(as_paper_vehicle(vehicle))

    def build(self, vehicle: BuiltAirframe, folder: Path) -> BuiltController:
        built = self.section(vehicle).build(as_paper_vehicle(vehicle), folder)
        return built._replace(law=PaperOnAirframe(built.law))


def as_paper_vehicle(vehicle: BuiltAirframe) -> VehicleSection:
    """The vehicle as the paper's plant, with the T_eta of a true rigid body, so the inertia stays as it is."""
    airframe = vehicle.airframe
    x, y, z = airframe.inertia
    return VehicleSection(mass=airframe.mass, inertia=(x, y, z), gravity=airframe.gravity, kinematics="rigid")

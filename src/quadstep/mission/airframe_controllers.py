"""The kinds of controller a real vehicle can fly with. Gains are per mass and inertia, so the defaults suit vehicles of any
size.
"""

import math
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field

from quadstep.control.cascaded_pid import CascadedPid, CascadedPidGains
from quadstep.control.geometric import Geometric, GeometricGains
from quadstep.control.lqr import Lqr, hover_gains
from quadstep.control.networks import Net, random_input_weights
from quadstep.control.paper_on_airframe import PaperOnAirframe
from quadstep.control.rotation_backstepping import FORCE_INPUTS, TORQUE_INPUTS, RotationBackstepping, RotationGains
from quadstep.mission.airframe import BuiltAirframe
from quadstep.mission.controllers import BacksteppingSection, BuiltController, CompletedSection, NetsSection, Pair
from quadstep.mission.fields import NonNegativeDiagonal, Positive, PositiveDiagonal, Section, as_tuple
from quadstep.mission.vehicles import VehicleSection
from quadstep.numbers import Vector

MARGIN = 0.95
"""Share of all rotors' thrust that a position loop may ask for; the rest is for turning."""


class BelievedSection(Section):
    """What a controller believes of the vehicle: the vehicle's own mass [kg] and inertia [kg m^2] if left out."""

    mass: Positive | None = None
    inertia: PositiveDiagonal | None = None

    def believed(self, vehicle: BuiltAirframe) -> dict[str, Any]:
        """mass, inertia and gravity as gains."""
        airframe = vehicle.airframe
        inertia = Vector(self.inertia) if self.inertia else airframe.inertia
        return {"mass": self.mass or airframe.mass, "inertia": inertia, "gravity": airframe.gravity}


def most_thrust(vehicle: BuiltAirframe) -> float:
    """What a position loop may ask for [N]."""
    return MARGIN * len(vehicle.geometry.mounts) * vehicle.allocation.most


class GeometricSection(BelievedSection):
    """Geometric tracking control on SE(3) (Lee, Leok, McClamroch 2010). k_x, k_v, k_i over mass; k_R, k_Omega over inertia."""

    type: Literal["geometric"]
    k_x: PositiveDiagonal = (6.0, 6.0, 6.0)
    k_v: PositiveDiagonal = (4.0, 4.0, 4.0)
    k_i: NonNegativeDiagonal = (0.0, 0.0, 0.0)
    k_R: PositiveDiagonal = (120.0, 120.0, 30.0)  # noqa: N815 (the paper's symbols)
    k_Omega: PositiveDiagonal = (18.0, 18.0, 9.0)  # noqa: N815
    integral_bound: Positive = 5.0

    def build(self, vehicle: BuiltAirframe, folder: Path) -> BuiltController:
        gains = GeometricGains(
            **self.believed(vehicle),
            stiffness=Vector(self.k_x),
            damping=Vector(self.k_v),
            integral=Vector(self.k_i),
            turn_stiffness=Vector(self.k_R),
            turn_damping=Vector(self.k_Omega),
            integral_bound=self.integral_bound,
        )
        return BuiltController(Geometric(), gains, [])


class PidSection(BelievedSection):
    """Cascaded PID: position P, velocity PI, attitude P, body rate PID."""

    type: Literal["pid"]
    position: PositiveDiagonal = (2.0, 2.0, 2.0)
    velocity: PositiveDiagonal = (5.0, 5.0, 5.0)
    velocity_integral: NonNegativeDiagonal = (3.0, 3.0, 3.0)
    integral_bound: Positive = 15.0
    attitude: PositiveDiagonal = (8.0, 8.0, 4.0)
    rate: PositiveDiagonal = (18.0, 18.0, 9.0)
    rate_integral: NonNegativeDiagonal = (10.0, 10.0, 10.0)
    rate_integral_bound: Positive = 20.0
    rate_derivative: NonNegativeDiagonal = (0.0, 0.0, 0.0)
    rate_filter: Positive = 60.0

    def build(self, vehicle: BuiltAirframe, folder: Path) -> BuiltController:
        gains = CascadedPidGains(
            **self.believed(vehicle),
            most_thrust=most_thrust(vehicle),
            position=Vector(self.position),
            velocity=Vector(self.velocity),
            velocity_integral=Vector(self.velocity_integral),
            integral_bound=self.integral_bound,
            attitude=Vector(self.attitude),
            rate=Vector(self.rate),
            rate_integral=Vector(self.rate_integral),
            rate_integral_bound=self.rate_integral_bound,
            rate_derivative=Vector(self.rate_derivative),
            rate_filter=self.rate_filter,
        )
        return BuiltController(CascadedPid(), gains, [])


LEVEL_WEIGHTS = (40.0, 40.0, 4.0, 1.0, 0.3, 0.002)


class LqrSection(BelievedSection):
    """Linear quadratic regulator about hover; weights on squared errors: what one unit of each is worth.

    level: of the integral of the position error, position, velocity, tilt, tilt rate, angular acceleration; climb: of the
    integral, position, velocity, acceleration; turn: of heading, its rate, angular acceleration.
    """

    type: Literal["lqr"]
    level: Annotated[tuple[Positive, ...], BeforeValidator(as_tuple), Field(min_length=6, max_length=6)] = LEVEL_WEIGHTS
    climb: Annotated[tuple[Positive, ...], BeforeValidator(as_tuple), Field(min_length=4, max_length=4)] = (
        20.0,
        40.0,
        4.0,
        1.0,
    )
    turn: Annotated[tuple[Positive, ...], BeforeValidator(as_tuple), Field(min_length=3, max_length=3)] = (40.0, 4.0, 0.4)
    integral_bound: Positive = 5.0

    def build(self, vehicle: BuiltAirframe, folder: Path) -> BuiltController:
        believed = self.believed(vehicle)
        believed["inertia"] = list(believed["inertia"])
        gains = hover_gains(**believed, level=self.level, climb=self.climb, turn=self.turn, integral_bound=self.integral_bound)
        return BuiltController(Lqr(), gains, [])


class RotationSection(BelievedSection):
    """Adaptive neural backstepping on the rotation group; the paper's symbols, K over mass or inertia, nets for accelerations.

    K_i1: a fifteenth of K_r1 if left out, as in the paper's study. P: the completion's coupling over inertia [1/s^2].
    """

    type: Literal["rotation-backstepping"]
    Lambda1: PositiveDiagonal = (1.2, 1.2, 1.2)
    K_r1: PositiveDiagonal = (6.8, 6.8, 6.8)
    K_i1: NonNegativeDiagonal | None = None
    Lambda2: PositiveDiagonal = (15.0, 15.0, 7.5)
    K_r2: PositiveDiagonal = (15.0, 15.0, 7.5)
    K_i2: NonNegativeDiagonal = (2.0, 2.0, 2.0)
    P: PositiveDiagonal = (8.0, 8.0, 8.0)
    filter_frequency: PositiveDiagonal = (25.0, 25.0, 12.5)
    nets: NetsSection = NetsSection(F1=4.0, F2=10.0, kappa1=0.13, kappa2=0.13)
    weight_bounds: Pair = (30.0, 100.0)
    integral_bounds: Pair = (20.0, 5.0)

    def build(self, vehicle: BuiltAirframe, folder: Path) -> BuiltController:
        nets = self.nets
        weights_1, weights_2 = nets.initial_weights(folder)
        force_inputs = random_input_weights(nets.seed, 1, nets.neurons, FORCE_INPUTS)
        torque_inputs = random_input_weights(nets.seed, 2, nets.neurons, TORQUE_INPUTS)
        gains = RotationGains(
            **self.believed(vehicle),
            most_thrust=most_thrust(vehicle),
            slope_1=Vector(self.Lambda1),
            gain_1=Vector(self.K_r1),
            integral_1=Vector(self.K_i1) if self.K_i1 else Vector(self.K_r1) / 15.0,
            slope_2=Vector(self.Lambda2),
            gain_2=Vector(self.K_r2),
            integral_2=Vector(self.K_i2),
            coupling=Vector(self.P),
            filter_frequency=Vector(self.filter_frequency),
            force_net=Net(force_inputs, nets.F1, nets.kappa1),
            torque_net=Net(torque_inputs, nets.F2, nets.kappa2),
            learning_start=nets.start if nets.enabled else math.inf,
            weight_bounds=Vector(self.weight_bounds),
            integral_bounds=Vector(self.integral_bounds),
            weights_1=weights_1,
            weights_2=weights_2,
        )
        return BuiltController(RotationBackstepping(), gains, self.theorem_warnings())

    def theorem_warnings(self) -> list[str]:
        """The gain condition of Theorem 5.1 that is left when the rigid-body torque is fed forward: K_r1 > m Lambda_1."""
        return [
            f"controller.K_r1 ({axis}) = {gain:g} is not above Lambda1 = {slope:g} (condition of Theorem 5.1, over mass)"
            for axis, gain, slope in zip("xyz", self.K_r1, self.Lambda1, strict=True)
            if gain <= slope
        ]


class PaperKeys(Section):
    """The paper's law on a real vehicle, through its Euler angles; gains as in the paper, in newtons.

    What is left out is scaled to the vehicle so that the conditions of Theorem 5.1 hold: K_r1 = 5 m, K_i1 = K_r1 / 15,
    K_r2 = 2.2 max(J) Lambda2 (J_M is 2 max(J)), K_i2 = K_r2 / 15, and the nets' F1 = 5 m, F2 = max(J).
    """

    mass: Positive | None = None
    Lambda1: PositiveDiagonal = (1.2, 1.2, 1.2)
    K_r1: PositiveDiagonal | None = None
    K_i1: NonNegativeDiagonal | None = None
    Lambda2: PositiveDiagonal = (6.0, 6.0, 6.0)
    K_r2: PositiveDiagonal | None = None
    K_i2: NonNegativeDiagonal | None = None
    filter_frequency: Positive = 25.0
    nets: NetsSection = NetsSection()

    def scaled(self, vehicle: BuiltAirframe) -> dict[str, Any]:
        """All keys of the paper's section."""
        mass, largest = self.mass or vehicle.airframe.mass, max(vehicle.airframe.inertia)
        force = self.K_r1 or (5.0 * mass,) * 3
        torque = self.K_r2 or tuple(2.2 * largest * slope for slope in (max(self.Lambda2),) * 3)
        chosen = self.nets.model_fields_set
        rates = {"F1": 5.0 * mass, "F2": largest}
        nets = self.nets.model_copy(update={key: rate for key, rate in rates.items() if key not in chosen})
        return {
            "mass": mass,
            "Lambda1": self.Lambda1,
            "K_r1": force,
            "K_i1": self.K_i1 or tuple(gain / 15.0 for gain in force),
            "Lambda2": self.Lambda2,
            "K_r2": torque,
            "K_i2": self.K_i2 or tuple(gain / 15.0 for gain in torque),
            "filter_frequency": self.filter_frequency,
            "nets": nets,
        }


def as_paper_vehicle(vehicle: BuiltAirframe) -> VehicleSection:
    """The vehicle as the paper's plant: its T_eta of a true rigid body turns about body axes, so the inertia stays as it is."""
    airframe = vehicle.airframe
    x, y, z = airframe.inertia
    return VehicleSection(mass=airframe.mass, inertia=(x, y, z), gravity=airframe.gravity, kinematics="rigid")


class PaperSection(PaperKeys):
    """The paper's own law."""

    type: Literal["backstepping"]

    def build(self, vehicle: BuiltAirframe, folder: Path) -> BuiltController:
        section = BacksteppingSection.model_validate({"type": "backstepping", **self.scaled(vehicle)})
        built = section.build(as_paper_vehicle(vehicle), folder)
        return built._replace(law=PaperOnAirframe(built.law))


class PaperCompletedSection(PaperKeys):
    """The paper's law completed (docs/theory.md), still on Euler angles."""

    type: Literal["completed-backstepping"]

    def build(self, vehicle: BuiltAirframe, folder: Path) -> BuiltController:
        section = CompletedSection.model_validate({"type": "completed-backstepping", **self.scaled(vehicle)})
        built = section.build(as_paper_vehicle(vehicle), folder)
        return built._replace(law=PaperOnAirframe(built.law))


AnyAirframeController = Annotated[
    GeometricSection | PidSection | LqrSection | RotationSection | PaperSection | PaperCompletedSection,
    Field(discriminator="type"),
]

"""A mission for the paper's plant, as a user writes it; the defaults are the paper's study."""

import math
from functools import partial
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

import numpy as np
from pydantic import BeforeValidator, Field, SerializeAsAny, WrapValidator

from quadstep.control.backstepping import Backstepping
from quadstep.interfaces.log import FlightLog
from quadstep.interfaces.plant import MARGIN, Kinematics, Model, Reference
from quadstep.io.doors import DISTURBANCES
from quadstep.metrics.quantities import position_errors, rotor_thrusts
from quadstep.metrics.registry import Metrics, flight_metrics, rotor_metrics, warned
from quadstep.mission.clock import ClockSection
from quadstep.mission.derived import ControllerSection, section_of
from quadstep.mission.fields import (
    Angles,
    Finite,
    Name,
    NonNegative,
    Positive,
    PositiveDiagonal,
    Quantity,
    Section,
    Triple,
    as_tuple,
    check_rigid,
)
from quadstep.mission.own_controller import any_controller
from quadstep.mission.own_thing import OwnMetrics, OwnSection, own_or
from quadstep.mission.paths import AnyPath, BuiltPath, path_warnings
from quadstep.mission.schema import Built, MarginsSection, Mission
from quadstep.mission.tune import TuneSection
from quadstep.numbers import Vector
from quadstep.vehicle.lagrange import Lagrange, Limits, Parameters
from quadstep.vehicle.paper import DeclaredDisturbance, Disturbance, Rotors, State, Vehicle


class RotorsSection(Section):
    """The four rotors of the paper's vehicle."""

    arm: Annotated[Positive, Quantity("m", "l, distance from the centre to a rotor")] = 0.25
    moment: Annotated[Positive, Quantity("m", "c, torque per thrust")] = 0.05
    limits: Annotated[
        Annotated[tuple[NonNegative, Positive], BeforeValidator(as_tuple)] | None,
        Quantity("N", "smallest and largest thrust of one rotor; default: no limits"),
    ] = None

    def model_post_init(self, context: object) -> None:
        if self.limits and self.limits[0] >= self.limits[1]:
            raise ValueError(f"limits must be [smallest, largest] thrust of one rotor, not {list(self.limits)}")


class VehicleSection(Section):
    """The paper's vehicle."""

    mass: Annotated[Positive, Quantity("kg", "mass m")] = 1.0
    inertia: Annotated[PositiveDiagonal, Quantity("kg m^2", "diagonal of Sigma")] = (5.0, 5.0, 5.0)
    gravity: Annotated[Positive, Quantity("m/s^2", "gravity g")] = 9.81
    kinematics: Annotated[
        Literal["standard", "printed", "rigid"],
        Quantity("", "T_eta: from Newton-Euler, as printed in the paper, or consistent with the paper's thrust"),
    ] = "standard"
    rotors: RotorsSection = RotorsSection()

    def model_post_init(self, context: object) -> None:
        check_rigid(self.inertia)

    def warnings(self) -> list[str]:
        """Limits with which no controller could hover."""
        if self.rotors.limits:
            lift, weight = 4.0 * self.rotors.limits[1], self.mass * self.gravity
            if lift <= weight:
                return [f"vehicle.rotors.limits: four rotors lift at most {lift:g} N, the weight is {weight:g} N"]
        return []

    def model(self) -> Model:
        greatest = self.rotors.limits[1] if self.rotors.limits else math.inf
        kinematics = Kinematics(self.kinematics)
        return Model(self.mass, Vector(self.inertia), self.gravity, MARGIN * 4 * greatest, kinematics=kinematics)

    def build(self) -> Vehicle:
        least, greatest = self.rotors.limits or (-1e300, 1e300)
        rotors = Rotors(self.rotors.arm, self.rotors.moment, least, greatest)
        return self.as_numbers(Vehicle, rotors=rotors)


class DisturbanceSection(Section):
    """The paper's disturbance (Eq. 67), plus constant force and generalised torque."""

    scale: Annotated[Finite, Quantity("", "scale of the paper's disturbance; 0 for none")] = 1.0
    force: Annotated[Triple, Quantity("N", "constant force in world axes")] = (0.0, 0.0, 0.0)
    torque: Annotated[Triple, Quantity("N m", "constant torque on psi, theta, phi")] = (0.0, 0.0, 0.0)

    thing: ClassVar[None] = None
    """No law but the paper's."""

    def build(self) -> Disturbance:
        return self.as_numbers(Disturbance)


class OwnDisturbanceSection(OwnSection):
    """A disturbance of the user's own: its `type`, and a key for each of its numbers."""

    thing: ClassVar[DeclaredDisturbance]

    def build(self) -> object:
        return self.numbers()


if TYPE_CHECKING:
    AnyDisturbance = DisturbanceSection | OwnDisturbanceSection
else:
    AnyDisturbance = Annotated[
        SerializeAsAny[DisturbanceSection], WrapValidator(own_or(DeclaredDisturbance, OwnDisturbanceSection, DISTURBANCES))
    ]


USUAL_CONTROLLER = section_of(Backstepping)(type="backstepping")

if TYPE_CHECKING:
    AnyController = ControllerSection
else:
    AnyController = any_controller(State)


class StartSection(Section):
    """State at t = 0; what is left out follows the path (position, velocity, yaw) or is zero."""

    position: Annotated[Triple | None, Quantity("m", "position; default: the path's")] = None
    velocity: Annotated[Triple | None, Quantity("m/s", "velocity; default: the path's")] = None
    attitude: Annotated[Angles | None, Quantity("rad", "psi, theta, phi; default: the path's yaw, level")] = None
    rates: Annotated[Triple, Quantity("rad/s", "rates of psi, theta, phi")] = (0.0, 0.0, 0.0)

    def model_post_init(self, context: object) -> None:
        if self.attitude and abs(self.attitude[1]) >= math.pi / 2.0:
            raise ValueError(f"attitude: theta must be inside (-pi/2, pi/2) rad, not {self.attitude[1]:g}")

    def state(self, reference: Reference) -> State:
        return State(
            position=Vector(self.position) if self.position else reference.position,
            velocity=Vector(self.velocity) if self.velocity else reference.velocity,
            attitude=Vector(self.attitude) if self.attitude else Vector((reference.yaw, 0.0, 0.0)),
            rates=Vector(self.rates),
        )


class SimulationSection(ClockSection):
    """Clock of the flight."""

    control_period: Annotated[Positive, Quantity("s", "sampling period of the controller")] = 0.002


class LimitsSection(Section):
    """Bounds beyond which a flight is lost."""

    distance: Annotated[Positive, Quantity("m", "largest distance from the path")] = 100.0
    rate: Annotated[Positive, Quantity("rad/s", "largest rate of an Euler angle")] = 100.0
    pitch: Annotated[float, Field(gt=0.0, lt=math.pi / 2.0), Quantity("rad", "largest |theta|")] = 1.57


class LagrangeMission(Mission):
    """A mission file for the paper's plant."""

    name: Annotated[Name, Quantity("", "name of the flight, shown in its results; default: the file's name")] = "Flight"
    vehicle: VehicleSection = VehicleSection()
    path: AnyPath
    controller: AnyController = USUAL_CONTROLLER
    start: StartSection = StartSection()
    disturbance: AnyDisturbance = DisturbanceSection()
    simulation: SimulationSection = SimulationSection()
    limits: LimitsSection = LimitsSection()
    metrics: OwnMetrics = ()
    margins: MarginsSection = MarginsSection()
    tune: TuneSection | None = None

    measures: ClassVar = State

    @property
    def plant(self) -> Lagrange:
        return Lagrange(Kinematics(self.vehicle.kinematics), self.vehicle.rotors.limits is not None, self.disturbance.thing)

    @property
    def arm(self) -> float:
        return self.vehicle.rotors.arm

    def plant_metrics(self, log: FlightLog) -> tuple[Metrics, list[str]]:
        metrics, limits = flight_metrics(log, arm=self.arm), self.vehicle.rotors.limits
        if len(log.rows) > 1:
            metrics["largest_error[m]"] = float(np.linalg.norm(position_errors(log), axis=1).max())
        if limits:
            metrics |= rotor_metrics(log, rotor_thrusts(log), *limits)
        return warned(metrics)

    def build(self, path: BuiltPath) -> Built:
        rotors, vehicle = self.vehicle.rotors.limits, self.vehicle.build()
        return Built(
            numbers=partial(
                Parameters, vehicle=vehicle, disturbance=self.disturbance.build(), limits=self.limits.as_numbers(Limits)
            ),
            start=self.start.state,
            warnings=lambda duration: [
                *self.vehicle.warnings(),
                *path_warnings(path, duration, vehicle.mass, vehicle.gravity, 4.0 * rotors[1] if rotors else math.inf),
            ],
        )

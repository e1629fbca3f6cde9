"""A mission for the paper's plant, as a user writes it; the defaults are the paper's study."""

import math
from functools import partial
from typing import TYPE_CHECKING, Annotated, ClassVar

import numpy as np
from pydantic import Field, SerializeAsAny, WrapValidator, model_validator

from quadstep.control.backstepping import Backstepping
from quadstep.interfaces.log import FlightLog
from quadstep.interfaces.model import Kinematics
from quadstep.interfaces.reference import Reference
from quadstep.io.user_code.installed import DISTURBANCES
from quadstep.metrics.of_log import Metrics, flight_metrics
from quadstep.metrics.quantities import position_errors, rotor_thrusts, share_at_limits
from quadstep.mission.clock import ClockSection
from quadstep.mission.derived import ControllerSection, section_of
from quadstep.mission.fields import Angles, Finite, Name, Positive, Quantity, Section, Triple
from quadstep.mission.own_controller import any_controller
from quadstep.mission.own_thing import OwnMetrics, OwnSection, own_or
from quadstep.mission.paths import AnyPath, BuiltPath, path_warnings
from quadstep.mission.schema import Built, MarginsSection, Mission
from quadstep.mission.tune import TuneSection
from quadstep.mission.vehicles import VehicleSection
from quadstep.numbers import Vector
from quadstep.vehicle.paper import DeclaredDisturbance, Disturbance, State
from quadstep.vehicle.plants.lagrange import Lagrange, Limits, Parameters


class DisturbanceSection(Section):
    """The paper's disturbance (Eq. 67), plus constant force and generalised torque."""

    scale: Annotated[Finite, Quantity("times Eq. 67", "scale of the paper's disturbance; 0 for none")] = 1.0
    force: Annotated[Triple, Quantity("N", "constant force in world axes")] = (0.0, 0.0, 0.0)
    torque: Annotated[Triple, Quantity("N m", "constant torque on psi, theta, phi")] = (0.0, 0.0, 0.0)

    thing: ClassVar[None] = None
    """No law but the paper's."""

    def build(self) -> Disturbance:
        return Disturbance(self.scale, Vector(self.force), Vector(self.torque))


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

    position: Annotated[Triple | None, Quantity("m", "default: the path's")] = None
    velocity: Annotated[Triple | None, Quantity("m/s", "default: the path's")] = None
    attitude: Annotated[Angles | None, Quantity("rad", "psi, theta, phi; default: the path's yaw, level")] = None
    rates: Annotated[Triple, Quantity("rad/s", "rates of psi, theta, phi")] = (0.0, 0.0, 0.0)

    @model_validator(mode="after")
    def _upright(self) -> "StartSection":
        if self.attitude and abs(self.attitude[1]) >= math.pi / 2.0:
            raise ValueError(f"attitude: theta must be inside (-pi/2, pi/2) rad, not {self.attitude[1]:g}")
        return self

    def state(self, wanted: Reference) -> State:
        """The state at t = 0."""
        return State(
            position=Vector(self.position) if self.position else wanted.position,
            velocity=Vector(self.velocity) if self.velocity else wanted.velocity,
            attitude=Vector(self.attitude) if self.attitude else Vector((wanted.yaw, 0.0, 0.0)),
            rates=Vector(self.rates),
        )


class SimulationSection(ClockSection):
    """Clock of the flight."""

    control_period: Annotated[Positive, Quantity("s", "sampling period of the controller")] = 0.002


class LimitsSection(Section):
    """Beyond which a flight counts as diverged."""

    distance: Annotated[Positive, Quantity("m", "largest distance from the path")] = 100.0
    rate: Annotated[Positive, Quantity("rad/s", "largest rate of an Euler angle")] = 100.0
    pitch: Annotated[float, Field(gt=0.0, lt=math.pi / 2.0), Quantity("rad", "largest |theta|")] = 1.57


class LagrangeMission(Mission):
    """A mission file for the paper's plant."""

    name: Annotated[Name, Quantity("", "name of the flight, shown in its results")] = "Flight"
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
        share = share_at_limits(log, *limits) if limits else 0.0
        if len(log.rows) > 1:
            metrics["largest_error[m]"] = float(np.linalg.norm(position_errors(log), axis=1).max())
        if limits:
            metrics["saturated_share"] = share
        if limits and len(log.rows) > 1:
            metrics["largest_thrust_share"] = float(rotor_thrusts(log).sum(axis=1).max()) / (4.0 * limits[1])
        return metrics, [f"a rotor is at a limit {100 * share:.3g} % of the time"] if share else []

    def build(self, path: BuiltPath) -> Built:
        limits, rotors, vehicle = self.limits, self.vehicle.rotors.limits, self.vehicle.build()
        return Built(
            numbers=partial(
                Parameters,
                vehicle=vehicle,
                disturbance=self.disturbance.build(),
                limits=Limits(limits.distance, limits.rate, limits.pitch),
            ),
            start=self.start.state,
            warnings=lambda duration: [
                *self.vehicle.warnings(),
                *path_warnings(path, duration, vehicle.mass, vehicle.gravity, 4.0 * rotors[1] if rotors else math.inf),
            ],
        )

"""A mission: everything a flight needs, as a user writes it. Every key but the path has a default: the paper's study."""

import math
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, model_validator

from quadstep.analysis.metrics import lagrange_metrics, saturated_share
from quadstep.flight.closed_loop import Ticks
from quadstep.flight.engines import FlightPlan
from quadstep.flight.log import FlightLog
from quadstep.flight.loop import Limits, Loop, Parameters
from quadstep.mission.clock import ClockSection
from quadstep.mission.controllers import USUAL_CONTROLLER, AnyController
from quadstep.mission.derived import with_usual_rates
from quadstep.mission.fields import Finite, Name, Positive, Section, Triple
from quadstep.mission.paths import AnyPath
from quadstep.mission.tune import TuneSection
from quadstep.mission.vehicles import VehicleSection
from quadstep.numbers import Vector
from quadstep.report.drawing import FigureJob
from quadstep.report.panels import flight_jobs
from quadstep.vehicle.disturbance import Disturbance
from quadstep.vehicle.kinematics import Kinematics
from quadstep.vehicle.state import State


class StartSection(Section):
    """State at t = 0; what is left out follows the path (position, velocity, yaw) or is zero."""

    position: Triple | None = None
    velocity: Triple | None = None
    attitude: Triple | None = None
    rates: Triple = (0.0, 0.0, 0.0)

    @model_validator(mode="after")
    def _upright(self) -> "StartSection":
        if self.attitude and abs(self.attitude[1]) >= math.pi / 2.0:
            raise ValueError(f"attitude: theta must be inside (-pi/2, pi/2) rad, not {self.attitude[1]:g}")
        return self


class DisturbanceSection(Section):
    """The paper's disturbance (Eq. 67) times `scale`, plus constant force [N] and generalised torque [N m]."""

    scale: Finite = 1.0
    force: Triple = (0.0, 0.0, 0.0)
    torque: Triple = (0.0, 0.0, 0.0)


class SimulationSection(ClockSection):
    """Clock of the flight [s]."""

    control_period: Positive = 0.002

    def ticks(self, length: float) -> Ticks:
        """The clock of a flight along a path of `length` [s]. Raises UserError for a flight too long or too short."""
        return self.clock(length, [self.control_period])


class LimitsSection(Section):
    """When a flight counts as diverged: distance from the path [m], Euler rate [rad/s], |theta| short of 90 deg [rad]."""

    distance: Positive = 100.0
    rate: Positive = 100.0
    pitch: Annotated[float, Field(gt=0.0, lt=math.pi / 2.0)] = 1.57


class Mission(Section):
    """A mission file for the paper's plant."""

    name: Name = "Flight"
    vehicle: VehicleSection = VehicleSection()
    path: AnyPath
    controller: AnyController = USUAL_CONTROLLER
    start: StartSection = StartSection()
    disturbance: DisturbanceSection = DisturbanceSection()
    simulation: SimulationSection = SimulationSection()
    limits: LimitsSection = LimitsSection()
    tune: TuneSection | None = None

    @model_validator(mode="before")
    @classmethod
    def _rates(cls, content: Any) -> Any:
        return with_usual_rates(content, State, USUAL_CONTROLLER.type)

    def metrics(self, log: FlightLog) -> tuple[dict[str, Any], list[str]]:
        """What the flight was like, and warnings that only flying it could give."""
        metrics, limits = lagrange_metrics(log), self.vehicle.rotors.limits
        share = saturated_share(log, *limits) if limits else 0.0
        if limits:
            metrics["saturated_share"] = share
        return metrics, [f"a rotor is at a limit in {100 * share:.3g} % of the log rows"] if share else []

    def figures(self, log: FlightLog) -> list[FigureJob]:
        """What is drawn of a flight."""
        return flight_jobs(log, self.name)

    def plan(self, folder: Path = Path(), warn: bool = True) -> FlightPlan:
        """The flight this mission describes. Files it names are looked up from `folder`. Raises UserError.

        warn: whether to look for what is to be said against it.
        """
        path = self.path.build(folder)
        controller = self.controller.build(self.vehicle, folder)
        ticks = self.simulation.ticks(path.length)
        disturbance = self.disturbance
        loop = Loop(
            path=path.law,
            controller=controller.law,
            kinematics=Kinematics(self.vehicle.kinematics),
            rotor_limits=self.vehicle.rotors.limits is not None,
        )
        parameters = Parameters(
            vehicle=self.vehicle.build(),
            disturbance=Disturbance(disturbance.scale, Vector(disturbance.force), Vector(disturbance.torque)),
            path=path.parameters,
            gains=controller.gains,
            limits=Limits(self.limits.distance, self.limits.rate, self.limits.pitch),
        )
        warnings = [*self.controller.warnings(self.vehicle), *self.vehicle.warnings()] if warn else []
        wanted = path.law.reference(0.0, path.parameters)
        start = State(
            position=Vector(self.start.position) if self.start.position else wanted.position,
            velocity=Vector(self.start.velocity) if self.start.velocity else wanted.velocity,
            attitude=Vector(self.start.attitude) if self.start.attitude else Vector((wanted.yaw, 0.0, 0.0)),
            rates=Vector(self.start.rates),
        )
        return FlightPlan(loop, parameters, start, ticks, tuple(warnings))

"""A mission: everything a flight needs, as a user writes it. Every key but the path has a default: the paper's study."""

import math
from pathlib import Path
from typing import Annotated

from pydantic import AfterValidator, Field, model_validator

from quadstep.errors import UserError
from quadstep.flight.engines import FlightPlan
from quadstep.flight.closed_loop import Ticks
from quadstep.flight.loop import Limits, Loop, Parameters
from quadstep.mission.controllers import AnyController, BacksteppingSection
from quadstep.mission.fields import Finite, Positive, Section, Triple
from quadstep.mission.paths import AnyPath
from quadstep.mission.vehicles import VehicleSection
from quadstep.numbers import Vector
from quadstep.vehicle.disturbance import Disturbance
from quadstep.vehicle.kinematics import Kinematics
from quadstep.vehicle.state import State

MOST_ROWS = 500_000
MOST_STEPS = 200_000_000


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


class SimulationSection(Section):
    """Clock of the flight [s]. duration: the path's own length if left out."""

    duration: Positive | None = None
    step: Positive = 0.002
    control_period: Positive = 0.002
    log_period: Positive = 0.01

    @model_validator(mode="after")
    def _whole(self) -> "SimulationSection":
        for key, period in (("control_period", self.control_period), ("log_period", self.log_period)):
            ratio = period / self.step
            if round(ratio) < 1 or abs(ratio - round(ratio)) > 1e-6:
                raise ValueError(f"{key} = {period:g} s must be a whole multiple of step = {self.step:g} s")
        return self

    def ticks(self, length: float) -> Ticks:
        """The clock of a flight along a path of `length` [s]. Raises UserError for a flight too long or too short."""
        duration = self.duration or length
        steps, rows = round(duration / self.step), duration / self.log_period
        log = round(self.log_period / self.step)
        if not (log <= steps <= MOST_STEPS and rows <= MOST_ROWS):
            raise UserError(
                f"simulation.duration: {duration:g} s make {steps:.6g} steps and {rows:.6g} log rows; "
                f"allowed are 1 to {MOST_ROWS} rows and at most {MOST_STEPS} steps"
            )
        control = min(round(self.control_period / self.step), MOST_STEPS + 1)  # beyond the flight: one sample, at the start
        return Ticks(self.step, (control,), log, steps)


class LimitsSection(Section):
    """When a flight counts as diverged: distance from the path [m], Euler rate [rad/s], |theta| short of 90 deg [rad]."""

    distance: Positive = 100.0
    rate: Positive = 100.0
    pitch: Annotated[float, Field(gt=0.0, lt=math.pi / 2.0)] = 1.57


def printable(name: str) -> str:
    """Refuses line breaks and other control characters."""
    if not name.isprintable():
        raise ValueError("must be printable text in one line")
    return name


class Mission(Section):
    """A mission file."""

    name: Annotated[str, Field(max_length=200), AfterValidator(printable)] = "Flight"
    vehicle: VehicleSection = VehicleSection()
    path: AnyPath
    controller: AnyController = BacksteppingSection(type="backstepping")
    start: StartSection = StartSection()
    disturbance: DisturbanceSection = DisturbanceSection()
    simulation: SimulationSection = SimulationSection()
    limits: LimitsSection = LimitsSection()

    def plan(self, folder: Path = Path()) -> FlightPlan:
        """The flight this mission describes. Files it names are looked up from `folder`. Raises UserError."""
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
        warnings = [*controller.warnings, *self.vehicle.warnings()]
        wanted = path.law.reference(0.0, path.parameters)
        start = State(
            position=Vector(self.start.position) if self.start.position else wanted.position,
            velocity=Vector(self.start.velocity) if self.start.velocity else wanted.velocity,
            attitude=Vector(self.start.attitude) if self.start.attitude else Vector((wanted.yaw, 0.0, 0.0)),
            rates=Vector(self.start.rates),
        )
        return FlightPlan(loop, parameters, start, ticks, tuple(warnings))

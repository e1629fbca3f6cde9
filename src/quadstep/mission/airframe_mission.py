"""A mission for a real vehicle, as a user writes it."""

from pathlib import Path
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, model_validator

from quadstep.airframe.allocation import allocate
from quadstep.airframe.motion import AirframeState
from quadstep.analysis.airframe_metrics import airframe_metrics, rotor_thrusts
from quadstep.control.controller import Measured
from quadstep.errors import UserError
from quadstep.flight.airframe_loop import AirframeLimits, AirframeLoop, AirframeParameters
from quadstep.flight.engines import FlightPlan
from quadstep.flight.log import FlightLog
from quadstep.mission.air import WindSection
from quadstep.mission.airframe import AirframeSection
from quadstep.mission.airframe_controllers import USUAL_AIRFRAME_CONTROLLER, AnyAirframeController
from quadstep.mission.clock import ClockSection
from quadstep.mission.derived import with_usual_rates
from quadstep.mission.events import AnyEvent, build_events, check_events, event_warnings
from quadstep.mission.fields import Name, NonNegative, Positive, Section, Triple, as_tuple
from quadstep.mission.paths import AnyPath
from quadstep.mission.sensing import SensorsSection
from quadstep.mission.tune import TuneSection
from quadstep.numbers import Vector
from quadstep.numbers.noise import key
from quadstep.numbers.rotations import from_yaw_pitch_roll
from quadstep.report.airframe_panels import airframe_jobs
from quadstep.report.drawing import FigureJob


class AirframeStart(Section):
    """State at t = 0; what is left out follows the path (position, velocity, heading) or is zero.

    attitude: yaw, pitch, roll [rad], right-handed. rates: about the body's axes [rad/s]. The rotors turn as in hover, or
    stand.
    """

    position: Triple | None = None
    velocity: Triple | None = None
    attitude: Triple | None = None
    rates: Triple = (0.0, 0.0, 0.0)
    hovering: bool = True


class AirframeSimulation(ClockSection):
    """Clock of the flight [s]: of the attitude loop, the position loop and the turbulence."""

    control_period: Positive = 0.002
    guidance_period: Positive = 0.01
    air_period: Positive = 0.01


class AirframeLimitsSection(Section):
    """When a flight counts as lost: distance from the path [m], body rate [rad/s]."""

    distance: Positive = 100.0
    rate: Positive = 100.0


class AirframeMission(Section):
    """A mission file for a real vehicle: `vehicle` names a preset or a file."""

    name: Name = "Flight"
    seed: Annotated[int, Field(ge=0, lt=2**63)] = 1
    vehicle: AirframeSection
    path: AnyPath
    controller: AnyAirframeController = USUAL_AIRFRAME_CONTROLLER
    start: AirframeStart = AirframeStart()
    wind: WindSection = WindSection()
    sensors: SensorsSection = SensorsSection()
    events: Annotated[tuple[AnyEvent, ...], BeforeValidator(as_tuple), Field(max_length=16)] = ()
    simulation: AirframeSimulation = AirframeSimulation()
    limits: AirframeLimitsSection = AirframeLimitsSection()
    score_from: NonNegative = 0.0
    tune: TuneSection | None = None

    @model_validator(mode="before")
    @classmethod
    def _rates(cls, content: Any) -> Any:
        return with_usual_rates(content, Measured, USUAL_AIRFRAME_CONTROLLER.type)

    def metrics(self, log: FlightLog) -> tuple[dict[str, Any], list[str]]:
        """What the flight was like, and warnings that only flying it could give."""
        metrics = airframe_metrics(log, self.score_from)
        if len(log.rows) > 1:
            vehicle = self.vehicle.build()
            full = float(vehicle.allocation.most) * len(vehicle.geometry.mounts)
            metrics["largest_thrust_share"] = float(rotor_thrusts(log).sum(axis=1).max()) / full
        share = metrics.get("saturated_share", 0.0)
        return metrics, [
            f"the rotors' limits left less than was asked for in {100 * share:.3g} % of the log rows"
        ] if share else []

    def figures(self, log: FlightLog) -> list[FigureJob]:
        """What is drawn of a flight."""
        return airframe_jobs(log, self.name)

    def plan(self, folder: Path = Path(), warn: bool = True) -> FlightPlan:
        """The flight this mission describes. Files it names are looked up from `folder`. Raises UserError.

        warn: whether to look for what is to be said against it.
        """
        path, vehicle = self.path.build(folder), self.vehicle.build()
        simulation, duration = self.simulation, self.simulation.duration or path.length
        try:
            self.vehicle.check_step(simulation.step)
            self.sensors.check(duration)
            sensors = self.sensors.build(simulation.step, simulation.control_period, vehicle.airframe.gravity)
            self.wind.check(duration)
            check_events(self.events, len(vehicle.geometry.mounts), duration)
        except ValueError as error:
            raise UserError(str(error)) from None
        imu, fix = sensors.imu_steps * simulation.step, sensors.fix_steps * simulation.step
        periods = [imu, fix, simulation.guidance_period, simulation.control_period]
        ticks = simulation.clock(path.length, [simulation.air_period, *periods] if self.wind.turbulent else periods)
        last = ticks.last // ticks.log * ticks.log * ticks.step
        if self.score_from >= last:
            raise UserError(f"score_from: {self.score_from:g} s is not before the last row of the log at {last:g} s")
        controller = self.controller.build(vehicle, folder)
        loop = AirframeLoop(
            path=path.law,
            controller=controller.law,
            geometry=vehicle.geometry,
            effects=vehicle.effects,
            suite=sensors.suite,
            turbulent=self.wind.turbulent,
        )
        parameters = AirframeParameters(
            airframe=vehicle.airframe,
            allocation=vehicle.allocation,
            events=build_events(self.events, vehicle.airframe.mass),
            wind=self.wind.build(),
            sensors=sensors.sensors,
            key=key(self.seed, 0),
            path=path.parameters,
            gains=controller.gains,
            limits=AirframeLimits(self.limits.distance, self.limits.rate),
        )
        warnings: list[str] = []
        if warn:
            places = [mount.position for mount in vehicle.geometry.mounts]
            warnings += self.controller.warnings(vehicle) + self.vehicle.warnings()
            warnings += event_warnings(self.events, places) + self.wind.warnings()
        return FlightPlan(loop, parameters, self.begin(loop, parameters), ticks, tuple(warnings))

    def begin(self, loop: AirframeLoop, parameters: AirframeParameters) -> AirframeState:
        """The state at t = 0."""
        wanted, start = loop.path.reference(0.0, parameters.path), self.start
        weight = parameters.airframe.mass * parameters.airframe.gravity
        hover, _, _ = allocate(loop.geometry, parameters.allocation, weight, Vector((0.0, 0.0, 0.0)))
        return AirframeState(
            position=Vector(start.position) if start.position else wanted.position,
            velocity=Vector(start.velocity) if start.velocity else wanted.velocity,
            attitude=from_yaw_pitch_roll(Vector(start.attitude or (wanted.yaw, 0.0, 0.0))),
            rates=Vector(start.rates),
            speeds=hover if start.hovering else Vector(parameters.airframe.rotor.slowest for _ in hover),
            charge=0.0,
        )

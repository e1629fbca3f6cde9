"""A mission for a real vehicle, as a user writes it, and the events that change the vehicle in flight."""

import math
from collections.abc import Sequence
from functools import cached_property, partial
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from quadstep.control.geometric import Geometric
from quadstep.interfaces.controller import Measured
from quadstep.interfaces.log import FlightLog, Metric
from quadstep.interfaces.plant import Reference
from quadstep.io.errors import UserError
from quadstep.metrics.effort import EffortMetric
from quadstep.metrics.registry import Metrics, flight_metrics, rotor_metrics, warned
from quadstep.mission.air import AnyWind, WindSection
from quadstep.mission.airframe import AirframeSection, BuiltAirframe
from quadstep.mission.clock import ClockSection
from quadstep.mission.derived import ControllerSection, section_of
from quadstep.mission.fields import Angles, Name, NonNegative, Positive, Quantity, Section, Several, Share, Triple
from quadstep.mission.own_controller import any_controller
from quadstep.mission.own_thing import OwnMetrics
from quadstep.mission.paths import AnyPath, BuiltPath, path_warnings
from quadstep.mission.schema import Built, MarginsSection, Mission
from quadstep.mission.sensing import SensorsSection
from quadstep.mission.tune import TuneSection
from quadstep.numbers import Vector
from quadstep.numbers.noise import key
from quadstep.numbers.rotations import from_yaw_pitch_roll
from quadstep.report.panel import EventMark
from quadstep.vehicle.airframe_plant import Events, Payload, RotorFault
from quadstep.vehicle.allocation import allocate
from quadstep.vehicle.multirotor import AirframeLimits, AirframeParameters, Multirotor
from quadstep.vehicle.rigid_body import AirframeState

NEVER = 1e9
"""A time that no flight reaches [s]."""


class LastingSection(Section):
    """Something that lasts for a time."""

    time: Annotated[NonNegative, Quantity("s", "start of the event")]
    until: Annotated[Positive | None, Quantity("s", "end of the event; default: never")] = None

    def model_post_init(self, context: object) -> None:
        if self.until is not None and self.until <= self.time:
            raise ValueError(f"until = {self.until:g} s must be after time = {self.time:g} s")

    @property
    def end(self) -> float:
        """When it is over [s]."""
        return NEVER if self.until is None else self.until


class PayloadSection(LastingSection):
    """A point mass: it adds weight and inertia, and moves the centre of gravity."""

    type: Literal["payload"]
    began: ClassVar = "a payload was taken up", "payload"
    ended: ClassVar = "a payload was released", "released"
    mass: Annotated[Positive, Quantity("kg", "mass of the payload, a point mass")]
    position: Annotated[Triple, Quantity("m", "position of the payload in body axes")] = (0.0, 0.0, 0.0)

    def payloads(self, mass: float) -> list[Payload]:
        """The payload, on a vehicle of `mass` [kg]."""
        return [Payload(self.time, self.end, self.mass, Vector(self.position))]


class CentreSection(LastingSection):
    """The centre of gravity moves; the mass and the inertia about it stay the same.

    It is as if the whole vehicle but its rotors were moved: its mass is taken from the body's origin and put at `shift`.
    """

    type: Literal["centre-of-gravity"]
    began: ClassVar = "the centre of gravity moved", "shifted"
    ended: ClassVar = "the centre of gravity moved back", ""
    shift: Annotated[Triple, Quantity("m", "shift of the centre of gravity in body axes")]

    def payloads(self, mass: float) -> list[Payload]:
        """Two payloads that move `mass` [kg]."""
        return [
            Payload(self.time, self.end, -mass, Vector((0.0, 0.0, 0.0))),
            Payload(self.time, self.end, mass, Vector(self.shift)),
        ]


class RotorFaultSection(Section):
    """A rotor that makes less thrust and torque than its speed should."""

    type: Literal["rotor"]
    began: ClassVar = "the fault of a rotor began", "rotor fault"
    ended: ClassVar = "", ""
    end: ClassVar = NEVER
    time: Annotated[NonNegative, Quantity("s", "start of the event")]
    rotor: Annotated[int, Field(ge=1), Quantity("", "number of the rotor, counted from 1")]
    efficiency: Annotated[Share, Quantity("", "remaining share of thrust and torque")]


AnyEvent = Annotated[PayloadSection | CentreSection | RotorFaultSection, Field(discriminator="type")]


def check_events(events: Sequence[AnyEvent], rotors: int, duration: float) -> None:
    """Raises ValueError for an event that this vehicle of `rotors` rotors, or a flight of `duration` [s], does not have."""
    for place, event in enumerate(events):
        if event.time >= duration:
            raise ValueError(f"events[{place}].time: {event.time:g} s is not before the flight's end at {duration:g} s")
        if isinstance(event, RotorFaultSection) and event.rotor > rotors:
            raise ValueError(f"events[{place}].rotor: {event.rotor} is not one of the vehicle's rotors, 1 to {rotors}")


def build_events(events: Sequence[AnyEvent], mass: float) -> Events:
    """The events as numbers, for a vehicle of `mass` [kg]."""
    payloads = [payload for event in events if not isinstance(event, RotorFaultSection) for payload in event.payloads(mass)]
    faults = [
        RotorFault(event.time, float(event.rotor - 1), event.efficiency)
        for event in events
        if isinstance(event, RotorFaultSection)
    ]
    return Events(payloads=tuple(payloads), faults=tuple(faults))


TOO_LATE = 0.1
"""Before the end of a flight, in which no grade need show what comes of an event [s]."""


def event_warnings(
    events: Sequence[AnyEvent], places: Sequence[tuple[float, float, float]], duration: float = math.inf
) -> list[str]:
    """Events that no controller could fly with: a centre of gravity beyond all rotors; and those that a flight of `duration`
    [s] does not show. places: of the rotors [m].
    """
    reach = max(Vector(place).norm() for place in places)
    late = [
        f"events[{place}].time: {event.time:g} s is just before the end at {duration:g} s, so its effect hardly shows"
        for place, event in enumerate(events)
        if duration - event.time < TOO_LATE
    ]
    return late + [
        f"events[{place}].shift: {Vector(event.shift).norm():g} m is beyond the rotors, at {reach:g} m"
        for place, event in enumerate(events)
        if isinstance(event, CentreSection) and Vector(event.shift).norm() >= reach
    ]


USUAL_AIRFRAME_CONTROLLER = section_of(Geometric)(type="geometric")

if TYPE_CHECKING:
    AnyAirframeController = ControllerSection
else:
    AnyAirframeController = any_controller(Measured)


class AirframeStart(Section):
    """State at t = 0; what is left out follows the path or is zero. Angles are right-handed."""

    position: Annotated[Triple | None, Quantity("m", "position; default: the path's")] = None
    velocity: Annotated[Triple | None, Quantity("m/s", "velocity; default: the path's")] = None
    attitude: Annotated[Angles | None, Quantity("rad", "yaw, pitch, roll; default: the path's heading, level")] = None
    rates: Annotated[Triple, Quantity("rad/s", "roll, pitch, yaw about the body axes (p, q, r)")] = (0.0, 0.0, 0.0)
    hovering: Annotated[bool, Quantity("", "whether rotors start at hover speed; false: at idle")] = True

    def state(self, vehicle: BuiltAirframe, reference: Reference, moving: bool) -> AirframeState:
        """The state at t = 0. moving: whether it flies along the path already; else it is at rest, as before a take-off."""
        weight, still = vehicle.airframe.mass * vehicle.airframe.gravity, Vector((0.0, 0.0, 0.0))
        hover, _, _ = allocate(vehicle.geometry, vehicle.allocation, weight, still)
        velocity = reference.velocity if moving else still
        return AirframeState(
            position=Vector(self.position) if self.position else reference.position,
            velocity=Vector(self.velocity) if self.velocity else velocity,
            attitude=from_yaw_pitch_roll(Vector(self.attitude or (reference.yaw, 0.0, 0.0))),
            rates=Vector(self.rates),
            speeds=hover if self.hovering else Vector(vehicle.airframe.rotor.slowest for _ in hover),
            charge=0.0,
        )


class AirframeSimulation(ClockSection):
    """Clock of the flight."""

    control_period: Annotated[Positive, Quantity("s", "sampling period of the attitude loop")] = 0.002
    guidance_period: Annotated[Positive, Quantity("s", "sampling period of the position loop")] = 0.01
    air_period: Annotated[Positive, Quantity("s", "sampling period of the turbulence")] = 0.01


class AirframeLimitsSection(Section):
    """Bounds beyond which a flight is lost."""

    distance: Annotated[Positive, Quantity("m", "largest distance from the path")] = 100.0
    rate: Annotated[Positive, Quantity("rad/s", "largest rate about a body axis")] = 100.0


class MultirotorMission(Mission):
    """A mission file for a real vehicle: `vehicle` names a preset or a file."""

    name: Annotated[Name, Quantity("", "name of the flight, shown in its results; default: the file's name")] = "Flight"
    seed: Annotated[int, Field(ge=0, lt=2**63), Quantity("", "seed of all noise and turbulence")] = 1
    vehicle: AirframeSection
    path: AnyPath
    controller: AnyAirframeController = USUAL_AIRFRAME_CONTROLLER
    start: AirframeStart = AirframeStart()
    wind: AnyWind = WindSection()
    sensors: SensorsSection = SensorsSection()
    events: Annotated[Several[AnyEvent], Field(max_length=16)] = ()
    simulation: AirframeSimulation = AirframeSimulation()
    limits: AirframeLimitsSection = AirframeLimitsSection()
    score_from: Annotated[NonNegative, Quantity("s", "time from which errors count")] = 0.0
    metrics: OwnMetrics = ()
    margins: MarginsSection = MarginsSection()
    tune: TuneSection | None = None

    measures: ClassVar = Measured
    with_rotors: ClassVar = True

    @cached_property
    def modelled(self) -> BuiltAirframe:
        return self.vehicle.build(
            self.sensors.imu_latency, self.sensors.age - self.sensors.imu_latency, self.simulation.control_period
        )

    @property
    def plant(self) -> Multirotor:
        failing = any(isinstance(event, RotorFaultSection) for event in self.events)
        return Multirotor(self.modelled.geometry, self.modelled.effects, failing)

    @property
    def own_metrics(self) -> tuple[Metric, ...]:
        named = super().own_metrics
        if not any(isinstance(one, EffortMetric) for one in named):
            return named
        airframe, rotors = self.modelled.airframe, len(self.modelled.geometry.mounts)
        return tuple(one.of_vehicle(airframe, rotors) if isinstance(one, EffortMetric) else one for one in named)

    @property
    def random(self) -> list[str]:
        sampled = "noise" in self.controller.controller.also_measures
        parts = (
            ("the turbulence", self.wind.air.stirs),
            ("the sensors' noise", self.sensors.noisy),
            ("the law's samples", sampled),
        )
        return [name for name, there in parts if there]

    @property
    def latency(self) -> float:
        return self.sensors.age + self.vehicle.command_delay

    @property
    def scored_from(self) -> float:
        return self.score_from

    @property
    def arm(self) -> float:
        return max(math.hypot(*mount.position) for mount in self.modelled.geometry.mounts)

    @property
    def moments(self) -> list[EventMark]:
        gust = self.wind.gust if isinstance(self.wind, WindSection) else None
        begun = [EventMark(one.time, *one.began, one.end) for one in self.events]
        ended = [EventMark(one.end, *one.ended) for one in self.events]
        if gust:
            begun.append(EventMark(gust.start, "the gust began", "gust", gust.start + gust.length))
            ended.append(EventMark(gust.start + gust.length, "the gust ended"))
        return [*begun, *ended] or super().moments

    def plant_metrics(self, log: FlightLog) -> tuple[Metrics, list[str]]:
        metrics = flight_metrics(log, self.score_from, arm=self.arm)
        limits = self.modelled.allocation
        asked = log.table("u", "tau_x", "tau_y", "tau_z") @ np.array(limits.matrix).T
        return warned(metrics | rotor_metrics(log, asked, float(limits.least), float(limits.most)))

    def build(self, path: BuiltPath) -> Built:
        vehicle, simulation = self.modelled, self.simulation
        duration, rotors = simulation.duration or path.length, len(vehicle.geometry.mounts)
        try:
            self.vehicle.check_step(simulation.step)
            self.sensors.check(duration)
            asked = self.controller.controller.also_measures
            sensors = self.sensors.build(simulation.step, simulation.control_period, vehicle.airframe.gravity, asked)
            self.wind.check(duration)
            check_events(self.events, rotors, duration)
            late = self.vehicle.samples_late(simulation.control_period)
        except ValueError as error:
            raise UserError(str(error)) from None
        return Built(
            periods={
                "air": simulation.air_period,
                "sensing": sensors.imu_steps * simulation.step,
                "fix": sensors.fix_steps * simulation.step,
            },
            numbers=partial(
                AirframeParameters,
                airframe=vehicle.airframe,
                allocation=vehicle.allocation,
                events=build_events(self.events, vehicle.airframe.mass),
                wind=self.wind.build(),
                sensors=sensors.sensors,
                key=key(self.seed, 0),
                limits=self.limits.as_numbers(AirframeLimits),
            ),
            start=partial(self.start.state, vehicle, moving=not self.controller.controller.one_at_a_time),
            air=self.wind.air,
            sensing=sensors.suite,
            guided=True,
            late=late,
            fitted=partial(self.sensors.fitted, oldest=sensors.oldest, gravity=vehicle.airframe.gravity),
            warnings=partial(warnings, self.vehicle, vehicle, self.events, self.wind, path),
        )


def warnings(
    section: AirframeSection, vehicle: BuiltAirframe, events: Sequence[AnyEvent], wind: AnyWind,
    path: BuiltPath, duration: float,
) -> list[str]:  # fmt: skip
    """What speaks against vehicle, events, wind and path in a flight of `duration` [s]."""
    places = [mount.position for mount in vehicle.geometry.mounts]
    airframe, most = vehicle.airframe, float(vehicle.allocation.most) * len(places)
    return [
        *section.warnings(),
        *section.doubts(),
        *event_warnings(events, places, duration),
        *wind.warnings(),
        *path_warnings(path, duration, float(airframe.mass), float(airframe.gravity), most, float(airframe.ground)),
    ]

"""The vehicle section of a mission that flies a real airframe: a preset or your own file, and keys that override it."""

import math
from pathlib import Path
from typing import Annotated, Literal, NamedTuple

from pydantic import Field, ValidationInfo, model_validator

from quadstep.interfaces.plant import MARGIN, Model
from quadstep.mission.airframe_tables import (
    MOST_LATE,
    BatterySection,
    CommandSection,
    DragSection,
    EffectsSection,
    ImuSection,
    MountSection,
    PredictionSection,
    ResidualSection,
    RotorSection,
)
from quadstep.mission.fields import Finite, Positive, PositiveTriple, Quantity, Section, Several, check_rigid
from quadstep.mission.presets import completed
from quadstep.numbers import Number, cos, maximum, sin, total
from quadstep.vehicle.airframe_plant import NO_DRAG, Airframe, hover_drag
from quadstep.vehicle.allocation import Allocation, allocation, mixing, rank
from quadstep.vehicle.multirotor import LATE, agility
from quadstep.vehicle.rigid_body import Effects, Geometry, Mount, contact
from quadstep.vehicle.rotor import Battery, Drag

FEWEST, MOST = 4, 8
"""How many rotors a vehicle may have."""

NO_GROUND = -1e9
"""A height that no flight reaches [m]."""

LAYOUTS = {
    "x": (4, 0.5), "plus": (4, 0.0), "hexa-x": (6, 0.5), "hexa-plus": (6, 0.0), "octo-x": (8, 0.5), "octo-plus": (8, 0.0),
}  # fmt: skip
"""Number of rotors, and how far rotor 1 stands to the left of straight ahead, in steps from one rotor to the next."""


class BuiltAirframe(NamedTuple):
    """A vehicle for a flight: structure, and numbers. delay: from a sample of the gyro to the rotors' command [s], half of the
    law's period included. stale: how much older position, velocity and attitude are [s].
    """

    geometry: Geometry
    effects: Effects
    airframe: Airframe
    allocation: Allocation
    delay: Number
    stale: Number = 0.0

    def model(self) -> Model:
        airframe, rotors = self.airframe, len(self.geometry.mounts)
        rotor = airframe.rotor
        pace = agility(self.geometry, airframe, self.allocation, self.delay, self.stale)
        return Model(
            mass=airframe.mass,
            inertia=airframe.inertia,
            gravity=airframe.gravity,
            most_thrust=MARGIN * rotors * self.allocation.most,
            agility=pace.all,
            rate_agility=pace.rates,
            yaw_agility=pace.yaw,
            rotors=rotors,
            lag=maximum(rotor.rise, rotor.fall),
            mixing=mixing(self.geometry, rotor.torque / rotor.thrust),
            shares=self.allocation.matrix,
            per_speed=rotor.thrust,
            slowest=rotor.slowest,
            fastest=rotor.fastest,
            drag=hover_drag(self.geometry, airframe, self.allocation) if self.effects.drag else NO_DRAG,
            lift=rotors * airframe.drag.translational_lift / airframe.mass if self.effects.drag else 0.0,
        )


class AirframeSection(Section):
    """A real airframe. `preset` or `file` names what it starts from; any other key overrides its value.

    Its rotors are placed by `layout` and `arm`, or one by one by `rotors`.
    """

    preset: Annotated[str | None, Quantity("", "preset to start from; `quadstep vehicles` lists them")] = None
    file: Annotated[str | None, Quantity("", "vehicle file to start from")] = None
    description: Annotated[str, Quantity("", "description in one line")] = ""
    mass: Annotated[Positive, Quantity("kg", "total mass")]
    inertia: Annotated[
        PositiveTriple, Quantity("kg m^2", "moments of inertia about body x, y, z through the centre of gravity")
    ]
    gravity: Annotated[Positive, Quantity("m/s^2", "gravitational acceleration")] = 9.81
    layout: Annotated[
        Literal["x", "plus", "hexa-x", "hexa-plus", "octo-x", "octo-plus"] | None,
        Quantity("", "arrangement of the rotors, with arm; or give a list of rotors"),
    ] = None
    arm: Annotated[Positive | None, Quantity("m", "distance from the centre of gravity to each rotor")] = None
    rotors: Several[MountSection] = ()
    rotor: RotorSection
    drag: DragSection = DragSection()
    battery: BatterySection | None = None
    command: CommandSection | None = None
    imu: ImuSection | None = None
    prediction: PredictionSection | None = None
    guided_prediction: Annotated[PredictionSection | None, Quantity("", "as `prediction`, for logs with setpoints")] = None
    residual: ResidualSection | None = None
    ground: Annotated[Finite | None, Quantity("m", "height of the ground; default: no ground")] = None
    legs: Annotated[
        Positive | None,
        Quantity("m", "height of the origin when standing; without legs, touching the ground ends the flight"),
    ] = None
    effects: EffectsSection = EffectsSection()
    undetermined: Annotated[
        Several[str], Quantity("", "keys that the flights from which the vehicle was identified do not determine")
    ] = ()
    identified_from: Annotated[dict[str, str], Quantity("", "marks of the flights it was identified from, by name")] = Field(
        default_factory=dict
    )
    sources: Annotated[dict[str, str], Quantity("", "sources of the numbers, by key")] = Field(default_factory=dict)

    @model_validator(mode="before")
    @classmethod
    def _completed(cls, table: object, info: ValidationInfo) -> object:
        folder = (info.context or {}).get("folder", Path())
        return completed(table, folder) if isinstance(table, dict) else table

    def model_post_init(self, context: object) -> None:
        check_rigid(self.inertia)
        self._check_places()
        self._check_authority()
        if self.effects.battery and self.battery is None:
            raise ValueError("effects.battery = true needs a table battery")
        if self.effects.ground and self.ground is None:
            raise ValueError("effects.ground = true needs the height `ground` of the ground")
        if self.legs is not None and self.ground is None:
            raise ValueError("legs need the height `ground` of the ground on which they stand")

    def _check_places(self) -> None:
        if self.rotors and (self.layout or self.arm):
            raise ValueError("rotors are placed either by layout and arm or by a list of rotors, not both")
        if not self.rotors and not (self.layout and self.arm):
            raise ValueError(f"rotors: missing; give layout ({', '.join(LAYOUTS)}) and arm, or a list of rotors")
        if self.rotors and not FEWEST <= len(self.rotors) <= MOST:
            raise ValueError(f"rotors: {len(self.rotors)} given; allowed: {FEWEST} to {MOST}")

    def _check_authority(self) -> None:
        geometry, rotor = self.geometry(), self.rotor.build()
        if rank(geometry, rotor.torque / rotor.thrust) < 4:
            if len({mount.spin for mount in geometry.mounts}) == 1:
                raise ValueError("rotors: all spin the same way, so there is no yaw torque; some must spin the other way")
            raise ValueError(
                "rotors: these cannot produce thrust, roll, pitch and yaw torque independently; "
                "change their positions or directions of spin"
            )
        for number, share in enumerate(allocation(geometry, rotor).matrix, start=1):
            if share[0] < 1e-6:
                raise ValueError(
                    f"rotors: rotor {number} would carry no load in hover, or push down; "
                    "place the rotors around the centre of gravity, with axes up"
                )

    def geometry(self) -> Geometry:
        """Where the rotors are, as structure."""
        if self.rotors:
            return Geometry(tuple(mount.build() for mount in self.rotors))
        assert self.layout and self.arm
        return Geometry(laid_out(self.layout, self.arm))

    def warnings(self) -> list[str]:
        """Limits with which no controller could hover."""
        geometry, weight = self.geometry(), self.mass * self.gravity
        allocated = allocation(geometry, self.rotor.build())
        upward = total(mount.axis[2] for mount in geometry.mounts)
        if upward * allocated.most <= weight:
            most = upward * allocated.most
            mass, speed = most / self.gravity, self.rotor.fastest * math.sqrt(weight / most)
            could = f"it could with a mass below {mass:.4g} kg, or rotor.fastest above {speed:.4g} rad/s"
            why = f"{self.mass:g} kg weigh {weight:.4g} N, its rotors lift at most {most:.4g} N"
            return [f"vehicle.mass: it cannot hover: {why}; {'is the mass in grams?' if weight > 100.0 * most else could}"]
        if upward * allocated.least >= weight:
            least = upward * allocated.least
            return [f"vehicle.rotor.slowest: the rotors lift at least {least:g} N, the weight is {weight:g} N"]
        carried = [share[0] * weight for share in allocated.matrix]
        return [
            f"vehicle.rotors: rotor {number} carries {thrust:g} N in hover, its limits are {allocated.least:g} and "
            f"{allocated.most:g} N"
            for number, thrust in enumerate(carried, start=1)
            if not allocated.least <= thrust <= allocated.most
        ]

    def doubts(self) -> list[str]:
        """What of an identified vehicle its flights left open."""
        keys = ", ".join(self.undetermined)
        return [f"vehicle: the flights from which it was identified do not determine {keys}"] if keys else []

    def samples_late(self, period: float) -> int:
        """Samples of the law, every `period` [s], until the rotors are told: a command is held for a period, half of which is
        delay already. Raises ValueError where there are too many.
        """
        delay = self.command_delay
        count = round(max(delay - 0.5 * period, 0.0) / period)
        if count > MOST_LATE:
            raise ValueError(
                f"vehicle.command.delay = {delay:g} s is {count} times simulation.control_period; allowed: at most {MOST_LATE}"
            )
        return count

    def check_step(self, step: float) -> None:
        """Raises ValueError if a rotor is too quick for steps of `step` [s]: Runge-Kutta 4 bears 2.78 time constants."""
        quickest = min(self.rotor.rise_time, self.rotor.fall_time)
        if step > 2.5 * quickest:
            raise ValueError(
                f"vehicle.rotor: a time constant of {quickest:g} s is too short for simulation.step = {step:g} s; "
                f"steps of at most {2.5 * quickest:g} s are allowed"
            )
        if self.legs is not None and step > LONGEST_ON_LEGS:
            raise ValueError(f"vehicle.legs needs a simulation.step of at most {LONGEST_ON_LEGS:g} s, and it is {step:g} s")

    def model(self) -> Model:
        """What it is to a controller of the usual period."""
        return self.build().model()

    @property
    def command_delay(self) -> float:
        """From a command to the rotors [s]."""
        return self.command.delay if self.command else 0.0

    def build(self, age: float = 0.0, stale: float = 0.0, period: float = 2.0 * LATE) -> BuiltAirframe:
        """The vehicle as structure and numbers. age: of the gyro's samples [s]. stale: how much older the other measurements
        are [s]. period: of its law [s].
        """
        geometry, rotor = self.geometry(), self.rotor.build()
        airframe = self.as_numbers(
            Airframe,
            rotor=rotor,
            drag=self.drag.as_numbers(Drag),
            battery=(self.battery or UNUSED_BATTERY).as_numbers(Battery),
            ground=NO_GROUND if self.ground is None else self.ground,
            residual=self.residual.build() if self.residual and self.effects.residual else (),
            contact=contact(self.legs, self.mass, self.gravity, len(geometry.mounts)) if self.legs is not None else (),
        )
        delay = age + self.command_delay + 0.5 * period
        return BuiltAirframe(geometry, self.effects.as_numbers(Effects), airframe, allocation(geometry, rotor), delay, stale)


LONGEST_ON_LEGS = 0.004
"""Step [s] in which legs and their friction stay stable."""

UNUSED_BATTERY = BatterySection(full=2.0, empty=1.0, capacity=1.0, resistance=0.0, efficiency=1.0)


def laid_out(layout: str, arm: float) -> tuple[Mount, ...]:
    """The mounts of a named layout, evenly around a circle of radius `arm` [m], numbered counter-clockwise seen from above.

    The first is at the front or to the left of it and turns clockwise, the next counter-clockwise, and so on.
    """
    count, ahead = LAYOUTS[layout]
    angles = [2.0 * math.pi * (i + ahead) / count for i in range(count)]
    places = [(arm * round(cos(angle), 12) + 0.0, arm * round(sin(angle), 12) + 0.0, 0.0) for angle in angles]
    return tuple(Mount(place, (0.0, 0.0, 1.0), 1 if i % 2 else -1) for i, place in enumerate(places))

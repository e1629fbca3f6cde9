"""An autopilot at the other end of a socket as a controller: `type = "px4"`, `"ardupilot"` or `"betaflight"` in a mission.

What it must be told of the vehicle that it flies (frame, motors, thrust curve) is written as its own parameter file.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import Annotated, ClassVar, Literal, NamedTuple, Self

from pydantic import AfterValidator

from quadstep.bridges import ardupilot, betaflight, px4
from quadstep.bridges.ardupilot import ArduPilot
from quadstep.bridges.betaflight import Betaflight, Sticks, console
from quadstep.bridges.link import Address, AutopilotLink, GroundStation, PilotFunction, address, sample_of
from quadstep.bridges.pilot import STATIONS, Pilot, Station
from quadstep.bridges.px4 import Px4
from quadstep.control.mixers import quarters
from quadstep.control.opaque import NoGains, Opaque
from quadstep.engines.fly import FlightPlan
from quadstep.interfaces.controller import Controller, Measured, RotorSpeeds
from quadstep.interfaces.plant import Model, Reference
from quadstep.io.errors import UserError
from quadstep.io.parameter_files import FORMATS
from quadstep.mission.derived import BuiltController, ModelledVehicle
from quadstep.mission.fields import Quantity
from quadstep.mission.own_controller import FIRST_WAIT, PilotedSection
from quadstep.numbers import Number, Vector
from quadstep.numbers.scan import call, raise_pending, register
from quadstep.vehicle.multirotor import AirframeParameters, Multirotor
from quadstep.vehicle.rigid_body import Geometry, Mount

QUADS = {
    1: ("X", ((45.0, 1), (-135.0, 1), (-45.0, -1), (135.0, -1))),
    18: ("X, motors in Betaflight's order, turning the other way", ((135.0, 1), (45.0, -1), (-135.0, -1), (-45.0, 1))),
    0: ("plus", ((90.0, 1), (-90.0, 1), (0.0, -1), (180.0, -1))),
}
"""ArduPilot's `FRAME_TYPE` of quadrotors: in the order of its motors, degrees to the right of the nose, and spin."""

NEAR = 20.0
"""Degrees by which an arm may deviate from a frame's."""

FIRST_MOTOR = 33
"""`SERVOn_FUNCTION` of ArduPilot's motor 1."""

PX4_FIRST_MOTOR = 101


HEAD = "# The vehicle of this mission: what must match. Written by quadstep.\n"


class AutopilotSettings(NamedTuple):
    """Parameters by name: of the frame, and of the thrust curve. file: name of the autopilot's own file of them. note: what
    they do not settle; may be empty. more: lines of that file that set no parameter.
    """

    frame: Mapping[str, float]
    curve: Mapping[str, float]
    file: str
    note: str = ""
    more: str = ""

    @property
    def parameters(self) -> dict[str, float]:
        return {**self.frame, **self.curve}

    def sentence(self) -> str:
        return "The autopilot's parameters must be " + ", ".join(
            f"{name} {value:g}" for name, value in self.parameters.items()
        )

    def text(self) -> str:
        """The file: ArduPilot's, QGroundControl's for PX4, lines for Betaflight's command line."""
        head = HEAD + (f"# {self.note}\n" if self.note else "")
        form = FORMATS.load(self.file.partition(".")[0])
        return head + self.more + str(form.write(self.parameters, {}))


def bearing(mount: Mount) -> float:
    """Of an arm, degrees to the right of the nose."""
    x, y, _ = mount.position
    return math.degrees(math.atan2(-y, x))


def motor_of(mount: Mount, frame: Sequence[tuple[float, int]]) -> int | None:
    """The frame's motor, from 0, at the place of a rotor with its spin; None where there is none."""
    for motor, (angle, spin) in enumerate(frame):
        apart = abs((bearing(mount) - angle + 180.0) % 360.0 - 180.0)
        if apart < NEAR and spin == mount.spin:
            return motor
    return None


def hover_share(p: AirframeParameters, geometry: Geometry) -> float:
    """The share of all rotors' largest thrust that carries the vehicle."""
    return float(p.airframe.mass * p.airframe.gravity / p.allocation.most) / len(geometry.mounts)


def for_ardupilot(p: AirframeParameters, geometry: Geometry) -> AutopilotSettings:
    """Of ArduPilot: the frame, the motor of each output, a thrust that goes with the square of the pulse."""
    curve = {"MOT_THST_EXPO": 1.0, "MOT_SPIN_ARM": 0.0, "MOT_SPIN_MIN": 0.0, "MOT_SPIN_MAX": 1.0, "MOT_PWM_MIN": 1000.0}
    curve |= {"MOT_PWM_MAX": 2000.0, "MOT_BAT_VOLT_MAX": 0.0, "MOT_THST_HOVER": round(hover_share(p, geometry), 4)}
    for frame_type, (_, frame) in QUADS.items():
        motors = [motor_of(mount, frame) for mount in geometry.mounts]
        if len(motors) == len(frame) and None not in motors:
            frames = {"FRAME_CLASS": 1.0, "FRAME_TYPE": float(frame_type)}
            outputs = {f"SERVO{i}_FUNCTION": float(FIRST_MOTOR + (motor or 0)) for i, motor in enumerate(motors, 1)}
            return AutopilotSettings({**frames, **outputs}, curve, "ardupilot.parm")
    note = (
        "No quadrotor frame of ArduPilot has these arms and spins: set FRAME_CLASS, FRAME_TYPE and SERVOn_FUNCTION yourself."
    )
    return AutopilotSettings({}, curve, "ardupilot.parm", note)


def for_px4(p: AirframeParameters, geometry: Geometry) -> AutopilotSettings:
    """Of PX4: the rotors where they are, in the mission's order, and a thrust that goes with the square of the output."""
    moment = float(p.airframe.rotor.torque / p.airframe.rotor.thrust)
    frame = {"CA_AIRFRAME": 0.0, "CA_ROTOR_COUNT": float(len(geometry.mounts))}
    for i, mount in enumerate(geometry.mounts):
        x, y, z = mount.position
        frame |= {f"CA_ROTOR{i}_PX": x, f"CA_ROTOR{i}_PY": -y, f"CA_ROTOR{i}_PZ": -z, f"CA_ROTOR{i}_KM": mount.spin * moment}
    frame |= {f"PWM_MAIN_FUNC{i}": float(PX4_FIRST_MOTOR + i - 1) for i in range(1, len(geometry.mounts) + 1)}
    curve = {"THR_MDL_FAC": 1.0, "MPC_THR_HOVER": round(hover_share(p, geometry), 4)}
    return AutopilotSettings({name: value + 0.0 for name, value in frame.items()}, curve, "px4.params")


def for_betaflight(p: AirframeParameters, geometry: Geometry) -> AutopilotSettings:  # noqa: ARG001 (as for the others)
    """Of Betaflight: a loop at 1 kHz, its directions of spin, motors that are on, and a switch that arms."""
    mirrored = any(x > 0.0 > y and mount.spin < 0 for mount in geometry.mounts for x, y, _ in [mount.position])
    frame = {"pid_process_denom": 8.0, "yaw_motors_reversed": float(mirrored), "motor_pwm_protocol": 0.0}
    return AutopilotSettings(frame, {}, "betaflight.txt", more="aux 0 0 0 1700 2100 0 0\n")


Say = Callable[[str], None]
"""Hears what is waited for."""


class AutopilotKind(NamedTuple):
    """An autopilot that is spoken to. link: waits for it somewhere, so long [s]; port: where it is expected. matching: what it
    must be told of a vehicle. station: leads it; needs: a module that this imports. order: of the vehicle's rotors in its
    answers, where it has one of its own. period: the only one that the law may have [s]. Raises UserError for a vehicle that
    it cannot fly.
    """

    link: Callable[[Address, float], AutopilotLink]
    port: int
    matching: Callable[[AirframeParameters, Geometry], AutopilotSettings]
    station: Callable[[PilotFunction, Address, FlightPlan, Model, AutopilotSettings, str, Say], GroundStation]
    needs: str | None = "pymavlink.mavutil"
    order: Callable[[Model], tuple[int, ...]] = lambda model: tuple(range(model.rotors))
    period: float | None = None


def by_mavlink(
    station: Station, _: PilotFunction, __: Address, plan: FlightPlan, ___: Model, settings: AutopilotSettings, where: str,
    say: Say,
) -> GroundStation:  # fmt: skip
    return Pilot(station, where, plan, settings.frame, settings.curve, say)


def by_sticks(
    one: PilotFunction, motors: Address, plan: FlightPlan, model: Model, settings: AutopilotSettings, where: str, say: Say
) -> GroundStation:
    """By the sticks of a remote control, with Betaflight's console."""
    return Sticks(plan, model, console(where), settings.frame, motors.port, lambda: one.last, say)


KINDS = {
    "px4": AutopilotKind(Px4, px4.PORT, for_px4, partial(by_mavlink, STATIONS["px4"])),
    "ardupilot": AutopilotKind(ArduPilot, ardupilot.PORT, for_ardupilot, partial(by_mavlink, STATIONS["ardupilot"])),
    "betaflight": AutopilotKind(Betaflight, betaflight.PORT, for_betaflight, by_sticks, None,
        lambda model: quarters(model, "betaflight")[0], Betaflight.period),
}  # fmt: skip


class PilotedGains(NamedTuple):
    """handle: of the connection. lift: the weight over the largest thrust of one rotor."""

    handle: Number
    lift: Number


@dataclass(frozen=True)
class PilotedLaw(Opaque[PilotedGains, RotorSpeeds]):
    """Asks the autopilot how fast the rotors should turn. rotors: how many."""

    rotors: int = 4

    name = "autopilot"
    label = "an autopilot through its simulator's interface"
    nature = "another program"
    Gains = NoGains
    commands = RotorSpeeds
    also_measures = ("specific_force", "full_speed")
    one_at_a_time = True

    @classmethod
    def for_vehicle(cls, model: Model) -> Self:
        return cls(model.rotors)

    def law(
        self, memory: tuple[()], measured: Measured, reference: Reference, gains: PilotedGains, t: Number, period: Number
    ) -> tuple[RotorSpeeds, tuple[()]]:
        shares = call(gains.handle, sensor_readings(t, measured), self.rotors)
        return RotorSpeeds(Vector(measured.full_speed * share for share in shares)), memory

    def before_flight(self, measured: Measured, gains: PilotedGains) -> None:
        """Connect, and wait until the autopilot takes off. Raises UserError where none comes, or it does not."""
        first = sample_of([float(one) for one in sensor_readings(0.0, measured)])
        CONNECTIONS[int(gains.handle)].begin(first, self.rotors, float(gains.lift))

    def after_flight(self, gains: PilotedGains) -> None:
        """Hang up; raises what the connection raised."""
        CONNECTIONS[int(gains.handle)].end()
        raise_pending(int(gains.handle))

    def why_lost(self, gains: PilotedGains) -> str:
        """Why the autopilot did not finish the last flight."""
        return CONNECTIONS[int(gains.handle)].lost


def sensor_readings(t: Number, measured: Measured) -> list[Number]:
    """What an autopilot is told, in our axes."""
    motion = (measured.position, measured.velocity, measured.attitude, measured.rates, measured.specific_force)
    return [t, *(entry for vector in motion for entry in vector)]


CONNECTIONS: dict[int, PilotFunction] = {}
"""By handle; they are never forgotten."""


@cache
def connection(autopilot: str, where: Address, order: tuple[int, ...]) -> int:
    """The handle of the connection to an autopilot, the same for all flights. order: of its answers."""
    piloted = PilotFunction(lambda wait: KINDS[autopilot].link(where, wait), order)
    handle = register(piloted)
    CONNECTIONS[handle] = piloted
    return handle


def checked_address(text: str) -> str:
    """Refuses what is no address. Raises ValueError."""
    try:
        address(text, 1)
    except UserError as error:
        raise ValueError(str(error)) from None
    return text


class AutopilotSection(PilotedSection):
    """An autopilot that you start, flown in lockstep through its simulator interface."""

    controller: ClassVar[type[Controller]] = PilotedLaw

    type: Literal["px4", "ardupilot", "betaflight"]
    connect: Annotated[
        str, AfterValidator(checked_address), Quantity("", "where to listen, [HOST:]PORT; default: 127.0.0.1, usual port")
    ] = ""

    def matching(self, plan: FlightPlan) -> AutopilotSettings:
        plant = plan.loop.plant
        assert isinstance(plant, Multirotor)
        every = dict(zip((task.name for task in plan.loop.tasks), plan.ticks.every, strict=True))["law"]
        kind = KINDS[self.type]
        if kind.period is not None and not math.isclose(every * plan.ticks.step, kind.period):
            raise UserError(
                f"simulation.control_period: should be {kind.period:g} s for Betaflight, a round of its loop a sample"
            )
        return kind.matching(plan.parameters, plant.geometry)

    def watch(self, say: Callable[[str], None], first_wait: float = FIRST_WAIT) -> None:
        for one in CONNECTIONS.values():
            one.say, one.first_wait, one.pilot, one.kept = say, first_wait, None, True

    def lead(self, plan: FlightPlan, model: Model, where: str, say: Callable[[str], None]) -> None:
        found, kind = self.matching(plan), KINDS[self.type]
        motors = address(self.connect, kind.port)
        for one in CONNECTIONS.values():
            one.pilot = partial(kind.station, one, motors, plan, model, found, where, say)

    def build(self, vehicle: ModelledVehicle, folder: Path) -> BuiltController:
        model = vehicle.model()
        kind = KINDS[self.type]
        handle = connection(self.type, address(self.connect, kind.port), kind.order(model))
        lift = model.mass * model.gravity / (model.per_speed * model.fastest * model.fastest)
        return BuiltController(PilotedLaw(model.rotors), PilotedGains(float(handle), lift))

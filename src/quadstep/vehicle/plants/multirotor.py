"""A real multirotor: a rigid body on quaternions with rotors that lag, drag, a battery, and events that change it."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

from quadstep.interfaces.closed_loop import Outcome, finite
from quadstep.interfaces.controller import Command, Measured, RotorSpeeds, RotorThrusts
from quadstep.interfaces.plant import Drawn, Rotor
from quadstep.interfaces.reference import Reference
from quadstep.numbers import Number, Vector, absolute, vector, where
from quadstep.numbers.noise import Key
from quadstep.vehicle.airframe.allocation import Allocation, allocate, clamped, mix, speeds_of, thrusts_of
from quadstep.vehicle.airframe.geometry import Effects, Geometry
from quadstep.vehicle.airframe.motion import AirframeState, Motion, renormalised
from quadstep.vehicle.airframe.plant import Airframe, Events, derivative, efficiencies, mass_properties, specific_force
from quadstep.vehicle.plants.in_space import InSpace, airframe_columns, airframe_row, fastest


class AirframeLimits(NamedTuple):
    """When a flight counts as lost: distance from the path [m], a body rate [rad/s]; the ground ends it too."""

    distance: Number
    rate: Number


class AirframeParameters(NamedTuple):
    """Every number of a flight. wind: of its air."""

    airframe: Airframe
    allocation: Allocation
    events: Events
    wind: object
    sensors: object
    key: Key
    path: object
    gains: object
    limits: AirframeLimits


class Spun(NamedTuple):
    """What each rotor is told [rad/s], and the thrust [N] and torque [N m] that this should make."""

    speeds: Vector
    thrust: Number
    torque: Vector


@dataclass(frozen=True)
class Multirotor(InSpace[AirframeParameters, AirframeState, Command | RotorThrusts | RotorSpeeds]):
    """The plant: where its rotors are, and which effects it has."""

    geometry: Geometry
    effects: Effects

    compact: ClassVar[bool] = False
    """Written out four times: as a function it would take longer to compile and to fly."""

    @property
    def columns(self) -> Mapping[str, str]:
        """Name and unit of every logged column."""
        return airframe_columns(len(self.geometry.mounts))

    def body(self, p: AirframeParameters) -> Airframe:
        return p.airframe

    def rest(self, state: AirframeState, p: AirframeParameters) -> tuple[Command, Spun]:
        """The rotors turn as they do, and are told to go on so."""
        nothing = vector(0.0, 0.0, 0.0)
        return Command(0.0, nothing), Spun(state.speeds, 0.0, nothing)

    def truth(self, state: AirframeState) -> Motion:
        return state.motion

    def felt(self, p: AirframeParameters, state: AirframeState, rate: AirframeState) -> Vector:
        """The specific force [m/s^2]."""
        return specific_force(p.airframe, state, rate)

    def told(self, known: Motion, held: Spun) -> Measured:
        """The measured motion, and what the rotors were asked for, after their limits."""
        return Measured(*known, held.thrust, held.torque)

    def rotor_speeds(self, state: AirframeState) -> Vector:
        return state.speeds

    def asked(self, p: AirframeParameters, command: Command | RotorThrusts | RotorSpeeds) -> Command:
        if isinstance(command, Command):
            return command
        thrusts = command.thrusts if isinstance(command, RotorThrusts) else thrusts_of(p.allocation, command.speeds)
        return Command(*self.made(p, thrusts), command.desired_attitude)

    def actuate(self, p: AirframeParameters, command: Command | RotorThrusts | RotorSpeeds) -> Spun:
        """The rotor speeds that make a command within their limits; a rotor that is told its own is held within these."""
        if isinstance(command, Command):
            return Spun(*allocate(self.geometry, p.allocation, command.thrust, command.torque))
        if isinstance(command, RotorThrusts):
            speeds = speeds_of(p.allocation, command.thrusts)
        else:
            slowest, fastest = p.airframe.rotor.slowest, p.airframe.rotor.fastest
            speeds = Vector(clamped(speed, slowest, fastest) for speed in command.speeds)
        return Spun(speeds, *self.made(p, thrusts_of(p.allocation, speeds)))

    def made(self, p: AirframeParameters, thrusts: Vector) -> tuple[Number, Vector]:
        """Thrust [N] and torque [N m] of the rotors' thrusts [N]."""
        return mix(self.geometry, p.airframe.rotor.torque / p.airframe.rotor.thrust, thrusts)

    def rate(self, p: AirframeParameters, state: AirframeState, held: Spun, wind: Vector, time: Number) -> AirframeState:
        """Rate of every state in this wind, with what has happened to the vehicle by then."""
        mass = mass_properties(p.airframe, p.events, time)
        efficiency = efficiencies(p.events, len(self.geometry.mounts), time)
        return derivative(self.geometry, p.airframe, mass, efficiency, state, held.speeds, wind, self.effects)

    def settled(self, state: AirframeState) -> AirframeState:
        """A unit quaternion."""
        return renormalised(state)

    def outcome(self, p: AirframeParameters, state: AirframeState, command: Command, reference: Reference) -> Number:
        """On the ground, off the path, or spinning."""
        distance = self.error(state, reference).norm()
        code = where(fastest(state.rates) < p.limits.rate, 0.0, float(Outcome.SPINNING))
        code = where(distance < p.limits.distance, code, float(Outcome.OFF_PATH))
        code = where(state.position[2] >= p.airframe.ground, code, float(Outcome.CRASHED))
        everything = distance + state.velocity.norm() + state.rates.norm() + state.speeds.norm()
        everything = everything + absolute(command.thrust) + command.torque.norm()
        return where(finite(everything), code, float(Outcome.NOT_FINITE))

    def drawn(self, p: AirframeParameters) -> Drawn:
        mounts, ground = self.geometry.mounts, float(p.airframe.ground)
        rotors = tuple(
            Rotor((mount.position[0], mount.position[1], mount.position[2]), 1 if mount.spin > 0 else -1, f"f{i + 1}")
            for i, mount in enumerate(mounts)
        )
        attitude, radius = ("q_w", "q_x", "q_y", "q_z"), float(p.airframe.rotor.radius)
        return Drawn(rotors, "u_a", attitude, ground if math.isfinite(ground) else None, radius)

    def row(
        self, p: AirframeParameters, state: AirframeState, told: Measured, command: Command, held: Spun,
        reference: Reference, wind: Vector, time: Number,
    ) -> list[Number]:  # fmt: skip
        """One row of the log, in the order of `airframe_columns`."""
        return airframe_row(p.airframe, self.effects, reference, state, told, command, wind, time)

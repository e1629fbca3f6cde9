"""A real multirotor: a rigid body on quaternions with rotors that lag, drag, a battery, and events that change it.

Its agility says how fast its loops can be, given the lag and torque of the rotors and all delay in the loop.

Gains over mass and inertia leave a loop that depends on time alone. With rotors of lag T and a delay D it is, about a
horizontal axis,

    gain / s^n  exp(-D s) / (1 + T s),

so gains in proportion to 1 / (T + `DELAYS` D), each to the power of its time unit, have like margins on all vehicles. Fixes of
position, velocity and attitude that are older than the gyro's samples by L do not delay the loop of the body rates, which only
has to stand two further delays; those around it are slower by the phase of L, 1 / all = 1 / rates + L / `AROUND`.

About the vertical axis rotors turn a vehicle twice: by their drag 2 k_m w_0 dw and, accelerating, by their own inertia,
J_r dw/dt:

    gain / s^n  exp(-D s) (1 + T_r s) / (1 + T s),    T_r = J_r / (2 k_m w_0),

which above 1 / T multiplies the loop by T_r / T.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

from quadstep.interfaces.closed_loop import Outcome, finite
from quadstep.interfaces.controller import Command, Measured, RotorSpeeds, RotorThrusts
from quadstep.interfaces.plant import Drawn, Reference, Rotor
from quadstep.numbers import Number, Vector, absolute, maximum, minimum, sqrt, total, vector, where
from quadstep.numbers.noise import Key
from quadstep.vehicle.airframe_plant import (
    Airframe,
    Events,
    derivative,
    efficiencies,
    mass_properties,
    specific_force,
    voltage,
)
from quadstep.vehicle.allocation import Allocation, allocate, clamped, mix, spun, thrusts_of
from quadstep.vehicle.in_space import InSpace, airframe_columns, airframe_row, fastest
from quadstep.vehicle.rigid_body import AirframeState, Effects, Geometry, Motion, renormalised


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
    """speeds [rad/s]: of each rotor, as it is told. thrust [N]: that these should make. torque [N m]: likewise."""

    speeds: Vector
    thrust: Number
    torque: Vector


@dataclass(frozen=True)
class Multirotor(InSpace[AirframeParameters, AirframeState, Command | RotorThrusts | RotorSpeeds]):
    """The plant: where its rotors are, which effects it has, and whether rotors fail."""

    geometry: Geometry
    effects: Effects
    failing: bool = False

    compact: ClassVar[bool] = False
    """Written out four times: as a function it would take longer to compile and to fly."""

    @property
    def columns(self) -> Mapping[str, str]:
        return airframe_columns(len(self.geometry.mounts), self.failing)

    def body(self, p: AirframeParameters) -> Airframe:
        return p.airframe

    def rest(self, state: AirframeState, p: AirframeParameters) -> tuple[Command, Spun]:
        """The rotors turn as they do, and are told to go on so."""
        nothing = vector(0.0, 0.0, 0.0)
        return Command(0.0, nothing), Spun(state.speeds, 0.0, nothing)

    def truth(self, state: AirframeState) -> Motion:
        return state.motion

    def specific_force(self, p: AirframeParameters, state: AirframeState, rate: AirframeState) -> Vector:
        """The specific force [m/s^2]."""
        return specific_force(p.airframe, state, rate)

    def measurement(self, known: Motion, held: Spun) -> Measured:
        """The measured motion, and what the rotors were asked for, after their limits."""
        return Measured(*known, held.thrust, held.torque)

    def rotor_speeds(self, state: AirframeState) -> Vector:
        return state.speeds

    def full_speed(self, state: AirframeState, p: AirframeParameters) -> Number:
        """It falls with the battery's voltage."""
        fastest = p.airframe.rotor.fastest
        return fastest * voltage(p.airframe, state) / p.airframe.battery.full if self.effects.battery else fastest

    def logged_command(self, p: AirframeParameters, command: Command | RotorThrusts | RotorSpeeds) -> Command:
        if isinstance(command, Command):
            return command
        thrusts = command.thrusts if isinstance(command, RotorThrusts) else thrusts_of(p.allocation, command.speeds)
        return Command(*self.made(p, thrusts), command.desired_attitude)

    def actuate(self, p: AirframeParameters, command: Command | RotorThrusts | RotorSpeeds) -> Spun:
        """The rotor speeds that make a command within their limits; a rotor that is told its own is held within these."""
        if isinstance(command, Command):
            return Spun(*allocate(self.geometry, p.allocation, command.thrust, command.torque))
        if isinstance(command, RotorThrusts):
            speeds = spun(p.allocation, [clamped(one, p.allocation.least, p.allocation.most) for one in command.thrusts])
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

    def projected(self, state: AirframeState) -> AirframeState:
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

    def drawing(self, p: AirframeParameters) -> Drawn:
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
        whole = [p.airframe.rotor.thrust * speed * speed for speed in state.speeds]
        shares = efficiencies(p.events, len(whole), time)
        forces = [share * force for share, force in zip(shares, whole, strict=True)] + whole * self.failing
        return airframe_row(p.airframe, self.effects, reference, state, told, command, forces, wind, time)


LIVELY = 60.0
"""Angular acceleration about a horizontal body axis that suffices for the default gains [rad/s^2]."""

DELAYS = 3.0
"""How much more a second of delay counts than one of lag: the margins asked for include two further delays."""

AGES, OLDEST = 0.7, 0.021
"""The same for a second by which fixes are older than the gyro's samples, in the loop of the body rates, and the largest
product of that age and `rates` [s]: of the pi/2 that this loop has, with a gain of 30 1/s, twice that age then takes 1.3.
"""

AROUND = 0.07
"""Age of fixes that halves the speed of loops around a loop of rates of speed 1 [s]."""

LATE = 0.001
"""Delay of the vehicle on which the default gains were found [s]: half of a sample of 2 ms."""

LAG = 0.04
"""Lag of its rotors [s]."""

TURNING = 0.02
"""Largest product of `yaw` and the sum of the delay times T_r / T and the age of fixes times its root [s]: with the largest
default gain on the yaw rate, 20 1/s, the loop of that rate then crosses at most 0.4 rad over the delay. Late fixes delay only
the heading, but two further delays, which that rate's loop has to stand, are longer the later they are.
"""


class Agility(NamedTuple):
    """Speeds of the loops relative to the vehicle on which the default gains were found, in (0, 1].

    all: of position, roll and pitch. rates: of the body rates within them. yaw: of the heading.
    """

    all: Number
    rates: Number
    yaw: Number


def agility(geometry: Geometry, airframe: Airframe, allocation: Allocation, delay: Number, stale: Number) -> Agility:
    """How fast the loops can be.

    delay: from a sample of the gyro to the rotors' command [s], half of the law's period included. stale: how much older
    position, velocity and attitude are [s].
    """
    weight, enough = airframe.mass * airframe.gravity, 1e3 * LIVELY
    turns = []
    for axis in range(2):
        torque = [0.0, 0.0, 0.0]
        torque[axis] = enough * airframe.inertia[axis]
        _, _, made = allocate(geometry, allocation, weight, Vector(torque))
        turns.append(made[axis] / airframe.inertia[axis])
    rotor = airframe.rotor
    lag, shortest = maximum(rotor.rise, rotor.fall), minimum(rotor.rise, rotor.fall)
    quick = (LAG + DELAYS * LATE) / (lag + DELAYS * delay + AGES * stale)
    quick = minimum(minimum(1.0, quick), OLDEST / maximum(stale, 1e-9))
    rates = minimum(quick, sqrt(minimum(*turns) / LIVELY))
    fast = rates / (1.0 + rates * stale / AROUND)
    speeds, _, _ = allocate(geometry, allocation, weight, Vector((0.0, 0.0, 0.0)))
    hover = total(speeds) / len(geometry.mounts)
    lead = maximum(1.0, rotor.inertia / (2.0 * rotor.torque * hover * shortest))
    return Agility(fast, rates, minimum(fast, TURNING / maximum(lead * delay + sqrt(lead) * stale, 1e-9)))

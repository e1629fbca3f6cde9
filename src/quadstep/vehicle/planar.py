"""A planar quadrotor for teaching, the PVTOL of the paper's [33]: x, z and pitch, two rotors, three equations.

m x_dd = -u sin(theta), m z_dd = u cos(theta) - m g, J theta_dd = tau: the paper's plant (Eqs 9 and 10) with psi = phi = 0 and
without its disturbance.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

from quadstep.interfaces.closed_loop import Outcome, finite
from quadstep.interfaces.gain import gain
from quadstep.interfaces.plant import Drawn, Model, Reference, Rotor
from quadstep.numbers import Number, Vector, absolute, clip, cos, sin, vector, where
from quadstep.vehicle.declared import DeclaredPlant, PlantParameters


class PlanarNumbers(NamedTuple):
    """Of the vehicle."""

    mass: Number = gain(0.5, "kg", "mass m")
    inertia: Number = gain(0.004, "kg m^2", "moment of inertia about the pitch axis, J")
    gravity: Number = gain(9.81, "m/s^2", "gravity g")
    arm: Number = gain(0.15, "m", "distance from the centre to each rotor")
    most_thrust: Number = gain(6.0, "N", "largest thrust of a rotor; the least is 0")


class PlanarLimits(NamedTuple):
    """When a flight counts as diverged."""

    distance: Number = gain(100.0, "m", "largest distance from the path")
    rate: Number = gain(100.0, "rad/s", "largest pitch rate")


class PlanarState(NamedTuple):
    """position [m]: (x, z). velocity [m/s]: its rate. pitch [rad]: theta, positive tilts the thrust towards -x. rate [rad/s]:
    of the pitch.
    """

    position: Vector
    velocity: Vector
    pitch: Number
    rate: Number


class PlanarCommand(NamedTuple):
    """thrust [N]: u. torque [N m]: tau. wanted_pitch [rad]: for the log."""

    thrust: Number
    torque: Number
    wanted_pitch: Number = 0.0


def thrust_direction(pitch: Number) -> Vector:
    """Unit vector (x, z) of the thrust."""
    return vector(-sin(pitch), cos(pitch))


@dataclass(frozen=True)
class Planar(DeclaredPlant):
    """The plant. What its actuators are told is each rotor's thrust [N], that at +x first."""

    name: ClassVar = "planar"
    label: ClassVar = "planar quadrotor (PVTOL), for teaching"
    Numbers: ClassVar = PlanarNumbers
    Limits: ClassVar = PlanarLimits
    measures: ClassVar = PlanarState
    axes: ClassVar = ("x", "z")
    efforts: ClassVar[Mapping[str, str]] = {"thrust": "N", "torque": "N m"}
    columns: ClassVar[Mapping[str, str]] = {
        "t": "s", "x": "m", "z": "m", "v_x": "m/s", "v_z": "m/s", "theta": "rad", "theta_dot": "rad/s",
        "x_d": "m", "z_d": "m", "theta_d": "rad", "thrust": "N", "torque": "N m", "f1": "N", "f2": "N",
    }  # fmt: skip

    def model(self, numbers: PlanarNumbers) -> Model:
        inertia = vector(numbers.inertia, numbers.inertia, numbers.inertia)
        return Model(numbers.mass, inertia, numbers.gravity, most_thrust=2.0 * numbers.most_thrust, rotors=2)

    def begin(self, numbers: PlanarNumbers, wanted: Reference) -> PlanarState:
        """Level, on the path and as fast as it."""
        return PlanarState(plane(wanted.position), plane(wanted.velocity), 0.0, 0.0)

    def rest(self, state: PlanarState, p: PlantParameters) -> tuple[PlanarCommand, Vector]:
        """A placeholder of the right shape: a law runs before the first step."""
        return PlanarCommand(0.0, 0.0), vector(0.0, 0.0)

    def actuate(self, p: PlantParameters, command: PlanarCommand) -> Vector:
        """Both rotors' thrusts within their limits."""
        half, turn = 0.5 * command.thrust, 0.5 * command.torque / p.vehicle.arm
        return Vector(clip(thrust, 0.0, p.vehicle.most_thrust) for thrust in (half - turn, half + turn))

    def made(self, p: PlantParameters, held: Vector) -> PlanarCommand:
        """Thrust and torque of both rotors."""
        return PlanarCommand(held[0] + held[1], p.vehicle.arm * (held[1] - held[0]))

    def rate(self, p: PlantParameters, state: PlanarState, held: Vector, wind: Vector, time: Number) -> PlanarState:
        made, vehicle = self.made(p, held), p.vehicle
        acceleration = made.thrust / vehicle.mass * thrust_direction(state.pitch) - vector(0.0, vehicle.gravity)
        return PlanarState(state.velocity, acceleration, state.rate, made.torque / vehicle.inertia)

    def outcome(self, p: PlantParameters, state: PlanarState, command: PlanarCommand, reference: Reference) -> Number:
        distance = self.error(state, reference).norm()
        code = where(absolute(state.rate) < p.limits.rate, 0.0, float(Outcome.SPINNING))
        code = where(distance < p.limits.distance, code, float(Outcome.OFF_PATH))
        everything = distance + state.velocity.norm() + absolute(command.thrust) + absolute(command.torque)
        return where(finite(everything + absolute(state.pitch)), code, float(Outcome.NOT_FINITE))

    def error(self, state: PlanarState, reference: Reference) -> Vector:
        return plane(reference.position) - state.position

    def inputs(self, held: Vector) -> Vector:
        """Thrust and, over the arm, torque."""
        return vector(held[0] + held[1], held[1] - held[0])

    def row(
        self, p: PlantParameters, state: PlanarState, told: object, command: PlanarCommand, held: Vector,
        reference: Reference, wind: Vector, time: Number,
    ) -> list[Number]:  # fmt: skip
        """One row of the log, in the order of `columns`."""
        made = self.made(p, held)
        return [
            time, *state.position, *state.velocity, state.pitch, state.rate, *plane(reference.position),
            command.wanted_pitch, made.thrust, made.torque, *held,
        ]  # fmt: skip

    def drawing(self, p: PlantParameters) -> Drawn:
        arm = float(p.vehicle.arm)
        rotors = (Rotor((arm, 0.0, 0.0), 1, "f1"), Rotor((-arm, 0.0, 0.0), -1, "f2"))
        return Drawn(rotors, "thrust", ("psi", "theta", "phi"))


def plane(of: Vector) -> Vector:
    """x and z of a vector in space."""
    return vector(of[0], of[2])

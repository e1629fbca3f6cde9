"""The paper's plant: the Lagrange form with generalised torques (Eqs 1 to 10), its disturbance (Eq. 67), Eq. 5's rotors."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, NamedTuple, cast

from quadstep.interfaces.closed_loop import Outcome, finite
from quadstep.interfaces.controller import Command
from quadstep.interfaces.plant import Drawn, Kinematics, Reference, Rotor
from quadstep.numbers import Number, Vector, absolute, where
from quadstep.vehicle.in_space import COLUMNS, InSpace, fastest, log_row
from quadstep.vehicle.paper import DeclaredDisturbance, Disturbance, State, Vehicle, derivative, disturb, limit


class Limits(NamedTuple):
    """When a flight counts as diverged: distance from the path [m], an Euler rate [rad/s], |theta| [rad]."""

    distance: Number
    rate: Number
    pitch: Number


class Parameters(NamedTuple):
    """Every number of a flight."""

    vehicle: Vehicle
    disturbance: object
    path: object
    gains: object
    limits: Limits


class AttainedCommand(NamedTuple):
    """What is left of a command within the rotors' limits. thrust [N]: u. torque [N m]: tau, generalised."""

    thrust: Number
    torque: Vector


@dataclass(frozen=True)
class Lagrange(InSpace[Parameters, State, Command]):
    """The plant; which T_eta it has, whether its rotors have limits, and the disturbance if it is not the paper's."""

    kinematics: Kinematics = Kinematics.STANDARD
    rotor_limits: bool = False
    disturbance: DeclaredDisturbance | None = None

    compact: ClassVar[bool] = True

    @property
    def columns(self) -> Mapping[str, str]:
        return COLUMNS

    def body(self, p: Parameters) -> Vehicle:
        return p.vehicle

    def rest(self, state: State, p: Parameters) -> tuple[Command, AttainedCommand]:
        """A placeholder of the right shape: a law runs before the first step."""
        return Command(thrust=0.0, torque=state.rates), AttainedCommand(0.0, state.rates)

    def truth(self, state: State) -> State:
        return state

    def specific_force(self, p: Parameters, state: State, rate: State) -> Vector:
        """Never asked: this plant has no estimator."""
        raise NotImplementedError

    def measurement(self, known: State, held: AttainedCommand) -> State:
        return known

    def actuate(self, p: Parameters, command: Command) -> AttainedCommand:
        """What Eq. 5's rotors can make of thrust and torque."""
        if not self.rotor_limits:
            return AttainedCommand(command.thrust, command.torque)
        return AttainedCommand(*limit(p.vehicle.rotors, command.thrust, command.torque))

    def rate(self, p: Parameters, state: State, held: AttainedCommand, wind: Vector, time: Number) -> State:
        """Eq. 9 and Eq. 10."""

        def law(_: object, at: State) -> tuple[Vector, Vector]:
            return self.disturbed(p, at, time)

        return derivative(p.vehicle, p.disturbance, self.kinematics, state, held.thrust, held.torque, law)

    def disturbed(self, p: Parameters, state: State, time: Number) -> tuple[Vector, Vector]:
        """A_xyz [N] and A_eta [N m] at a state and time t [s]."""
        if self.disturbance is None:
            return disturb(cast(Disturbance, p.disturbance), state)
        found = self.disturbance.disturb(state, p.disturbance, time)
        if not isinstance(found, tuple) or [len(one) for one in found if isinstance(one, Vector)] != [3, 3]:
            raise TypeError("`disturb` should return a force and a torque, each a Vector of 3")
        return found

    def projected(self, state: State) -> State:
        return state

    def outcome(self, p: Parameters, state: State, command: Command, reference: Reference) -> Number:
        """Off the path, spinning, or at the singularity of the Euler angles."""
        limits, (_, theta, _) = p.limits, state.attitude
        distance = self.error(state, reference).norm()
        code = where(absolute(theta) < limits.pitch, 0.0, float(Outcome.SINGULAR))
        code = where(fastest(state.rates) < limits.rate, code, float(Outcome.SPINNING))
        code = where(distance < limits.distance, code, float(Outcome.OFF_PATH))
        everything = distance + state.velocity.norm() + state.attitude.norm() + state.rates.norm()
        everything = everything + absolute(command.thrust) + command.torque.norm()
        return where(finite(everything), code, float(Outcome.NOT_FINITE))

    def drawing(self, p: Parameters) -> Drawn:
        """Rotor 1 at -y, 2 at -x, 3 at +y, 4 at +x (docs/conventions.md)."""
        arm = float(p.vehicle.rotors.arm)
        places = ((0.0, -arm, 0.0), (-arm, 0.0, 0.0), (0.0, arm, 0.0), (arm, 0.0, 0.0))
        rotors = tuple(Rotor(place, 1 if i % 2 == 0 else -1, f"f{i + 1}") for i, place in enumerate(places))
        return Drawn(rotors, "u", ("psi", "theta", "phi"))

    def row(
        self, p: Parameters, state: State, told: State, command: Command, held: AttainedCommand, reference: Reference,
        wind: Vector, time: Number,
    ) -> list[Number]:  # fmt: skip
        """One row of the log, in the order of `COLUMNS`."""
        made = command._replace(thrust=held.thrust, torque=held.torque)
        return log_row(p.vehicle, self.kinematics, reference.position, state, made, time)

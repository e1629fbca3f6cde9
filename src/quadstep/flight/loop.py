"""The paper's closed loop: path, sampled controller, Eq. 5's rotors and the Lagrange plant."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from quadstep.control.controller import Command, Controller
from quadstep.flight.closed_loop import Clock, Outcome, Task, finite
from quadstep.flight.columns import COLUMNS, log_row
from quadstep.flight.integrator import runge_kutta_4
from quadstep.guidance.reference import PathLaw, Reference
from quadstep.numbers import Number, absolute, maximum, where
from quadstep.numbers.repeated import repeated
from quadstep.vehicle.disturbance import Disturbance
from quadstep.vehicle.kinematics import Kinematics
from quadstep.vehicle.lagrange import Vehicle, derivative
from quadstep.vehicle.rotors import limit
from quadstep.vehicle.state import State


class Limits(NamedTuple):
    """When a flight counts as diverged: distance from the path [m], an Euler rate [rad/s], |theta| [rad]."""

    distance: Number
    rate: Number
    pitch: Number


class Parameters(NamedTuple):
    """Every number of a flight."""

    vehicle: Vehicle
    disturbance: Disturbance
    path: Any
    gains: Any
    limits: Limits


class Cycle(NamedTuple):
    """What lives from step to step: the vehicle, the controller's memory, the command being held."""

    state: State
    memory: Any
    command: Command


@dataclass(frozen=True)
class Loop:
    """The structure of a flight: which laws are composed. Numbers are in `Parameters`."""

    path: PathLaw
    controller: Controller
    kinematics: Kinematics = Kinematics.STANDARD
    rotor_limits: bool = False

    def start(self, state: State, parameters: Parameters) -> Cycle:
        """The cycle before the first sample, with a placeholder command of the right shape."""
        memory = self.controller.start(state, parameters.gains)
        return Cycle(state, memory, Command(thrust=0.0, torque=state.rates))

    @property
    def columns(self) -> Mapping[str, str]:
        """Name and unit of every logged column."""
        return COLUMNS

    @property
    def tasks(self) -> tuple[Task, ...]:
        """One sampled law: the controller."""
        return (Task("control", self.sample),)

    def sample(self, cycle: Cycle, parameters: Parameters, clock: Clock) -> tuple[Cycle, Number]:
        """The cycle after a control sample, and the `Outcome` that ends the flight here (0: none)."""
        reference = self.path.reference(clock.time, parameters.path)
        state, gains = cycle.state, parameters.gains
        command, memory = self.controller.law(cycle.memory, state, reference, gains, clock.time, clock.period)
        code = failure(state, command, reference, parameters.limits)  # of what was asked for: a limit would hide NaN
        if self.rotor_limits:
            thrust, torque = limit(parameters.vehicle.rotors, command.thrust, command.torque)
            command = command._replace(thrust=thrust, torque=torque)
        return Cycle(state, memory, command), code

    def advance(self, cycle: Cycle, parameters: Parameters, clock: Clock) -> Cycle:
        """The cycle one integrator step later, the command held (Eqs 9 and 10)."""

        def rate(state: State) -> State:
            return derivative(
                parameters.vehicle,
                parameters.disturbance,
                self.kinematics,
                state,
                cycle.command.thrust,
                cycle.command.torque,
            )

        return cycle._replace(state=runge_kutta_4(repeated(rate), cycle.state, clock.period))

    def row(self, cycle: Cycle, parameters: Parameters, time: Number) -> list[Number]:
        """One row of the log, in the order of `COLUMNS`: the state now, the command held."""
        wanted = self.path.reference(time, parameters.path).position
        return log_row(parameters.vehicle, self.kinematics, wanted, cycle.state, cycle.command, time)


def failure(state: State, command: Command, reference: Reference, limits: Limits) -> Number:
    """The `Outcome` a sample ends with, 0 while all is well; a number that is not finite goes before all else."""
    _, theta, _ = state.attitude
    distance = (reference.position - state.position).norm()
    spin = maximum(maximum(absolute(state.rates[0]), absolute(state.rates[1])), absolute(state.rates[2]))
    code = where(absolute(theta) < limits.pitch, 0.0, float(Outcome.SINGULAR))
    code = where(spin < limits.rate, code, float(Outcome.SPINNING))
    code = where(distance < limits.distance, code, float(Outcome.OFF_PATH))
    everything = distance + state.velocity.norm() + state.attitude.norm() + state.rates.norm()
    everything = everything + absolute(command.thrust) + command.torque.norm()
    return where(finite(everything), code, float(Outcome.NOT_FINITE))

"""The closed loop of a real vehicle: path, air, sensors, position loop, attitude loop, rotor limits and airframe.

Each of them runs at its own rate; the tasks of a tick stand in the order in which they depend on each other.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from quadstep.air.wind import DRAWS, Wind, start_turbulence, turbulence_step, wind_at
from quadstep.airframe.allocation import Allocation, allocate
from quadstep.airframe.events import Events, efficiencies, mass_properties
from quadstep.airframe.geometry import Effects, Geometry
from quadstep.airframe.motion import AirframeState
from quadstep.airframe.plant import Airframe, derivative, specific_force
from quadstep.airframe.rigid_body import renormalised
from quadstep.control.controller import Command, Controller, Measured
from quadstep.flight.airframe_columns import airframe_columns, airframe_row
from quadstep.flight.closed_loop import Clock, Outcome, Task, finite
from quadstep.flight.integrator import runge_kutta_4
from quadstep.guidance.reference import PathLaw, Reference
from quadstep.numbers import Number, Vector, absolute, maximum, vector, where
from quadstep.numbers.noise import Key, normals
from quadstep.sensing.suite import Suite

TURBULENCE_STREAM = 0


class AirframeLimits(NamedTuple):
    """When a flight counts as lost: distance from the path [m], a body rate [rad/s]; the ground ends it too."""

    distance: Number
    rate: Number


class AirframeParameters(NamedTuple):
    """Every number of a flight."""

    airframe: Airframe
    allocation: Allocation
    events: Events
    wind: Wind
    sensors: Any
    key: Key
    path: Any
    gains: Any
    limits: AirframeLimits


class AirframeCycle(NamedTuple):
    """What lives from step to step.

    turbulence: of the air. sensed: of the sensors and the estimator. memory: the controller's. wanted_speeds: what each rotor
    is told [rad/s]; thrust [N], torque [N m]: what that should make.
    """

    state: AirframeState
    turbulence: Any
    sensed: Any
    memory: Any
    command: Command
    wanted_speeds: Vector
    thrust: Number
    torque: Vector


@dataclass(frozen=True)
class AirframeLoop:
    """The structure of such a flight; numbers are in `AirframeParameters`."""

    path: PathLaw
    controller: Controller
    geometry: Geometry
    effects: Effects
    suite: Suite
    turbulent: bool = False

    @property
    def columns(self) -> Mapping[str, str]:
        """Name and unit of every logged column."""
        return airframe_columns(len(self.geometry.mounts))

    @property
    def tasks(self) -> tuple[Task, ...]:
        """Air, sensors, position loop, attitude loop."""
        air = (Task("air", self.stir),) if self.turbulent else ()
        sensing = (Task("sensing", self.sense), Task("fix", self.fix))
        return (*air, *sensing, Task("guidance", self.guide), Task("control", self.control))

    def start(self, start: AirframeState, parameters: AirframeParameters) -> AirframeCycle:
        """The cycle before the first tick; the rotors turn as `start` says and are told to go on so."""
        sensed = self.suite.start(start.motion, parameters.sensors, parameters.key)
        nothing = vector(0.0, 0.0, 0.0)
        measured = Measured(*self.suite.measured(sensed), thrust=0.0, torque=nothing)
        memory = self.controller.start(measured, parameters.gains)
        return AirframeCycle(
            start, start_turbulence(), sensed, memory, Command(0.0, nothing), start.speeds, measured.thrust, nothing
        )

    def stir(self, cycle: AirframeCycle, parameters: AirframeParameters, clock: Clock) -> tuple[AirframeCycle, Number]:
        """The turbulence one period later."""
        draws = normals(parameters.key, TURBULENCE_STREAM, clock.tick, DRAWS)
        turbulence = turbulence_step(cycle.turbulence, parameters.wind.turbulence, draws, clock.period)
        return cycle._replace(turbulence=turbulence), 0.0

    def sense(self, cycle: AirframeCycle, parameters: AirframeParameters, clock: Clock) -> tuple[AirframeCycle, Number]:
        """Gyro and accelerometer, and what the estimator makes of them."""
        felt = vector(0.0, 0.0, 0.0)
        if self.suite.estimator:
            rate = self.rate(cycle, parameters, clock.time, cycle.state)
            felt = specific_force(parameters.airframe, cycle.state, rate)
        motion, sensors, key = cycle.state.motion, parameters.sensors, parameters.key
        sensed = self.suite.sense(cycle.sensed, motion, felt, sensors, key, clock.tick, clock.period)
        return cycle._replace(sensed=sensed), 0.0

    def fix(self, cycle: AirframeCycle, parameters: AirframeParameters, clock: Clock) -> tuple[AirframeCycle, Number]:
        """A sample of position, velocity and attitude."""
        motion, sensors, key = cycle.state.motion, parameters.sensors, parameters.key
        sensed = self.suite.fix(cycle.sensed, motion, sensors, key, clock.tick, clock.period)
        return cycle._replace(sensed=sensed), 0.0

    def measured(self, cycle: AirframeCycle) -> Measured:
        """What the controller gets to know now."""
        return Measured(*self.suite.measured(cycle.sensed), cycle.thrust, cycle.torque)

    def guide(self, cycle: AirframeCycle, parameters: AirframeParameters, clock: Clock) -> tuple[AirframeCycle, Number]:
        """The position loop."""
        reference = self.path.reference(clock.time, parameters.path)
        memory = self.controller.guide(
            cycle.memory, self.measured(cycle), reference, parameters.gains, clock.time, clock.period
        )
        return cycle._replace(memory=memory), 0.0

    def control(self, cycle: AirframeCycle, parameters: AirframeParameters, clock: Clock) -> tuple[AirframeCycle, Number]:
        """The attitude loop, the rotor speeds that make its command within their limits, and whether the flight goes on."""
        reference = self.path.reference(clock.time, parameters.path)
        command, memory = self.controller.law(
            cycle.memory, self.measured(cycle), reference, parameters.gains, clock.time, clock.period
        )
        code = failure(cycle.state, command, reference, parameters.airframe.ground, parameters.limits)
        speeds, thrust, torque = allocate(self.geometry, parameters.allocation, command.thrust, command.torque)
        return cycle._replace(memory=memory, command=command, wanted_speeds=speeds, thrust=thrust, torque=torque), code

    def rate(self, cycle: AirframeCycle, parameters: AirframeParameters, time: Number, state: AirframeState) -> AirframeState:
        """Rate of every state, the rotors' commands held."""
        airframe, events = parameters.airframe, parameters.events
        return derivative(
            self.geometry,
            airframe,
            mass_properties(airframe, events, time),
            efficiencies(events, len(self.geometry.mounts), time),
            state,
            cycle.wanted_speeds,
            wind_at(parameters.wind, cycle.turbulence, time),
            self.effects,
        )

    def advance(self, cycle: AirframeCycle, parameters: AirframeParameters, clock: Clock) -> AirframeCycle:
        """The cycle one integrator step later; wind and events as they are in the middle of the step."""
        middle = clock.time + 0.5 * clock.period
        state = runge_kutta_4(lambda state: self.rate(cycle, parameters, middle, state), cycle.state, clock.period)
        return cycle._replace(state=renormalised(state))

    def row(self, cycle: AirframeCycle, parameters: AirframeParameters, time: Number) -> list[Number]:
        """One row of the log: the state now, the commands held."""
        reference = self.path.reference(time, parameters.path)
        wind = wind_at(parameters.wind, cycle.turbulence, time)
        measured = self.measured(cycle)
        return airframe_row(parameters.airframe, self.effects, reference, cycle.state, measured, cycle.command, wind, time)


def failure(state: AirframeState, command: Command, reference: Reference, ground: Number, limits: AirframeLimits) -> Number:
    """The `Outcome` a sample ends with, 0 while all is well; a number that is not finite goes before all else."""
    distance = (reference.position - state.position).norm()
    spin = maximum(maximum(absolute(state.rates[0]), absolute(state.rates[1])), absolute(state.rates[2]))
    code = where(spin < limits.rate, 0.0, float(Outcome.SPINNING))
    code = where(distance < limits.distance, code, float(Outcome.OFF_PATH))
    code = where(state.position[2] >= ground, code, float(Outcome.CRASHED))
    everything = distance + state.velocity.norm() + state.rates.norm() + state.speeds.norm()
    everything = everything + absolute(command.thrust) + command.torque.norm()
    return where(finite(everything), code, float(Outcome.NOT_FINITE))

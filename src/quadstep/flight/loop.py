"""The closed loop of any plant: path, air, sensors, controller, actuators.

Each of them runs at its own rate; the tasks of a tick stand in the order in which they depend on each other. What a flight
does not have (air, sensing) is None in the loop and () in the cycle.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from quadstep.flight.closed_loop import Clock, Task
from quadstep.flight.integrator import runge_kutta_4
from quadstep.flight.plant import Air, Plant
from quadstep.guidance.reference import PathLaw
from quadstep.numbers import Number, Vector, vector
from quadstep.numbers.repeated import repeated
from quadstep.sensing.suite import Suite

STILL = vector(0.0, 0.0, 0.0)


class Cycle(NamedTuple):
    """What lives from step to step.

    state: the plant's. air: of the turbulence. sensed: of the sensors and the estimator. memory: the controller's. command:
    as it was asked for. held: what the actuators are told.
    """

    state: Any
    air: Any
    sensed: Any
    memory: Any
    command: Any
    held: Any


@dataclass(frozen=True)
class Loop:
    """The structure of a flight: which laws are composed. Its numbers are a NamedTuple of the plant's, `p`.

    p has `path`, `gains`, `limits`; with air `wind`; with noise `key`; with sensing `sensors`. guided: whether the
    controller's `guide` runs at a rate of its own.
    """

    plant: Plant
    path: PathLaw
    controller: Any
    air: Air | None = None
    sensing: Suite | None = None
    guided: bool = False

    @property
    def columns(self) -> Mapping[str, str]:
        """The plant's."""
        return self.plant.columns

    @property
    def tasks(self) -> tuple[Task, ...]:
        """Air, sensors, position loop, control, as far as there are."""
        air = (Task("air", self.stir),) if self.air and self.air.stirs else ()
        sensing = (Task("sensing", self.sense), Task("fix", self.fix)) if self.sensing else ()
        guidance = (Task("guidance", self.guide),) if self.guided else ()
        return (*air, *sensing, *guidance, Task("control", self.control))

    def start(self, start: Any, p: Any) -> Cycle:
        """The cycle before the first tick."""
        truth = self.plant.truth(start)
        sensed: Any = self.sensing.start(truth, p.sensors, p.key) if self.sensing else ()
        command, held = self.plant.rest(start, p)
        known = self.sensing.measured(sensed) if self.sensing else truth
        memory = self.controller.start(self.plant.told(known, held), p.gains)
        return Cycle(start, self.air.start() if self.air else (), sensed, memory, command, held)

    def stir(self, cycle: Cycle, p: Any, clock: Clock) -> tuple[Cycle, Number]:
        """The air one period later."""
        assert self.air
        return cycle._replace(air=self.air.stir(cycle.air, p, clock)), 0.0

    def sense(self, cycle: Cycle, p: Any, clock: Clock) -> tuple[Cycle, Number]:
        """Gyro and accelerometer, and what the estimator makes of them."""
        assert self.sensing
        felt = STILL
        if self.sensing.estimator:
            felt = self.plant.felt(p, cycle.state, self.rate(cycle, p, clock.time, cycle.state))
        truth = self.plant.truth(cycle.state)
        sensed = self.sensing.sense(cycle.sensed, truth, felt, p.sensors, p.key, clock.tick, clock.period)
        return cycle._replace(sensed=sensed), 0.0

    def fix(self, cycle: Cycle, p: Any, clock: Clock) -> tuple[Cycle, Number]:
        """A sample of position, velocity and attitude."""
        assert self.sensing
        truth = self.plant.truth(cycle.state)
        return cycle._replace(sensed=self.sensing.fix(cycle.sensed, truth, p.sensors, p.key, clock.tick, clock.period)), 0.0

    def told(self, cycle: Cycle) -> Any:
        """What the controller gets to know now."""
        known = self.sensing.measured(cycle.sensed) if self.sensing else self.plant.truth(cycle.state)
        return self.plant.told(known, cycle.held)

    def guide(self, cycle: Cycle, p: Any, clock: Clock) -> tuple[Cycle, Number]:
        """The position loop."""
        reference = self.path.reference(clock.time, p.path)
        memory = self.controller.guide(cycle.memory, self.told(cycle), reference, p.gains, clock.time, clock.period)
        return cycle._replace(memory=memory), 0.0

    def control(self, cycle: Cycle, p: Any, clock: Clock) -> tuple[Cycle, Number]:
        """The controller's law, what the actuators make of it, and whether the flight goes on."""
        reference = self.path.reference(clock.time, p.path)
        command, memory = self.controller.law(cycle.memory, self.told(cycle), reference, p.gains, clock.time, clock.period)
        code = self.plant.outcome(p, cycle.state, command, reference)
        return cycle._replace(memory=memory, command=command, held=self.plant.actuate(p, command)), code

    def wind(self, cycle: Cycle, p: Any, time: Number) -> Vector:
        """The wind [m/s] at time t [s], world axes."""
        return self.air.wind(cycle.air, p, time) if self.air else STILL

    def rate(self, cycle: Cycle, p: Any, time: Number, state: Any) -> Any:
        """Rate of every state, the actuators' commands held."""
        return self.plant.rate(p, state, cycle.held, self.wind(cycle, p, time), time)

    def advance(self, cycle: Cycle, p: Any, clock: Clock) -> Cycle:
        """The cycle one integrator step later; wind and events as they are in the middle of the step."""
        middle = clock.time + 0.5 * clock.period

        def rate(state: Any) -> Any:
            return self.rate(cycle, p, middle, state)

        state = runge_kutta_4(repeated(rate) if self.plant.compact else rate, cycle.state, clock.period)
        return cycle._replace(state=self.plant.settled(state))

    def row(self, cycle: Cycle, p: Any, time: Number) -> list[Number]:
        """One row of the log: the state now, the commands held."""
        reference, wind = self.path.reference(time, p.path), self.wind(cycle, p, time)
        return self.plant.row(p, cycle.state, self.told(cycle), cycle.command, cycle.held, reference, wind, time)

    # What is scored

    def position_error(self, cycle: Cycle, p: Any, time: Number) -> Vector:
        """The wanted position less the true one [m]."""
        return self.plant.error(cycle.state, self.path.reference(time, p.path))

    def inputs(self, cycle: Cycle) -> Vector:
        """What the actuators are told."""
        return self.plant.inputs(cycle.held)

    def weight_norms(self, cycle: Cycle) -> Vector:
        """Norm of each net's weights at the last sample."""
        return self.plant.weight_norms(cycle.command)

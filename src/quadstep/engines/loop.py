"""The closed loop of any plant: path, air, sensors, controller, actuators.

Each of them runs at its own rate; the tasks of a tick are in the order in which they depend on each other. Parts that a flight
does not have (air, sensing) are None in the loop and () in the cycle.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple, Protocol, TypeVar, cast

from quadstep.interfaces.closed_loop import Clock, Task
from quadstep.interfaces.controller import Controller
from quadstep.interfaces.plant import Air, PathLaw, Plant, Reference
from quadstep.numbers import Number, Structure, Vector, flatten, matrix, rebuild, scan, vector
from quadstep.numbers.noise import Key
from quadstep.numbers.scan import repeated
from quadstep.numbers.structure import answered, replaced
from quadstep.sensing.sensors import Sensors, filled, passed
from quadstep.sensing.suite import Suite, SuiteMemory

S = TypeVar("S", bound=tuple[Any, ...])


def along(state: S, step: Number, rate: S) -> S:
    """state + step * rate, part by part."""
    return same_kind(state, [part + step * change for part, change in zip(state, rate, strict=True)])


def runge_kutta_4(rate: Callable[[S], S], state: S, step: Number) -> S:
    """The state one step [s] later by the classical fourth-order Runge-Kutta method; a state is a `NamedTuple`."""
    k1 = rate(state)
    k2 = rate(along(state, 0.5 * step, k1))
    k3 = rate(along(state, 0.5 * step, k2))
    k4 = rate(along(state, step, k3))
    mean = same_kind(state, [a + 2.0 * (b + c) + d for a, b, c, d in zip(k1, k2, k3, k4, strict=True)])
    return along(state, step / 6.0, mean)


def same_kind(state: S, parts: list[Any]) -> S:
    return type(state)(*parts)


STILL = vector(0.0, 0.0, 0.0)


class Numbers(Protocol):
    """What a loop reads of a flight's parameters."""

    @property
    def path(self) -> Structure: ...

    @property
    def gains(self) -> Structure: ...


class SensedNumbers(Protocol):
    """What it reads of them besides where there are sensors, or noise of the law's own."""

    @property
    def sensors(self) -> Sensors: ...

    @property
    def key(self) -> Key: ...


def sensors_of(p: Numbers) -> tuple[Sensors, Key]:
    sensed = cast(SensedNumbers, p)
    return sensed.sensors, sensed.key


class Cycle(NamedTuple):
    """The state that persists from step to step.

    state: the plant's. air: of the turbulence. sensed: of the sensors and the estimator. memory: the controller's. command:
    as the controller gave it. held: the current actuator inputs. waiting: delayed actuator inputs, oldest first.
    """

    state: tuple[Structure, ...]
    air: Structure
    sensed: Structure
    memory: Structure
    command: Structure
    held: Structure
    waiting: tuple[Structure, ...] = ()


@dataclass(frozen=True)
class Loop:
    """The structure of a flight: which laws are composed. Its numbers are a NamedTuple of the plant's, `p`.

    p has `path`, `gains`, `limits`; with air `wind`; with noise `key`; with sensing `sensors`. guided: whether there is a task
    for the controller's `guide` even if it has none, so that another may take its place. late: delay in samples of the law
    until the actuators receive a command.
    """

    plant: Plant
    path: PathLaw
    controller: Controller
    air: Air | None = None
    sensing: Suite | None = None
    guided: bool = False
    late: int = 0

    @property
    def columns(self) -> Mapping[str, str]:
        return self.plant.columns

    @property
    def tasks(self) -> tuple[Task, ...]:
        """The tasks of air, sensors and controller, as far as the flight has them."""
        air = (Task("air", self.stir),) if self.air and self.air.stirs else ()
        sensing = (Task("sensing", self.sense), Task("fix", self.fix)) if self.sensing else ()
        return (*air, *sensing, *self.sampled)

    @property
    def sampled(self) -> tuple[Task, ...]:
        """The controller's loops, slowest first, and its law, each by its own name."""
        loops = self.controller.loops()
        if self.guided and "guide" not in loops:
            loops = ("guide", *loops)
        return (*(Task(name, partial(self.slower, name)) for name in loops), Task("law", self.law))

    def start(self, start: tuple[Structure, ...], p: Numbers) -> Cycle:
        truth = self.plant.truth(start)
        sensed: Structure = self.sensing.start(truth, *sensors_of(p)) if self.sensing else ()
        command, held = self.plant.rest(start, p)
        memory = self.controller.start(self.measured(start, sensed, held, p), p.gains)
        air: Structure = self.air.start() if self.air else ()
        return Cycle(start, air, sensed, memory, command, held, filled(held, self.late))

    def stir(self, cycle: Cycle, p: Numbers, clock: Clock) -> tuple[Cycle, Number]:
        assert self.air
        return cycle._replace(air=self.air.stir(cycle.air, p, clock)), 0.0

    def sense(self, cycle: Cycle, p: Numbers, clock: Clock) -> tuple[Cycle, Number]:
        """A sample of gyro and accelerometer, and the estimator's prediction."""
        assert self.sensing
        felt = STILL
        if self.sensing.feels:
            felt = self.plant.specific_force(p, cycle.state, self.rate(cycle, p, clock.time, cycle.state))
        truth = self.plant.truth(cycle.state)
        sensed = self.sensing.sense(cast(SuiteMemory, cycle.sensed), truth, felt, *sensors_of(p), clock.tick, clock.period)
        return cycle._replace(sensed=sensed), 0.0

    def fix(self, cycle: Cycle, p: Numbers, clock: Clock) -> tuple[Cycle, Number]:
        """A sample of position, velocity and attitude."""
        assert self.sensing
        truth = self.plant.truth(cycle.state)
        return cycle._replace(
            sensed=self.sensing.fix(cast(SuiteMemory, cycle.sensed), truth, *sensors_of(p), clock.tick, clock.period)
        ), 0.0

    def measurement(self, cycle: Cycle, p: Numbers) -> Structure:
        return self.measured(cycle.state, cycle.sensed, cycle.waiting[-1] if self.late else cycle.held, p)

    def measured(self, state: Structure, sensed: Structure, held: Structure, p: Numbers) -> Structure:
        """The same, before there is a cycle."""
        found = self.plant.measurement(
            self.sensing.measured(cast(SuiteMemory, sensed)) if self.sensing else self.plant.truth(state), held
        )
        also = self.controller.also_measures
        if not also:
            return found
        more: dict[str, Structure] = self.sensing.more(cast(SuiteMemory, sensed)) if self.sensing else {}
        if "rotor_speeds" in also:
            more["rotor_speeds"] = self.plant.rotor_speeds(state)
        if "full_speed" in also:
            more["full_speed"] = self.plant.full_speed(state, p)
        if "noise" in also:
            more["noise"] = cast(SensedNumbers, p).key
        return replaced(found, **{name: more[name] for name in also})

    def reference(self, time: Number, p: Numbers) -> Reference:
        """The reference at time t [s], as the controller needs it."""
        reference = self.path.reference(time, p.path)
        return reference._replace(ahead=self.ahead(time, p)) if self.controller.preview else reference

    def ahead(self, time: Number, p: Numbers) -> tuple[Reference, ...]:
        """The references that the controller needs at time t [s]: the path's code is emitted once and evaluated in a loop."""
        like: list[Reference] = []

        def look(now: Number, later: Vector) -> tuple[Number, Vector]:
            like.append(self.path.reference(now + later[0], p.path))
            return now, Vector(flatten(like[-1]))

        _, rows = scan(look, time, matrix(*((later,) for later in self.controller.preview)))
        return tuple(rebuild(like[0], iter(row)) for row in rows)

    def slower(self, name: str, cycle: Cycle, p: Numbers, clock: Clock) -> tuple[Cycle, Number]:
        """A sample of one of the controller's slower loops, such as `guide`."""
        given = self.measurement(cycle, p), self.reference(clock.time, p), p.gains, clock.time, clock.period
        return cycle._replace(memory=self.controller.slower(name, cycle.memory, *given)), 0.0

    def law(self, cycle: Cycle, p: Numbers, clock: Clock) -> tuple[Cycle, Number]:
        """The controller's law, the actuators' response to it, and whether the flight continues."""
        reference = self.reference(clock.time, p)
        asked, memory = self.controller.law(
            cycle.memory, self.measurement(cycle, p), reference, p.gains, clock.time, clock.period
        )
        command = self.plant.logged_command(p, asked)
        code = self.plant.outcome(p, cycle.state, command, reference)
        waiting, held = passed(cycle.waiting, self.plant.actuate(p, asked))
        return cycle._replace(memory=memory, command=command, held=held, waiting=waiting), code

    def wind(self, cycle: Cycle, p: Numbers, time: Number, state: Structure) -> Vector:
        """The wind [m/s] at time t [s] where a vehicle in this state is, world axes."""
        return answered(self.air.wind(cycle.air, p, time, self.plant.truth(state)), Vector, "wind") if self.air else STILL

    def rate(self, cycle: Cycle, p: Numbers, time: Number, state: Structure) -> tuple[Structure, ...]:
        """Rate of every state, the actuators' commands held."""
        wind = self.wind(cycle, p, time, state)
        return self.plant.rate(p, state, cycle.held, wind, time)

    def advance(self, cycle: Cycle, p: Numbers, clock: Clock) -> Cycle:
        """The cycle one integrator step later, with wind and events taken at the middle of the step."""
        middle = clock.time + 0.5 * clock.period

        def rate(state: tuple[Structure, ...]) -> tuple[Structure, ...]:
            return self.rate(cycle, p, middle, state)

        state = runge_kutta_4(repeated(rate) if self.plant.compact else rate, cycle.state, clock.period)
        return cycle._replace(state=self.plant.projected(state))

    def row(self, cycle: Cycle, p: Numbers, time: Number) -> list[Number]:
        """One row of the log: the state now, the commands held."""
        reference, wind = self.path.reference(time, p.path), self.wind(cycle, p, time, cycle.state)
        return self.plant.row(p, cycle.state, self.measurement(cycle, p), cycle.command, cycle.held, reference, wind, time)

    # Inputs of the score

    def position_error(self, cycle: Cycle, p: Numbers, time: Number) -> Vector:
        """The desired position less the true one [m]."""
        return self.plant.error(cycle.state, self.path.reference(time, p.path))

    def inputs(self, cycle: Cycle) -> Vector:
        return self.plant.inputs(cycle.held)

    def weight_norms(self, cycle: Cycle) -> Vector:
        """Norm of each net's weights at the last sample."""
        return self.plant.weight_norms(cycle.command)

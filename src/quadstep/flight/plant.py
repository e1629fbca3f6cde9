"""What is flown, and what surrounds it: a plant, the air it flies in, the sensors it is seen by."""

from collections.abc import Mapping
from typing import NamedTuple, Protocol

from quadstep.flight.closed_loop import Clock
from quadstep.guidance.reference import Reference
from quadstep.numbers import Number, Structure, Vector


class Rotor(NamedTuple):
    """A rotor as it is drawn: place in body axes [m], sense (1: counter-clockwise), column of its thrust."""

    position: tuple[float, float, float]
    spin: int
    column: str | None = None


class Drawn(NamedTuple):
    """How a vehicle is drawn. thrust, attitude: columns, three of the paper's angles or four of a quaternion.

    ground: its height [m], radius: of a rotor [m], if the vehicle knows them.
    """

    rotors: tuple[Rotor, ...] = ()
    thrust: str | None = None
    attitude: tuple[str, ...] = ("psi", "theta", "phi")
    ground: float | None = None
    radius: float | None = None


class Plant(Protocol):
    """A vehicle as laws over numbers. Structure only, hashable; its numbers are in the flight's parameters `p`.

    State, actuators (`held`: what they are told until the next sample) and parameters are NamedTuples of the plant's own.
    """

    @property
    def compact(self) -> bool:
        """Whether the compiler keeps the derivative as one function that a step calls four times."""
        ...

    @property
    def columns(self) -> Mapping[str, str]:
        """Name and unit of every logged column, in the order of `row`."""
        ...

    @property
    def axes(self) -> tuple[str, ...]:
        """Columns of the position; that of the wanted position is called the same with _d, its error is `error`."""
        ...

    @property
    def efforts(self) -> Mapping[str, str]:
        """Name and unit of each entry of `inputs`, as metrics call them."""
        ...

    @property
    def norms(self) -> tuple[str, ...]:
        """Name of each entry of `weight_norms`."""
        ...

    def body(self, p: Structure) -> Structure:
        """What has the vehicle's mass [kg], inertia [kg m^2] and gravity [m/s^2] among its numbers."""
        ...

    def rest(self, state: Structure, p: Structure) -> tuple[Structure, Structure]:
        """The command and the actuators before the first sample."""
        ...

    def truth(self, state: Structure) -> Structure:
        """What perfect sensors would measure."""
        ...

    def felt(self, p: Structure, state: Structure, rate: Structure) -> Vector:
        """What an accelerometer feels [m/s^2], body axes. rate: of the state. Only asked with an estimator."""
        ...

    def told(self, known: Structure, held: Structure) -> Structure:
        """What the controller gets to know: the measured motion, and what the actuators were told."""
        ...

    def rotor_speeds(self, state: Structure) -> Vector:
        """How fast the rotors turn [rad/s]; only asked by a law that measures it."""
        ...

    def asked(self, p: Structure, command: Structure) -> Structure:
        """A law's command as it is logged: without limits, and of one form, whatever forms the plant takes."""
        ...

    def actuate(self, p: Structure, command: Structure) -> Structure:
        """What the actuators are told to make of a command, within their limits."""
        ...

    def rate(self, p: Structure, state: Structure, held: Structure, wind: Vector, time: Number) -> Structure:
        """Rate of every state. wind [m/s]: world axes."""
        ...

    def settled(self, state: Structure) -> Structure:
        """The state after a step, back on its manifold."""
        ...

    def outcome(self, p: Structure, state: Structure, command: Structure, reference: Reference) -> Number:
        """The `Outcome` that ends the flight at a sample, 0 while all is well; one that is not finite goes before all else.

        command: as asked for, since a limit would hide NaN.
        """
        ...

    def error(self, state: Structure, reference: Reference) -> Vector:
        """The wanted position less the true one [m], along the plant's axes."""
        ...

    def inputs(self, held: Structure) -> Vector:
        """What the actuators are told, as metrics add it up."""
        ...

    def weight_norms(self, command: Structure) -> Vector:
        """Of what a law has learned, as its command says."""
        ...

    def drawn(self, p: Structure) -> Drawn:
        """How it is drawn."""
        ...

    def row(
        self,
        p: Structure,
        state: Structure,
        told: Structure,
        command: Structure,
        held: Structure,
        reference: Reference,
        wind: Vector,
        time: Number,
    ) -> list[Number]:
        """One row of the log, in the order of `columns`."""
        ...


class Air(Protocol):
    """Air that moves. Its numbers are `p.wind`, the words of its noise `p.key`."""

    @property
    def stirs(self) -> bool:
        """Whether something of it lives from step to step."""
        ...

    def start(self) -> Structure:
        """Its state before the first tick."""
        ...

    def stir(self, air: Structure, p: Structure, clock: Clock) -> Structure:
        """Its state one period later."""
        ...

    def wind(self, air: Structure, p: Structure, time: Number) -> Vector:
        """The wind [m/s] at time t [s], world axes."""
        ...

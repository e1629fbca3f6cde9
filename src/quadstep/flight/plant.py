"""What is flown, and what surrounds it: a plant, the air it flies in, the sensors it is seen by."""

from collections.abc import Mapping
from typing import Any, NamedTuple, Protocol

from typing_extensions import TypeVar

from quadstep.flight.closed_loop import Clock
from quadstep.guidance.reference import Reference
from quadstep.numbers import Number, Vector


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


class Body(Protocol):
    """A vehicle's mass [kg], its inertia about each axis [kg m^2] and gravity [m/s^2]."""

    @property
    def mass(self) -> Number: ...

    @property
    def inertia(self) -> Vector: ...

    @property
    def gravity(self) -> Number: ...


P_contra = TypeVar("P_contra", contravariant=True, default=Any)
"""A plant's parameters."""

X = TypeVar("X", default=Any)
"""Its state."""

C_contra = TypeVar("C_contra", contravariant=True, default=Any)
"""The commands that it takes, of one form or several."""

U = TypeVar("U", default=Any)
"""A command as it is logged."""

H = TypeVar("H", default=Any)
"""What its actuators are told."""

K = TypeVar("K", default=Any)
"""What perfect sensors would measure."""

Y = TypeVar("Y", default=Any)
"""What its controller gets to know."""

A = TypeVar("A", default=Any)
"""The state of air that moves."""


class Plant(Protocol[P_contra, X, C_contra, U, H, K, Y]):
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

    def body(self, p: P_contra) -> Body:
        """What has the vehicle's mass [kg], inertia [kg m^2] and gravity [m/s^2] among its numbers."""
        ...

    def rest(self, state: X, p: P_contra) -> tuple[U, H]:
        """The command and the actuators before the first sample."""
        ...

    def truth(self, state: X) -> K:
        """What perfect sensors would measure."""
        ...

    def felt(self, p: P_contra, state: X, rate: X) -> Vector:
        """What an accelerometer feels [m/s^2], body axes. rate: of the state. Only asked with an estimator."""
        ...

    def told(self, known: K, held: H) -> Y:
        """What the controller gets to know: the measured motion, and what the actuators were told."""
        ...

    def rotor_speeds(self, state: X) -> Vector:
        """How fast the rotors turn [rad/s]; only asked by a law that measures it."""
        ...

    def asked(self, p: P_contra, command: C_contra) -> U:
        """A law's command as it is logged: without limits, and of one form, whatever forms the plant takes."""
        ...

    def actuate(self, p: P_contra, command: C_contra) -> H:
        """What the actuators are told to make of a command, within their limits."""
        ...

    def rate(self, p: P_contra, state: X, held: H, wind: Vector, time: Number) -> X:
        """Rate of every state. wind [m/s]: world axes."""
        ...

    def settled(self, state: X) -> X:
        """The state after a step, back on its manifold."""
        ...

    def outcome(self, p: P_contra, state: X, command: U, reference: Reference) -> Number:
        """The `Outcome` that ends the flight at a sample, 0 while all is well; one that is not finite goes before all else.

        command: as asked for, since a limit would hide NaN.
        """
        ...

    def error(self, state: X, reference: Reference) -> Vector:
        """The wanted position less the true one [m], along the plant's axes."""
        ...

    def inputs(self, held: H) -> Vector:
        """What the actuators are told, as metrics add it up."""
        ...

    def weight_norms(self, command: U) -> Vector:
        """Of what a law has learned, as its command says."""
        ...

    def drawn(self, p: P_contra) -> Drawn:
        """How it is drawn."""
        ...

    def row(
        self,
        p: P_contra,
        state: X,
        told: Y,
        command: U,
        held: H,
        reference: Reference,
        wind: Vector,
        time: Number,
    ) -> list[Number]:
        """One row of the log, in the order of `columns`."""
        ...


class Air(Protocol[A, P_contra]):
    """Air that moves. Its numbers are `p.wind`, the words of its noise `p.key`."""

    @property
    def stirs(self) -> bool:
        """Whether something of it lives from step to step."""
        ...

    def start(self) -> A:
        """Its state before the first tick."""
        ...

    def stir(self, air: A, p: P_contra, clock: Clock) -> A:
        """Its state one period later."""
        ...

    def wind(self, air: A, p: P_contra, time: Number) -> Vector:
        """The wind [m/s] at time t [s], world axes."""
        ...

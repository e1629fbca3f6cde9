"""What the paper's plant and real vehicles have in common: three axes, a thrust and three torques, two nets."""

from collections.abc import Mapping
from typing import ClassVar, Generic, Protocol, TypeVar, cast

from quadstep.interfaces.controller import Command
from quadstep.interfaces.reference import Reference
from quadstep.numbers import Number, Vector, absolute, maximum


class Acting(Protocol):
    """What the actuators make of a command: thrust [N], torque [N m]."""

    @property
    def thrust(self) -> Number: ...

    @property
    def torque(self) -> Vector: ...


class Placed(Protocol):
    """A state with a position [m]."""

    @property
    def position(self) -> Vector: ...


P = TypeVar("P")
"""The plant's parameters."""

X = TypeVar("X", bound=Placed)
"""Its state."""

C = TypeVar("C")
"""The commands that it takes."""


class InSpace(Generic[P, X, C]):
    """Part of a `Plant` whose state has a position and rates, three numbers each."""

    axes: ClassVar[tuple[str, ...]] = ("x", "y", "z")
    efforts: ClassVar[Mapping[str, str]] = {"thrust": "N", "torque_1": "N m", "torque_2": "N m", "torque_3": "N m"}
    norms: ClassVar[tuple[str, ...]] = ("norm_W1", "norm_W2")

    def error(self, state: X, reference: Reference) -> Vector:
        """e1 (Eq. 11)."""
        return reference.position - state.position

    def rotor_speeds(self, state: X) -> Vector:
        """Never asked, unless the rotors' speeds are states."""
        raise NotImplementedError

    def asked(self, p: P, command: C) -> Command:
        """As it is."""
        return cast(Command, command)

    def inputs(self, held: Acting) -> Vector:
        """Thrust [N] and torque [N m]."""
        return Vector((held.thrust, *held.torque))

    def weight_norms(self, command: Command) -> Vector:
        """Frobenius norms of both nets' weights."""
        return command.weight_norms


def fastest(rates: Vector) -> Number:
    """The largest magnitude of three rates."""
    return maximum(maximum(absolute(rates[0]), absolute(rates[1])), absolute(rates[2]))

"""What the paper's plant and real vehicles have in common: three axes, a thrust and three torques, two nets."""

from collections.abc import Mapping
from typing import ClassVar, Protocol

from quadstep.control.controller import Command
from quadstep.guidance.reference import Reference
from quadstep.numbers import Number, Structure, Vector, absolute, maximum


class Acting(Protocol):
    """What the actuators make of a command: thrust [N], torque [N m]."""

    @property
    def thrust(self) -> Number: ...

    @property
    def torque(self) -> Vector: ...


class InSpace:
    """Part of a `Plant` whose state has a position and rates, three numbers each."""

    axes: ClassVar[tuple[str, ...]] = ("x", "y", "z")
    efforts: ClassVar[Mapping[str, str]] = {"thrust": "N", "torque_1": "N m", "torque_2": "N m", "torque_3": "N m"}
    norms: ClassVar[tuple[str, ...]] = ("norm_W1", "norm_W2")

    def error(self, state: Structure, reference: Reference) -> Vector:
        """e1 (Eq. 11)."""
        position: Vector = state.position
        return reference.position - position

    def rotor_speeds(self, state: Structure) -> Vector:
        """Never asked, unless the rotors' speeds are states."""
        raise NotImplementedError

    def asked(self, p: Structure, command: Structure) -> Command:
        """As it is."""
        asked: Command = command
        return asked

    def inputs(self, held: Acting) -> Vector:
        """Thrust [N] and torque [N m]."""
        return Vector((held.thrust, *held.torque))

    def weight_norms(self, command: Command) -> Vector:
        """Frobenius norms of both nets' weights."""
        return command.weight_norms


def fastest(rates: Vector) -> Number:
    """The largest magnitude of three rates."""
    return maximum(maximum(absolute(rates[0]), absolute(rates[1])), absolute(rates[2]))

"""A controller that is any Python callable, called at every sample of the attitude loop, not compiled.

    def controller(t, measured, reference):
        ...
        return thrust, torque

    with flying(controller) as (law, gains):
        log = fly(plan.with_controller(law, gains))

An exception in the controller ends the flight as not finite, and is raised again on leaving the block. A controller that
keeps state must fly alone: all flights of a batch call the same callable.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from typing import ClassVar, NamedTuple, TypeAlias, cast

import numpy as np
from numpy.typing import NDArray

from quadstep.interfaces.controller import Command, G, Measured
from quadstep.interfaces.controller import Controller as Law
from quadstep.interfaces.plant import Model, Reference, U
from quadstep.io.user_code import defined_at
from quadstep.numbers import Number, Vector
from quadstep.numbers.scan import call, raise_pending, register, release

Array: TypeAlias = NDArray[np.float64]


class MeasuredArrays(NamedTuple):
    """The measurements passed to an opaque controller.

    position (3,) [m], velocity (3,) [m/s]: world, z up. attitude (4,): unit quaternion (w, x, y, z), body to world.
    rates (3,): about the body's axes [rad/s]. period: until the next call [s]. On the paper's plant attitude (3,): psi, theta,
    phi [rad], and rates (3,): of these angles.
    """

    position: Array
    velocity: Array
    attitude: Array
    rates: Array
    period: float


class ReferenceArrays(NamedTuple):
    """The reference motion. position (3,) [m], velocity (3,) [m/s], acceleration (3,) [m/s^2]; yaw [rad], yaw_rate [rad/s]."""

    position: Array
    velocity: Array
    acceleration: Array
    yaw: float
    yaw_rate: float


Controller: TypeAlias = Callable[[float, MeasuredArrays, ReferenceArrays], tuple[float, Sequence[float] | Array]]
"""controller(t, measured, reference) gives thrust [N] and the torque about the body's axes [N m]."""


class NoGains(NamedTuple):
    """Nothing to declare."""


class OpaqueGains(NamedTuple):
    """handle: of the callable, as `quadstep.numbers.scan.register` gave it."""

    handle: Number


@dataclass(frozen=True)
class Opaque(Law[tuple[()], Measured, G, U]):
    """Calls the callable; has no memory of its own."""

    Gains: ClassVar[type] = OpaqueGains
    nature: ClassVar[str] = "plain Python code"

    def start(self, measured: Measured, gains: G) -> tuple[()]:
        return ()

    def law(
        self, memory: tuple[()], measured: Measured, reference: Reference, gains: G, t: Number, period: Number
    ) -> tuple[U, tuple[()]]:
        """One sample. The callable's desired attitude is not known, so none is logged."""
        inputs = [
            t,
            period,
            *measured.position,
            *measured.velocity,
            *measured.attitude,
            *measured.rates,
            *reference.position,
            *reference.velocity,
            *reference.acceleration,
            reference.yaw,
            reference.yaw_rate,
        ]
        thrust, *torque = call(cast(OpaqueGains, gains).handle, inputs, 4)
        return cast(U, Command(thrust, Vector(torque))), memory


LAWS: dict[tuple[int, str, type], type[Law]] = {}
"""By the callable's id, for it need not be hashable, name, and what it is told."""


def opaque_law(function: Controller, name: str, told: type = Measured) -> type[Law]:
    """A controller that calls this callable, for missions: the same class each time, so that flights can be batched.

    It has no gains; any state of the callable is shared by all flights. told: what the vehicle tells its controllers,
    `Measured` or the `State` of the paper's plant.
    """
    key = id(function), name, told
    if key not in LAWS:
        LAWS[key] = new_opaque_law(function, name, told)
    return LAWS[key]


def new_opaque_law(function: Controller, name: str, told: type) -> type[Law]:
    """The same, made. It is never released."""
    handle = cache(lambda: register(friendly(function)))

    class Own(Opaque):
        Gains = NoGains

        def prepare(self, gains: NoGains, model: Model) -> OpaqueGains:
            return OpaqueGains(float(handle()))

        def after_flight(self, gains: OpaqueGains) -> None:
            raise_pending(int(gains.handle))

    Own.name = Own.label = Own.__name__ = name
    inner = getattr(function, "func", function)  # of functools.partial
    Own.measures, Own.__module__ = told, getattr(inner, "__module__", Own.__module__)
    return Own


def friendly(controller: Controller) -> Callable[[Array], list[float]]:
    """The controller as a function from an array of 26 numbers to four; 25 where the attitude is three angles."""

    def function(inputs: Array) -> list[float]:
        t, period, yaw, yaw_rate = (float(inputs[i]) for i in (0, 1, -2, -1))
        measured = MeasuredArrays(inputs[2:5], inputs[5:8], inputs[8:-14], inputs[-14:-11], period)
        reference = ReferenceArrays(inputs[-11:-8], inputs[-8:-5], inputs[-5:-2], yaw, yaw_rate)
        returned = controller(t, measured, reference)
        try:
            thrust, torque = returned
            x, y, z = torque
            told = [float(thrust), float(x), float(y), float(z)]
        except (TypeError, ValueError) as error:
            said = f"should return thrust and torque, like (9.8, (0.0, 0.0, 0.0)), not {returned!r:.60}"
            raise type(error)(f"{said}{defined_at(controller)}") from None
        if t == 0.0 and not all(map(math.isfinite, told)):
            said = f"should return finite thrust and torque at t = 0 s, not {returned!r:.60}"
            raise ValueError(f"{said}{defined_at(controller)}")
        return told

    return memoised(function)


def memoised(function: Callable[[Array], list[float]]) -> Callable[[Array], list[float]]:
    """The function, which repeats its output when called again with equal inputs: lanes that fill a block repeat a flight, and
    a controller with state must see each of its samples once.
    """
    asked, answer = b"", [0.0]

    def asking(inputs: Array) -> list[float]:
        nonlocal asked, answer
        question = inputs.tobytes()
        if question != asked:
            asked, answer = question, function(inputs)
        return answer

    return asking


@contextmanager
def flying(controller: Controller) -> Iterator[tuple[Opaque, OpaqueGains]]:
    """A law and gains that fly this callable inside the block; re-raises its exception after the block."""
    handle = register(friendly(controller))
    try:
        yield Opaque(), OpaqueGains(float(handle))
        raise_pending(handle)
    finally:
        release(handle)

"""Hover at the path's end: an equilibrium of the sampled loop, and the eigenvalues of its Jacobian, enclosed.

That a state is an equilibrium in exact arithmetic is shown with numbers that are known exactly or not at all: a fraction, or
None for a number whose exact value is not known; zero times any number is zero.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from math import isqrt
from operator import ge, gt, le, lt
from typing import NamedTuple, TypeAlias

import numpy as np

from quadstep.engines.fly import FlightPlan
from quadstep.mission.schema import Mission
from quadstep.numbers import Vector
from quadstep.numbers.enclosure import UndefinedError
from quadstep.numbers.operation import Arithmetic, Kind, Operation, Rule
from quadstep.proofs.prove.jet import Jet, bounded, jets
from quadstep.proofs.prove.linear_maps import Spectrum, spectrum
from quadstep.proofs.prove.sampled import Array, SampledLoop

Operand: TypeAlias = "ExactNumber | float"


def compared(relation: Callable[[Fraction, float | Fraction], bool]) -> Callable[[ExactNumber, Operand], bool | ExactNumber]:
    """Whether a relation holds, or that this is not known."""

    def between(a: ExactNumber, b: Operand) -> bool | ExactNumber:
        other = exact(b)
        right = float(b) if other.value is None and not isinstance(b, ExactNumber) else other.value
        return ExactNumber(None) if a.value is None or right is None else relation(a.value, right)

    return between


class ExactNumber(Arithmetic["Operand"]):
    """value: exact, or None."""

    __slots__ = ("value",)
    __array_ufunc__ = None
    functions: Knowns

    def __init__(self, value: Fraction | None) -> None:
        self.value = value

    def __add__(self, other: Operand) -> ExactNumber:
        return combined(self, other, lambda a, b: a + b)

    __radd__ = __add__

    def __neg__(self) -> ExactNumber:
        return ExactNumber(None if self.value is None else -self.value)

    def __mul__(self, other: Operand) -> ExactNumber:
        if not isinstance(other, ExactNumber | float | int):
            return NotImplemented
        other = exact(other)
        return ExactNumber(Fraction(0)) if 0 in (self.value, other.value) else combined(self, other, lambda a, b: a * b)

    __rmul__ = __mul__

    def __truediv__(self, other: Operand) -> ExactNumber:
        other = exact(other)
        if other.value == 0:
            return ExactNumber(None)
        return self * ExactNumber(None if other.value is None else 1 / other.value)

    def __rtruediv__(self, other: Operand) -> ExactNumber:
        return exact(other) / self

    def __abs__(self) -> ExactNumber:
        return ExactNumber(None if self.value is None else abs(self.value))

    __lt__, __le__, __gt__, __ge__ = compared(lt), compared(le), compared(gt), compared(ge)


def exact(x: Operand) -> ExactNumber:
    """A number as one of these."""
    if isinstance(x, ExactNumber):
        return x
    try:
        return ExactNumber(Fraction(float(x)))
    except (OverflowError, ValueError):  # infinite or NaN
        return ExactNumber(None)


def combined(a: ExactNumber, b: Operand, operation: Callable[[Fraction, Fraction], Fraction]) -> ExactNumber:
    """An operation on two known numbers."""
    b = exact(b)
    return ExactNumber(None if a.value is None or b.value is None else operation(a.value, b.value))


class Knowns(Kind):
    """The functions of `quadstep.numbers`, where their values are fractions."""

    @staticmethod
    def rule(operation: Operation) -> Rule:
        return lambda _, *given: ExactNumber(operation.exact(*(exact(one).value for one in given)))

    def sqrt(self, x: ExactNumber) -> ExactNumber:
        if x.value is None or x.value < 0:
            return ExactNumber(None)
        root = Fraction(isqrt(x.value.numerator), isqrt(x.value.denominator))
        return ExactNumber(root if root * root == x.value else None)

    def where(self, condition: bool | ExactNumber, yes: Operand, no: Operand) -> Operand:
        return condition if isinstance(condition, ExactNumber) else yes if condition else no


ExactNumber.functions = Knowns()


class Hover(NamedTuple):
    """state: of the sampled loop, in the order of its names. tick: from which the path is at rest. position [m]."""

    state: list[float]
    tick: float
    position: tuple[float, ...]


class Instability(NamedTuple):
    """Eigenvalues outside the unit circle: how many out of how many, and bounds on the rate [1/s] of the fastest growth."""

    unstable: int
    states: int
    slowest: float
    fastest: float


def hover(mission: Mission, plan: FlightPlan, loop: SampledLoop) -> Hover | None:
    """Hover at the path's end; None if the path is not at rest there. Raises UserError."""
    tick = float(loop.samples * loop.span)
    reference = loop.loop.path.reference(tick * loop.ticks.step, loop.parameters.path)
    if any((*reference.velocity, *reference.acceleration, reference.yaw_rate)):
        return None
    start = getattr(mission, "start", None)  # where it begins on the path, there is no such table
    still = mission.model_copy(update={"start": type(start)()}) if start else mission
    start = still.build(mission.path.build(mission.folder)).start(reference)
    position: Vector = reference.position
    return Hover(loop.at_rest(loop.loop.start(start, plan.parameters)), tick, tuple(map(float, position)))


def is_equilibrium(loop: SampledLoop, at: Hover) -> bool:
    """Whether the loop stays there in exact arithmetic, number by number."""
    after = loop.step([exact(value) for value in at.state], at.tick)
    pairs = [(exact(a).value, exact(b).value) for a, b in zip(after, at.state, strict=True)]
    return all(a is not None and a == b for a, b in pairs)


def jacobian(loop: SampledLoop, at: Hover) -> tuple[Array, Array]:
    """Midpoint and radius of the Jacobian, (states, states), for the law in exact arithmetic. Raises UndefinedError."""
    count = len(at.state)
    middle, radius = np.zeros((count, count)), np.zeros((count, count))
    with np.errstate(all="ignore"):  # unbounded slopes of numbers that decide nothing
        numbers = loop.step(jets(at.state), at.tick)
    for row, number in enumerate(numbers):
        if isinstance(number, Jet):
            if number.kinked or not bounded(number):
                raise UndefinedError(f"{loop.in_words(loop.names[row])} has no derivative there")
            middle[row], radius[row] = number.slopes.centre[:, 0], number.slopes.tight[:, 0]
    return middle, radius


def instability(loop: SampledLoop, at: Hover) -> Instability | None:
    """Proof that hover is not a stable equilibrium; None if it cannot be shown this way."""
    try:
        if not is_equilibrium(loop, at):
            return None
        found = spectrum(*jacobian(loop, at))
    except UndefinedError:
        return None
    count = 0 if found is None else found.outside
    if found is None or not count:
        return None
    return Instability(count, len(at.state), *growth(found, loop.period))


def growth(spectrum: Spectrum, period: float) -> tuple[float, float]:
    """Bounds on the growth rate [1/s] of the largest eigenvalue."""
    size, radius = abs(spectrum.centres[0]), spectrum.radii[0]
    return float(np.log(size - radius)) / period * (1.0 - 1e-12), float(np.log(size + radius)) / period * (1.0 + 1e-12)

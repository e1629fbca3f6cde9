"""Fixed-step integration of a structure of numbers."""

from collections.abc import Callable
from typing import Any, TypeVar

from quadstep.numbers import Number

S = TypeVar("S", bound=tuple[Any, ...])


def along(state: S, step: Number, rate: S) -> S:
    """state + step * rate, part by part."""
    return alike(state, [part + step * change for part, change in zip(state, rate, strict=True)])


def runge_kutta_4(rate: Callable[[S], S], state: S, step: Number) -> S:
    """The state one step [s] later by the classical fourth-order Runge-Kutta method; a state is a `NamedTuple`."""
    k1 = rate(state)
    k2 = rate(along(state, 0.5 * step, k1))
    k3 = rate(along(state, 0.5 * step, k2))
    k4 = rate(along(state, step, k3))
    mean = alike(state, [a + 2.0 * (b + c) + d for a, b, c, d in zip(k1, k2, k3, k4, strict=True)])
    return along(state, step / 6.0, mean)


def alike(state: S, parts: list[Any]) -> S:
    """A structure of the same type with other parts."""
    return type(state)(*parts)

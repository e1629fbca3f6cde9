"""Fixed-step integration of a structure of numbers."""

from collections.abc import Callable

from quadstep.numbers import Number
from quadstep.vehicle.state import State


def along(state: State, step: Number, rate: State) -> State:
    """state + step * rate, part by part."""
    return State(*(part + step * change for part, change in zip(state, rate, strict=True)))


def runge_kutta_4(rate: Callable[[State], State], state: State, step: Number) -> State:
    """The state one step [s] later by the classical fourth-order Runge-Kutta method."""
    k1 = rate(state)
    k2 = rate(along(state, 0.5 * step, k1))
    k3 = rate(along(state, 0.5 * step, k2))
    k4 = rate(along(state, step, k3))
    mean = State(*(a + 2.0 * (b + c) + d for a, b, c, d in zip(k1, k2, k3, k4, strict=True)))
    return along(state, step / 6.0, mean)

"""Hover at the path's end: an equilibrium of the sampled loop, and the eigenvalues of its Jacobian, enclosed."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from quadstep.engines.fly import FlightPlan
from quadstep.interfaces.reference import Reference
from quadstep.mission.schema import Mission
from quadstep.numbers import Vector
from quadstep.numbers.enclosure import UndefinedError
from quadstep.proofs.prove.jet import Jet, bounded, jets
from quadstep.proofs.prove.known import exact
from quadstep.proofs.prove.sampled import Array, Sampled
from quadstep.proofs.prove.spectrum import Spectrum, spectrum


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


def resting(reference: Reference) -> bool:
    """Whether a path is at rest there."""
    rates = (*reference.velocity, *reference.acceleration, reference.yaw_rate)
    return not any(rates)


def hover(mission: Mission, plan: FlightPlan, loop: Sampled) -> Hover | None:
    """Hover at the path's end; None if the path is not at rest there. Raises UserError."""
    tick = float(loop.samples * loop.span)
    reference = loop.loop.path.reference(tick * loop.ticks.step, loop.parameters.path)
    if not resting(reference):
        return None
    start = getattr(mission, "start", None)  # where it begins on the path, there is no such table
    still = mission.model_copy(update={"start": type(start)()}) if start else mission
    start = still.build(mission.path.build(mission.folder)).start(reference)
    position: Vector = reference.position
    return Hover(loop.at_rest(loop.loop.start(start, plan.parameters)), tick, tuple(map(float, position)))


def is_equilibrium(loop: Sampled, at: Hover) -> bool:
    """Whether the loop stays there in exact arithmetic, number by number."""
    after = loop.step([exact(value) for value in at.state], at.tick)
    pairs = [(exact(a).value, exact(b).value) for a, b in zip(after, at.state, strict=True)]
    return all(a is not None and a == b for a, b in pairs)


def jacobian(loop: Sampled, at: Hover) -> tuple[Array, Array]:
    """Midpoint and radius of the Jacobian, (states, states), for the law in exact arithmetic. Raises UndefinedError."""
    count = len(at.state)
    middle, radius = np.zeros((count, count)), np.zeros((count, count))
    with np.errstate(all="ignore"):  # unbounded slopes of numbers that decide nothing
        numbers = loop.step(jets(at.state), at.tick)
    for row, number in enumerate(numbers):
        if isinstance(number, Jet):
            if number.kinked or not bounded(number):
                raise UndefinedError(f"{loop.names[row]} has no slope there")
            middle[row], radius[row] = number.slopes.centre[:, 0], number.slopes.tight[:, 0]
    return middle, radius


def instability(loop: Sampled, at: Hover) -> Instability | None:
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


def growth(found: Spectrum, period: float) -> tuple[float, float]:
    """Bounds on the growth rate [1/s] of the largest eigenvalue."""
    size, radius = abs(found.centres[0]), found.radii[0]
    return float(np.log(size - radius)) / period * (1.0 - 1e-12), float(np.log(size + radius)) / period * (1.0 + 1e-12)

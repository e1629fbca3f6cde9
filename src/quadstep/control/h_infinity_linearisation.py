"""Exact linearisation with an H-infinity law outside, after the paper's [7] and [14].

Mokhtari, Benallegue, Daachi (2006) linearise the vehicle by dynamic feedback, which makes position a chain of four
integrators, and close it by a robust law, since what the model misses comes in as a disturbance. Per axis, with time in
units of 1/pace,

    x = (int e, e, e', e'', e'''),    e'' <- e'' + w,    z = (sqrt(weights) x, u),

where w is the acceleration that nobody accounts for. The state feedback keeps the L2 gain from w to z below gamma (Doyle,
Glover, Khargonekar, Francis 1989); gamma is `margin` times the least there is.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

from quadstep.control.thrust_extended_backstepping import Push, ThrustExtendedMemory, driving, motion
from quadstep.control.vectoring import project
from quadstep.interfaces.controller import Command, Controller, Measured
from quadstep.interfaces.gain import believed, gain, given, usual
from quadstep.interfaces.plant import Model, Reference
from quadstep.numbers import Number, Vector, sqrt, vector
from quadstep.numbers.solve import cholesky, riccati
from quadstep.numbers.structure import from_fields

PARTS = ("integral", "position", "velocity", "acceleration", "jerk")
STATES, PUSHED = len(PARTS), 2
"""Of the chain; w drives the third of them."""

LEAST_GAMMA, MOST_GAMMA, HALVINGS = 0.1, 1e4, 24
"""Where the least gamma is looked for, by halving on a logarithmic scale."""


class HInfinityWeights(NamedTuple):
    """The vehicle parameters that the controller assumes, and what the law is made from.

    pace: unit of time. weights: on the squared states in that unit, against that of the input.
    """

    mass: Number = believed("mass")
    inertia: Vector = believed("inertia")
    gravity: Number = given(lambda model: model.gravity)
    most_thrust: Number = given(lambda model: model.most_thrust)
    pace: Number = gain(usual(2.33, 1), "1/s", "speed of the loop")
    weights: Vector = gain((1.02, 2.33, 6.1, 4.35, 1.15), "-", "weights of the integral, position and its rates", parts=PARTS)
    margin: Number = gain(1.12, "-", "gamma over the smallest achievable", low=1.01, high=10.0)
    steady: Number = gain(8.0, "m/s^2", "largest steady acceleration that the integral compensates")
    heading: Number = gain(usual(30.0, 2, "yaw"), "1/s^2", "stiffness of the heading", key="k_psi")
    turning: Number = gain(usual(10.0, 1, "yaw"), "1/s", "damping of the heading", key="k_r")


class HInfinityGains(NamedTuple):
    """What the law flies, worked out from `HInfinityWeights`.

    feedback: on the five states, giving snap [m/s^4]. integral_bound: of the integral of the position error [m s].
    """

    mass: Number
    inertia: Vector
    gravity: Number
    most_thrust: Number
    feedback: Vector
    integral_bound: Number
    heading: Number
    turning: Number


def solution(weights: Sequence[float], gamma: float) -> list[list[float]] | None:
    """The stabilising positive definite X for this gamma; None where there is none."""
    chain = [[1.0 if j == i + 1 else 0.0 for j in range(STATES)] for i in range(STATES)]
    squares = [[0.0] * STATES for _ in range(STATES)]
    squares[-1][-1], squares[PUSHED][PUSHED] = 1.0, -1.0 / (gamma * gamma)
    cost = [[weight if i == j else 0.0 for j in range(STATES)] for i, weight in enumerate(weights)]
    try:
        found = riccati(chain, squares, cost)
        cholesky(found)
    except ValueError:
        return None
    return found


@lru_cache(maxsize=256)
def least_gamma(weights: tuple[float, ...]) -> float:
    """The least gamma for which there is a law."""
    low, high = LEAST_GAMMA, MOST_GAMMA
    for _ in range(HALVINGS):
        middle = sqrt(low * high)
        low, high = (low, middle) if solution(weights, middle) else (middle, high)
    return high


def feedback(weights: tuple[float, ...], margin: float, pace: float) -> list[float]:
    """Gains on the five states, K = (0, 0, 0, 0, 1) X, back in seconds.

    Raises ValueError where there is no law.
    """
    found = solution(weights, max(margin, 1.0 + 1e-6) * least_gamma(weights))
    if found is None:
        raise ValueError("no H-infinity law for these weights")
    scale, gains = 1.0, []
    for one in reversed(found[-1]):
        scale *= pace
        gains.append(one * scale)
    return gains[::-1]


@dataclass(frozen=True)
class HInfinityLinearisation(Controller):
    """Position and attitude in one, at the attitude loop's rate."""

    name = "h-infinity-linearisation"
    label = "exact linearisation with an H-infinity law"
    source = "Mokhtari, Benallegue, Daachi 2006; Yang, Liu 2003"
    Gains = HInfinityWeights

    def prepare(self, gains: HInfinityWeights, model: Model) -> HInfinityGains:
        found = feedback(tuple(gains.weights), gains.margin, gains.pace)
        return from_fields(HInfinityGains, gains, feedback=Vector(found), integral_bound=gains.steady * found[3] / found[0])

    def start(self, measured: Measured, gains: HInfinityGains) -> ThrustExtendedMemory:
        return ThrustExtendedMemory(Push(gains.gravity, 0.0), vector(0.0, 0.0, 0.0))

    def law(
        self, memory: ThrustExtendedMemory, measured: Measured, reference: Reference, gains: HInfinityGains,
        t: Number, period: Number,
    ) -> tuple[Command, ThrustExtendedMemory]:  # fmt: skip
        """One sample: the snap that the law asks for, and the inputs that make it."""
        now = motion(measured, memory.push)
        falling = now.force - vector(0.0, 0.0, gains.gravity)
        e = reference.position - measured.position
        states = (
            memory.integral,
            e,
            reference.velocity - measured.velocity,
            reference.acceleration - falling,
            reference.jerk - now.force_rate,
        )
        snap = reference.snap
        for one, state in zip(gains.feedback, states, strict=True):
            snap = snap + one * state
        made = driving(memory.push, snap, measured, reference, gains, period)
        integral = project(memory.integral + period * e, gains.integral_bound)
        return Command(made.thrust, made.torque), ThrustExtendedMemory(made.push, integral)

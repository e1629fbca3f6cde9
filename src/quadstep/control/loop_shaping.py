"""H-infinity loop shaping of the position loop: McFarlane and Glover (1992), after the paper's [23].

Cheng and Huzmezan (2003) fly a position law by loop shaping. The plant from a wanted acceleration to position, a double
integrator behind the lag of the attitude loop, is shaped by a PI weight, and the law is the one that is robust against the
largest error of its normalised coprime factors: a filter of four states an axis. It knows the position alone, no velocity.
Inside, body rates turn the vehicle to the wanted force.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from quadstep.control.vectoring import project, turning_attitude, up_axis, within
from quadstep.interfaces.controller import BodyRates, Controller, Measured
from quadstep.interfaces.gain import believed, gain, given, usual
from quadstep.interfaces.plant import Model, Reference
from quadstep.numbers import Matrix, Number, Vector, sqrt, vector
from quadstep.numbers.rotations import conjugate, multiply, rotation_matrix, rotation_vector, yaw_pitch_roll
from quadstep.numbers.solve import dot, inverse, product, riccati, transposed
from quadstep.numbers.structure import from_fields

ITERATIONS = 200
"""Of the power method."""


class LoopShapingWeights(NamedTuple):
    """The vehicle parameters that the controller assumes, and what the law is made from."""

    mass: Number = believed("mass")
    gravity: Number = given(lambda model: model.gravity)
    most_thrust: Number = given(lambda model: model.most_thrust)
    pace: Number = gain(usual(4.4, 1), "rad/s", "approximate crossover frequency of the shaped loop")
    corner: Number = gain(0.25, "-", "corner frequency of the PI weight over the pace")
    attitude: Number = gain(usual(5.6, 1), "1/s", "P gain of attitude, the lag that the law assumes")
    margin: Number = gain(1.1, "-", "gamma over the smallest achievable", low=1.01, high=10.0)
    integral_bound: Number = gain(5.0, "m s", "bound on the integral of the command")


class LoopShapingGains(NamedTuple):
    """What the law flies: the filter of one axis, and the weight.

    weight: its proportional part, corner: its integral part over that. drift, entry, exit: the filter of one axis, x' =
    pace (drift x + entry y), u = exit x.
    """

    mass: Number
    gravity: Number
    most_thrust: Number
    pace: Number
    corner: Number
    attitude: Number
    weight: Number
    drift: Matrix
    entry: Vector
    exit: Vector
    integral_bound: Number


class LoopShapingMemory(NamedTuple):
    """states: a filter for each axis. integral: of what they ask for, the weight's."""

    states: tuple[Vector, Vector, Vector]
    integral: Vector


class ShapingFilter(NamedTuple):
    """gamma: 1 over the largest error of the coprime factors that the loop stands. a, b, c: of the filter; its d is 0."""

    gamma: float
    a: list[list[float]]
    b: list[float]
    c: list[float]


def shaped(corner: float, lag: float) -> tuple[float, list[list[float]], list[float], list[float]]:
    """The weight's proportional part, and A, B, C of the shaped plant, in units of 1/pace.

    States: position, velocity, acceleration, and the integral of the weight k (1 + corner / s); lag: of the attitude.
    """
    k = sqrt((1.0 + lag * lag) / (1.0 + corner * corner))
    over = k / lag
    a = [[0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, -1.0 / lag, over * corner], [0.0, 0.0, 0.0, 0.0]]
    return k, a, [0.0, 0.0, over, 1.0], [1.0, 0.0, 0.0, 0.0]


def outer(a: Sequence[float], b: Sequence[float]) -> list[list[float]]:
    return [[x * y for y in b] for x in a]


def robust(a: list[list[float]], b: list[float], c: list[float], margin: float) -> ShapingFilter:
    """The law for a plant x' = A x + B u, y = C x, with u = K y: McFarlane and Glover's, for gamma = margin times the least.

    The least gamma is sqrt(1 + the largest eigenvalue of X Z), X and Z from the plant's two Riccati equations. Raises
    ValueError.
    """
    x = riccati(a, outer(b, b), outer(c, c))
    z = riccati(transposed(a), outer(c, c), outer(b, b))
    both = product(x, z)
    direction = [1.0] * len(b)
    eigenvalue = 0.0
    for _ in range(ITERATIONS):
        image = [dot(row, direction) for row in both]
        eigenvalue = sqrt(dot(image, image) / dot(direction, direction))
        direction = [one / eigenvalue for one in image]
    gamma = margin * sqrt(1.0 + eigenvalue)
    square = gamma * gamma
    left = [[entry + (1.0 - square if i == j else 0.0) for j, entry in enumerate(row)] for i, row in enumerate(both)]
    zc = [dot(row, c) for row in z]
    entry = [square * dot(row, zc) for row in inverse(transposed(left))]
    back = [dot(b, column) for column in zip(*x, strict=True)]
    drift = [[a[i][j] - b[i] * back[j] + entry[i] * c[j] for j in range(len(b))] for i in range(len(b))]
    return ShapingFilter(gamma, drift, entry, back)


@dataclass(frozen=True)
class LoopShaping(Controller):
    """A fourth-order position law on each axis, with the path's acceleration and turn of the heading fed forward."""

    name = "loop-shaping"
    label = "H-infinity loop shaping"
    source = "McFarlane, Glover 1992; Cheng, Huzmezan 2003"
    Gains = LoopShapingWeights
    commands = BodyRates

    def prepare(self, gains: LoopShapingWeights, model: Model) -> LoopShapingGains:
        weight, a, b, c = shaped(gains.corner, gains.pace / gains.attitude)
        found = robust(a, b, c, gains.margin)
        drift = Matrix(Vector(row) for row in found.a)
        return from_fields(LoopShapingGains, gains, weight=weight, drift=drift, entry=Vector(found.b), exit=Vector(found.c))

    def start(self, measured: Measured, gains: LoopShapingGains) -> LoopShapingMemory:
        rest = Vector(0.0 for _ in gains.entry)
        return LoopShapingMemory((rest, rest, rest), vector(0.0, 0.0, 0.0))

    def law(
        self, memory: LoopShapingMemory, measured: Measured, reference: Reference, gains: LoopShapingGains,
        t: Number, period: Number,
    ) -> tuple[BodyRates, LoopShapingMemory]:  # fmt: skip
        """One sample; the filters by the midpoint rule."""
        off = measured.position - reference.position
        asked = Vector(gains.exit @ state for state in memory.states)
        level = gains.weight * (asked + gains.corner * memory.integral)
        wanted = reference.acceleration + (gains.pace * gains.pace) * level
        force = within(gains.mass * (wanted + vector(0.0, 0.0, gains.gravity)), gains.most_thrust)
        attitude, turn = turning_attitude(force, reference)
        between = multiply(conjugate(measured.attitude), attitude)
        command = BodyRates(
            thrust=force @ up_axis(rotation_matrix(measured.attitude)),
            rates=gains.attitude * rotation_vector(between) + turn * up_axis(rotation_matrix(between)),
            desired_attitude=yaw_pitch_roll(attitude),
        )
        step = gains.pace * period
        states = []
        for state, y in zip(memory.states, off, strict=True):
            middle = state + (0.5 * step) * (gains.drift @ state + y * gains.entry)
            states.append(state + step * (gains.drift @ middle + y * gains.entry))
        first, second, third = states
        return command, LoopShapingMemory(
            (first, second, third), project(memory.integral + step * asked, gains.integral_bound)
        )

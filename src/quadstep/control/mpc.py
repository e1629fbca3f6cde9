"""Model predictive control: ADMM over the next stages of the path, about the attitude and thrust that it wants anyway.

Deviations from the path, in axes turned by its heading, fall into four chains: level x and y (position, velocity, lean and
its first two rates), climb, and turn. Rotors lag in all of them. Bounds are on the whole lean, angular acceleration and
lift, what the path wants at each stage (`reference.ahead`) included, so they act before they are met. Observers of second
order (Gao 2003) estimate the acceleration and the angular acceleration that nothing in the model explains.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

from quadstep.control.admm import (
    AdmmIterate,
    BoundedChain,
    StageBounds,
    discretised,
    idle,
    inputs_of,
    iterate,
    joined,
    regulator,
)
from quadstep.control.admm import within as bounded
from quadstep.control.filters import observed
from quadstep.control.vectoring import DesiredAttitude, attitude_for, boxed, errors_to, project, up_axis, within
from quadstep.interfaces.controller import Command, Controller, Measured
from quadstep.interfaces.gain import believed, gain, given, usual
from quadstep.interfaces.plant import Model, Reference
from quadstep.numbers import Matrix, Number, Vector, cos, exp, matrix, maximum, minimum, scan, sin, vector
from quadstep.numbers.rotations import (
    conjugate,
    cross,
    multiply,
    quaternion_of,
    rotation_matrix,
    rotation_vector,
)

STAGES, STAGE, ITERATIONS = 12, 0.025, 4
"""Of the horizon, how long one is [s], and how often a solution goes over all of them."""

LEVEL = ("position", "velocity", "lean", "lean rate", "lean acceleration", "input")
CLIMB, TURN = ("position", "velocity", "lift", "input"), ("heading", "rate", "acceleration", "input")
FREE = 1e9
"""A bound that is none."""


class MpcWeights(NamedTuple):
    """The vehicle parameters that the controller assumes, the weights on squared deviations, and the bounds.

    Weights: what one unit of each is worth. Inputs: angular accelerations [rad/s^2], of climb an acceleration [m/s^2].
    """

    mass: Number = believed("mass")
    inertia: Vector = believed("inertia")
    gravity: Number = given(lambda model: model.gravity)
    most_thrust: Number = given(lambda model: model.most_thrust)
    lag: Number = given(lambda model: model.lag)
    level: Vector = gain(
        usual((220.0, 20.0, 4.0, 0.3, 0.0, 0.002), (8, 6, 4, 2, 0, 0)), "-",
        "weights of position, velocity, tilt, its two derivatives and the input", parts=LEVEL, zero=True,
    )  # fmt: skip
    climb: Vector = gain(
        usual((300.0, 10.0, 0.0, 0.3), (4, 2, 0, 0)), "-", "weights of position, velocity, lift and the input",
        parts=CLIMB, zero=True,
    )  # fmt: skip
    turn: Vector = gain(
        usual((4.0, 0.2, 0.0, 0.01), (4, 2, 0, 0), "yaw"), "-", "weights of heading, its two derivatives and the input",
        parts=TURN, zero=True,
    )  # fmt: skip
    penalty: Number = gain(0.1, "-", "rho of ADMM over the weight of the bounded quantity", symbol="rho", tunable=False)
    most_lean: Number = gain(1.0, "-", "largest horizontal acceleration, as a fraction of gravity")
    most_angular: Vector = gain(usual((80.0, 80.0, 12.0), 2, "body"), "rad/s^2", "largest commanded angular acceleration")
    position_reach: Number = gain(0.5, "m", "deviations of position are clipped at this")
    velocity_reach: Number = gain(2.0, "m/s", "deviations of velocity are clipped at this")
    observer: Number = gain(usual(8.0, 1), "1/s", "bandwidth of the acceleration observer", zero=True)
    turn_observer: Number = gain(
        lambda model: 13.0 * minimum(model.agility, 6.0 * model.yaw_agility),  # the heading's loop closes over it, too
        "1/s", "bandwidth of the angular acceleration observer", zero=True,
    )  # fmt: skip
    most_disturbance: Number = gain(8.0, "m/s^2", "largest estimated acceleration")
    most_turn_disturbance: Number = gain(60.0, "rad/s^2", "largest estimated angular acceleration")


class MpcGains(NamedTuple):
    """What the law flies. weights: what it was worked out from. chains: level x, level y, climb, turn."""

    weights: MpcWeights
    chains: tuple[BoundedChain, BoundedChain, BoundedChain, BoundedChain]


class MpcMemory(NamedTuple):
    """duals: of the last solution. velocity [m/s], rates [rad/s]: estimated; push [m/s^2], twist [rad/s^2]: what is not
    explained.

    lift [N], torque [N m]: what the rotors make by now.
    """

    duals: AdmmIterate
    velocity: Vector
    push: Vector
    rates: Vector
    twist: Vector
    lift: Number
    torque: Vector


class PathTarget(NamedTuple):
    """What the path wants now, and how far the vehicle is from it.

    force [N]. feed_forward: angular acceleration, body axes [rad/s^2]. deviation: states of all chains. level: forward and
    left parts of a vector, in axes turned by the path's heading.
    """

    force: Vector
    wanted: DesiredAttitude
    axis: Vector
    feed_forward: Vector
    deviation: Vector


def levelled(yaw: Number, v: Vector) -> tuple[Number, Number]:
    """Forward and left parts of a vector [any unit] for a heading [rad]."""
    s, c = sin(yaw), cos(yaw)
    return c * v[0] + s * v[1], c * v[1] - s * v[0]


def chain(rate: Matrix, weights: Sequence[Number], bounds: Sequence[int], penalty: Number) -> BoundedChain:
    """rate: [A B] of the deviations. weights: of states and input. bounds: states that have some."""
    *states, price = weights
    penalties = [penalty * weight if place in bounds else 0.0 for place, weight in enumerate(states)]
    a, b = discretised(rate, STAGE)
    best = regulator(a, b, [w + rho for w, rho in zip(states, penalties, strict=True)], price * (1.0 + penalty))
    return BoundedChain(best, Vector(penalties), penalty * price)


@dataclass(frozen=True)
class Mpc(Controller):
    """`guide` solves for the horizon, `law` acts on the newest measurement between two solutions."""

    name = "mpc"
    label = "model predictive control"
    source = "Nguyen and others 2024 (TinyMPC)"
    Gains = MpcWeights
    preview: ClassVar[tuple[float, ...]] = tuple(STAGE * stage for stage in range(1, STAGES))
    rates: ClassVar = {"guide": 0.02, "law": 0.002}

    def prepare(self, gains: MpcWeights, model: Model) -> MpcGains:
        """Regulators of the four chains, about hover."""
        slow = 1.0 / maximum(gains.lag, 1e-3)
        level = matrix(
            (0.0, 1.0, 0.0, 0.0, 0.0, 0.0),
            (0.0, 0.0, gains.gravity, 0.0, 0.0, 0.0),
            (0.0, 0.0, 0.0, 1.0, 0.0, 0.0),
            (0.0, 0.0, 0.0, 0.0, 1.0, 0.0),
            (0.0, 0.0, 0.0, 0.0, -slow, slow),
        )
        twice = matrix((0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0), (0.0, 0.0, -slow, slow))
        sideways = chain(level, gains.level.entries, [2], gains.penalty)
        climb, turn = (chain(twice, weights.entries, [], gains.penalty) for weights in (gains.climb, gains.turn))
        return MpcGains(gains, (sideways, sideways, climb, turn))

    def start(self, measured: Measured, gains: MpcGains) -> MpcMemory:
        """No bound met, nothing unexplained."""
        zero, weight = vector(0.0, 0.0, 0.0), gains.weights.mass * gains.weights.gravity
        return MpcMemory(idle(gains.chains, STAGES), measured.velocity, zero, measured.rates, zero, weight, zero)

    def target(self, memory: MpcMemory, measured: Measured, reference: Reference, gains: MpcWeights) -> PathTarget:
        """What the path wants of a vehicle that is pushed as estimated, and the deviations from it."""
        up = vector(0.0, 0.0, gains.gravity)
        force = within(gains.mass * (reference.acceleration - memory.push + up), gains.most_thrust)
        wanted, axis = attitude_for(force, reference, gains.mass), up_axis(rotation_matrix(measured.attitude))
        _, rates, feed_forward = errors_to(wanted, measured)
        tilt = -rotation_vector(multiply(conjugate(measured.attitude), quaternion_of(wanted.rotation)))
        made = memory.torque / gains.inertia - feed_forward
        position = boxed(measured.position - reference.position, gains.position_reach)
        velocity = boxed(measured.velocity - reference.velocity, gains.velocity_reach)
        (p_x, p_y), (v_x, v_y) = levelled(reference.yaw, position), levelled(reference.yaw, velocity)
        lift = (memory.lift * axis[2] - force[2]) / gains.mass
        parts = (
            vector(p_x, v_x, tilt[1], rates[1], made[1]),
            vector(p_y, v_y, -tilt[0], -rates[0], -made[0]),
            vector(position[2], velocity[2], lift),
            vector(tilt[2], rates[2], made[2]),
        )
        return PathTarget(force, wanted, axis, feed_forward, joined(parts))

    def bounds(self, memory: MpcMemory, reference: Reference, gains: MpcWeights) -> StageBounds:
        """Of the deviations at each stage."""
        *stages, final = (self.asked_of(stage) for stage in (reference, *reference.ahead))
        _, (low, high, low_state, high_state) = scan(
            lambda _, row: ((), self.room(row, memory, reference, gains)), (), Matrix(stages)
        )
        _, _, low_last, high_last = self.room(final, memory, reference, gains)
        return StageBounds(low, high, low_state, high_state, low_last, high_last)

    @staticmethod
    def asked_of(stage: Reference) -> Vector:
        """Acceleration and snap of the path at a stage, one after the other."""
        return Vector((*stage.acceleration, *stage.snap))

    def room(
        self, asked: Vector, memory: MpcMemory, reference: Reference, gains: MpcWeights
    ) -> tuple[Vector, Vector, Vector, Vector]:
        """Low and high bounds of inputs and of states at one stage: what is left beside what the path wants there."""
        over_g, reach = 1.0 / gains.gravity, gains.most_thrust / gains.mass - gains.gravity
        most_x, most_y, most_turn = gains.most_angular[1], gains.most_angular[0], gains.most_angular[2]
        acceleration, snap = Vector(asked.entries[:3]), Vector(asked.entries[3:])
        lean = levelled(reference.yaw, over_g * (acceleration - memory.push))
        angular = levelled(reference.yaw, over_g * snap)
        rising = acceleration[2] - memory.push[2]
        most = vector(most_x, most_y, reach, most_turn)
        least = vector(-most_x, -most_y, -0.9 * gains.gravity, -most_turn)
        wanted = vector(*angular, rising, 0.0)
        low_state, high_state = (self.lean_bounds(lean, sign * gains.most_lean, sign * FREE) for sign in (-1.0, 1.0))
        return least - wanted, most - wanted, low_state, high_state

    @staticmethod
    def lean_bounds(lean: tuple[Number, Number], most: Number, free: float) -> Vector:
        """Of the states of all chains, of which only the two leans have any."""
        x, y = lean
        return vector(free, free, most - x, free, free, free, free, most - y, *[free] * 8)

    def guide(
        self, memory: MpcMemory, measured: Measured, reference: Reference, gains: MpcGains, t: Number, period: Number
    ) -> MpcMemory:
        """A few iterations more from the present deviations."""
        weights = gains.weights
        begin = self.target(memory, measured, reference, weights).deviation
        duals, _ = iterate(gains.chains, begin, memory.duals, self.bounds(memory, reference, weights), ITERATIONS)
        return memory._replace(duals=duals)

    def law(
        self, memory: MpcMemory, measured: Measured, reference: Reference, gains: MpcGains, t: Number, period: Number
    ) -> tuple[Command, MpcMemory]:
        """One sample: the first stage's inputs for what is measured now, and the observers."""
        weights, mass, inertia = gains.weights, gains.weights.mass, gains.weights.inertia
        target = self.target(memory, measured, reference, weights)
        low, high, _, _ = self.room(self.asked_of(reference), memory, reference, weights)
        inputs = inputs_of(gains.chains, target.deviation, memory.duals.pulls.rows[0])
        forward, left, rise, around = bounded(inputs, low, high)
        # rotors lag: ask now for what is wanted a time constant later
        change = reference.ahead[0].snap - reference.snap
        lead_x, lead_y = levelled(reference.yaw, (weights.lag / (STAGE * weights.gravity)) * change)
        angular = target.feed_forward + vector(-(left + lead_y), forward + lead_x, around) - memory.twist
        gyroscopic = cross(measured.rates, inertia * measured.rates)
        lifting = target.force + (mass * weights.lag) * reference.jerk + vector(0.0, 0.0, mass * rise)
        command = Command(maximum(lifting @ target.axis, 0.0), inertia * angular + gyroscopic, target.wanted.angles)
        return command, self.observe(memory, measured, weights, period)

    @staticmethod
    def observe(memory: MpcMemory, measured: Measured, gains: MpcWeights, period: Number) -> MpcMemory:
        """What the rotors make, and what moves the vehicle beside them."""
        share = 1.0 - exp(-(period / maximum(gains.lag, 1e-3)))
        axis = up_axis(rotation_matrix(measured.attitude))
        gyroscopic = cross(measured.rates, gains.inertia * measured.rates)
        pulled = (memory.lift / gains.mass) * axis - vector(0.0, 0.0, gains.gravity)
        turned = memory.torque / gains.inertia
        velocity, push = observed(memory.velocity, memory.push, measured.velocity, pulled, gains.observer, period)
        rates, twist = observed(memory.rates, memory.twist, measured.rates, turned, gains.turn_observer, period)
        return memory._replace(
            velocity=velocity,
            push=project(push, gains.most_disturbance),
            rates=rates,
            twist=project(twist, gains.most_turn_disturbance),
            lift=memory.lift + share * (measured.thrust - memory.lift),
            torque=memory.torque + share * (measured.torque - gyroscopic - memory.torque),
        )

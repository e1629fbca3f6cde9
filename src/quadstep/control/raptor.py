"""RAPTOR, a policy trained on a thousand quadrotors that adapts to the one it flies (Eschmann, Albani, Loianno 2025).

A dense layer, a gated recurrent unit and a dense layer of 16 neurons each, with the weights published in the package
`foundation-policy`. It sees errors of position and velocity, the attitude, the body rates and what it last asked for, and asks
for rotor speeds every 10 ms. It is flown as published: forward, left and up are its axes, and nothing in it is tuned.
"""

from dataclasses import dataclass
from functools import cache
from importlib.resources import as_file, files
from typing import Any, ClassVar, NamedTuple, Self

from quadstep.control.mixers import quarters
from quadstep.interfaces.controller import Controller, Measured, RotorSpeeds
from quadstep.interfaces.gain import gain, given
from quadstep.interfaces.plant import Model, Reference
from quadstep.io.doors import needed_by
from quadstep.numbers import Matrix, Number, Vector, clip, maximum, scan, sigmoid, vector
from quadstep.numbers.rotations import conjugate, from_yaw_pitch_roll, multiply, rotation_matrix

UNITS = 16
"""Neurons of each layer."""


class Policy(NamedTuple):
    """Weights as published, each row with its bias behind them.

    first: of the dense layer on 22 inputs, shape (16, 23). recurrent: a row a neuron, for its gates r, z and n one after the
    other what it takes of the layer below and of itself, shape (16, 6 * 17). last: of the four motors, shape (4, 17). begin:
    the neurons before the first sample.
    """

    first: Matrix
    recurrent: Matrix
    last: Matrix
    begin: Vector


class RaptorMemory(NamedTuple):
    """neurons: of the recurrent layer. action: what it last asked of its motors, -1 to 1."""

    neurons: Vector
    action: Vector


@cache
def published() -> Policy:
    """The weights of the installed package. Raises UserError where there is none."""
    with needed_by('controller.type = "raptor"'):
        import h5py  # noqa: PLC0415 (an extra)

        place = files("foundation_policy").joinpath("blob", "checkpoint.h5")
    with as_file(place) as path, h5py.File(path, "r") as file:
        layers = file["actor"]["layers"]

        def values(layer: int, name: str) -> Any:
            return layers[str(layer)][name]["parameters"][()].astype(float).tolist()

        def dense(layer: int) -> Matrix:
            rows = zip(values(layer, "weights"), values(layer, "biases")[0], strict=True)
            return Matrix(Vector((*row, bias)) for row, bias in rows)

        below, beside = (
            [[*row, bias] for row, bias in zip(values(1, f"weights_{one}"), values(1, f"biases_{one}"), strict=True)]
            for one in ("input", "hidden")
        )
        gates = range(0, 3 * UNITS, UNITS)
        recurrent = (
            Vector([w for gate in gates for part in (below, beside) for w in part[gate + unit]]) for unit in range(UNITS)
        )
        return Policy(dense(0), Matrix(recurrent), dense(2), Vector(values(1, "initial_hidden_state")))


class RaptorGains(NamedTuple):
    """The policy, and the rotors' range [rad/s] that its -1 to 1 stand for."""

    policy: Policy = given(lambda _model: published())
    slowest: Number = given(lambda model: model.slowest)
    fastest: Number = given(lambda model: model.fastest)
    reach: Number = gain(1.0, "m", "position errors are clipped at this", tunable=False)


def affine(row: tuple[Number, ...], inputs: Vector) -> Number:
    *weights, bias = row
    return Vector(weights) @ inputs + bias


def layer(weights: Matrix, inputs: Vector) -> Vector:
    """What every neuron of a dense layer takes in."""
    _, made = scan(lambda _, row: ((), vector(affine(row.entries, inputs))), (), weights)
    return Vector(row[0] for row in made)


def gated(weights: Matrix, inputs: Vector, neurons: Vector) -> Vector:
    """The neurons of the recurrent layer a sample later: z h + (1 - z) n, n = tanh(x_n + r h_n) (Cho and others 2014)."""

    def neuron(_: tuple[()], row: tuple[Vector, Vector]) -> tuple[tuple[()], Vector]:
        own, before = row
        size = UNITS + 1
        taken = [affine(own.entries[size * k : size * k + size], (inputs, neurons)[k % 2]) for k in range(6)]
        r, z = sigmoid(taken[0] + taken[1]), sigmoid(taken[2] + taken[3])
        n = 2.0 * sigmoid(2.0 * (taken[4] + r * taken[5])) - 1.0  # tanh
        return (), vector(z * before[0] + (1.0 - z) * n)

    _, made = scan(neuron, (), (weights, Matrix(vector(one) for one in neurons)))
    return Vector(row[0] for row in made)


def act(policy: Policy, observation: Vector, neurons: Vector) -> tuple[Vector, Vector]:
    """What the policy asks of its four motors, and its neurons after that. observation: 22 numbers."""
    first = Vector(maximum(one, 0.0) for one in layer(policy.first, observation))
    neurons = gated(policy.recurrent, first, neurons)
    return layer(policy.last, neurons), neurons


@dataclass(frozen=True)
class Raptor(Controller):
    """A policy trained on a thousand quadrotors. rotors: in its order. mirrored: they spin the other way, so left is right."""

    rotors: tuple[int, ...] = (0, 1, 2, 3)
    mirrored: bool = False

    name = "raptor"
    label = "RAPTOR foundation policy"
    source = "Eschmann, Albani, Loianno 2025"
    Gains = RaptorGains
    commands = RotorSpeeds
    rates: ClassVar = {"law": 0.01}

    @classmethod
    def for_vehicle(cls, model: Model) -> Self:
        """With its rotors in the policy's order."""
        rotors, mirrored = quarters(model, cls.name)
        return cls(rotors[::-1] if mirrored else rotors, mirrored)

    def start(self, measured: Measured, gains: RaptorGains) -> RaptorMemory:
        """Nothing seen or asked for yet."""
        return RaptorMemory(gains.policy.begin, Vector([0.0] * 4))

    def observation(self, measured: Measured, reference: Reference, gains: RaptorGains) -> Vector:
        """All but the last action, in axes turned by the wanted heading."""
        level = conjugate(from_yaw_pitch_roll(vector(reference.yaw, 0.0, 0.0)))
        turn = rotation_matrix(level)
        position, velocity = turn @ (measured.position - reference.position), turn @ (measured.velocity - reference.velocity)
        position = Vector(clip(one, -gains.reach, gains.reach) for one in position)
        attitude = rotation_matrix(multiply(level, measured.attitude))
        rates = measured.rates - vector(0.0, 0.0, reference.yaw_rate)
        side = vector(1.0, -1.0, 1.0) if self.mirrored else vector(1.0, 1.0, 1.0)
        turned = Matrix(one * (side * row) for one, row in zip(side, attitude, strict=True))
        about = -1.0 * (side * rates) if self.mirrored else rates
        return Vector((*(side * position), *(one for row in turned for one in row), *(side * velocity), *about))

    def law(
        self, memory: RaptorMemory, measured: Measured, reference: Reference, gains: RaptorGains, t: Number, period: Number
    ) -> tuple[RotorSpeeds, RaptorMemory]:
        seen = Vector((*self.observation(measured, reference, gains), *memory.action))
        action, neurons = act(gains.policy, seen, memory.neurons)
        action = Vector(clip(one, -1.0, 1.0) for one in action)
        span = 0.5 * (gains.fastest - gains.slowest)
        speeds = {rotor: gains.slowest + span * (one + 1.0) for rotor, one in zip(self.rotors, action, strict=True)}
        return RotorSpeeds(Vector(speeds[rotor] for rotor in sorted(speeds))), RaptorMemory(neurons, action)

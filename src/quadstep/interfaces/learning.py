"""Declares the two nets of an adaptive law, which share one table of a mission's keys.

force_net: Net = net(1, inputs=12, rate=5.0, damping=0.01)
torque_net: Net = net(2, inputs=9, rate=5.0, damping=0.01)
learning_start: Number = nets_start()
weights_1: Matrix = weights(1)
weights_2: Matrix = weights(2)

And the nets: linear in the weights, sigmoid basis, fixed random input weights (Eq. 22, Eq. 23, Eq. 34, Eq. 54).
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple, cast

import numpy as np

from quadstep.interfaces.gain import Default, resolved
from quadstep.interfaces.plant import Model
from quadstep.numbers import Matrix, Number, Vector, absolute, clip, maximum, outer, sigmoid, total

NEURONS, SEED = 10, 1
"""Of each net, and of its fixed input weights, where a mission says nothing."""


class Net(NamedTuple):
    """input_weights: per unit of each input, (N, inputs + 1), last column the bias, never trained. learning_rate: F of the
    learning law, F = F I. damping: kappa of the learning law.
    """

    input_weights: Matrix
    learning_rate: Number
    damping: Number


def random_input_weights(seed: int, stream: int, neurons: int, inputs: int) -> Matrix:
    """Input weights and bias of one net, shape (neurons, inputs + 1), uniform in [-1, 1].

    Drawn from a counter (Philox keyed by seed and stream), neuron by neuron: the first eight neurons of a net of ten
    are the net of eight, on any machine.
    """
    raw = np.random.Philox(key=np.array([seed, stream], dtype=np.uint64)).random_raw(neurons * (inputs + 1))
    uniform = 2.0 * (raw >> np.uint64(11)).astype(np.float64) * 2.0**-53 - 1.0
    return Matrix(Vector(row) for row in uniform.reshape(neurons, inputs + 1).tolist())


class Learning(NamedTuple):
    """What a mission says of both nets. start [s]. rates, dampings: None for what is declared. weights: None for zero."""

    enabled: bool = True
    start: Number = 0.0
    neurons: int = NEURONS
    seed: int = SEED
    rates: tuple[Number | None, Number | None] = (None, None)
    dampings: tuple[Number | None, Number | None] = (None, None)
    weights: tuple[Matrix, Matrix] | None = None


@dataclass(frozen=True)
class DeclaredNet:
    """One net. number: 1 or 2, as in F1 and kappa1, its stream of random input weights too."""

    number: int
    inputs: int
    rate: Default
    damping: float

    def decide(self, gains: object, model: Model, learning: Learning | None) -> Net:
        """The net, with its fixed input weights."""
        said = learning or Learning()
        rate, damping = said.rates[self.number - 1], said.dampings[self.number - 1]
        return Net(
            random_input_weights(said.seed, self.number, said.neurons, self.inputs),
            cast(Number, resolved(self.rate, gains, model)) if rate is None else rate,
            self.damping if damping is None else damping,
        )


@dataclass(frozen=True)
class LearningStart:
    """When both nets switch on."""

    def decide(self, gains: object, model: Model, learning: Learning | None) -> Number:
        """[s]; infinite for never."""
        said = learning or Learning()
        return said.start if said.enabled else math.inf


@dataclass(frozen=True)
class StartWeights:
    """Weights of one net at the start."""

    number: int

    def decide(self, gains: object, model: Model, learning: Learning | None) -> Matrix:
        """Shape (neurons, 3)."""
        said = learning or Learning()
        if said.weights is not None:
            return said.weights[self.number - 1]
        return Matrix([Vector((0.0, 0.0, 0.0)) for _ in range(said.neurons)])


def net(number: int, inputs: int, rate: Default, damping: float) -> Any:
    """Declares the net of this number, 1 or 2. rate: F of Eq. 54. damping: kappa of Eq. 54."""
    return DeclaredNet(number, inputs, rate, damping)


def nets_start() -> Any:
    """Declares when the nets switch on."""
    return LearningStart()


def weights(number: int) -> Any:
    """Declares the weights of the net of this number at the start."""
    return StartWeights(number)


NODES = 9


def hats(x: Number, spacing: Number) -> Vector:
    """The hats at x: at most two are not 0, and all add up to 1. Nodes stand about 0; beyond the last, its value holds."""
    middle = 0.5 * (NODES - 1)
    place = clip(x / spacing, -middle, middle)
    return Vector(maximum(1.0 - absolute(place - (j - middle)), 0.0) for j in range(NODES))


def values(weights: Matrix, regressors: tuple[Vector, ...]) -> Vector:
    """The functions, one a column of the weights, each at its own regressor."""
    return Vector(
        total([row[i] * phi for row, phi in zip(weights, regressor, strict=True)]) for i, regressor in enumerate(regressors)
    )


def growth(regressors: tuple[Vector, ...], errors: Vector) -> Matrix:
    """phi_i e_i of every function i, a column each."""
    return Matrix(
        Vector(regressor[j] * error for regressor, error in zip(regressors, errors, strict=True)) for j in range(NODES)
    )


def basis(net: Net, inputs: Iterable[Number]) -> Vector:
    """mu(chi), the N neurons' outputs: sigmoid of the weighted inputs and a bias."""
    chi = tuple(inputs)

    def neuron(row: Vector) -> Number:
        return sigmoid(total([row[-1], *[w * x for w, x in zip(row, chi, strict=False)]]))

    return net.input_weights.map_rows(neuron)


def output(weights: Matrix, mu: Vector) -> Vector:
    """W_hat^T mu, the net's estimate (Eq. 23, Eq. 34), shape (3,)."""
    return weights.T @ mu


def weight_rate(net: Net, weights: Matrix, mu: Vector, error: Vector, error_norm: Number) -> Matrix:
    """W_hat_dot = F mu r_i^T - kappa |r| F W_hat, shape (N, 3) (Eq. 54). error: r_i; error_norm: |r| of both, (r_1, r_2)."""
    growth = outer(net.learning_rate * mu, error)
    return growth - (net.damping * error_norm * net.learning_rate) * weights

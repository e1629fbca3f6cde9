"""The two neural nets: linear in the weights, sigmoid basis, fixed random input weights (Eq. 22, Eq. 23, Eq. 34, Eq. 54)."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from quadstep.numbers import Matrix, Number, Vector, outer, sigmoid, total


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

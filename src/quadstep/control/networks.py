"""The two neural nets: linear in the weights, sigmoid basis, fixed random input weights (Eq. 22, Eq. 23, Eq. 34, Eq. 54)."""

from collections.abc import Iterable

from quadstep.interfaces.learning import Net
from quadstep.numbers import Matrix, Number, Vector, outer, sigmoid, total


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

"""The two neural nets: linear in the weights, sigmoid basis, fixed random input weights (Eq. 22, Eq. 23, Eq. 34, Eq. 54)."""

from collections.abc import Iterable

from quadstep.interfaces.learning import Net
from quadstep.numbers import Matrix, Number, Vector, absolute, clip, maximum, outer, sigmoid, total

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

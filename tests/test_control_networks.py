"""The two nets: basis and output (Eqs 22, 23, 34), tuning (Eq. 54), and input weights that follow from a seed."""

import numpy as np
import pytest

from quadstep.interfaces.learning import Net, basis, output, random_input_weights, weight_rate
from quadstep.numbers import matrix
from tests.flights import array, column

RNG = np.random.default_rng(41)


def test_basis_of_random_weights_agrees_with_numpy():
    weights, inputs = RNG.normal(size=(6, 13)), RNG.normal(size=12)
    wanted = 1 / (1 + np.exp(-(weights[:, :-1] @ inputs + weights[:, -1])))
    np.testing.assert_allclose(array(basis(Net(matrix(*weights.tolist()), 1.0, 1.0), inputs.tolist())), wanted, rtol=1e-13)


def test_output_is_the_transposed_weights_times_the_basis():
    weights, mu = RNG.normal(size=(6, 3)), RNG.uniform(size=6)
    np.testing.assert_allclose(array(output(matrix(*weights.tolist()), column(mu))), weights.T @ mu, rtol=1e-13)


def test_weights_change_as_eq_54_says():
    weights, mu, r1, r2 = RNG.normal(size=(6, 3)), RNG.uniform(size=6), RNG.normal(size=3), RNG.normal(size=3)
    rate, damping = 5.0, 0.01
    norm = np.linalg.norm([*r1, *r2])
    wanted = rate * np.outer(mu, r1) - damping * norm * rate * weights
    got = weight_rate(Net(matrix((0.0,)), rate, damping), matrix(*weights.tolist()), column(mu), column(r1), norm)
    np.testing.assert_allclose(array(got), wanted, rtol=1e-13)


@pytest.mark.parametrize(("seed", "stream"), [(1, 1), (1, 2), (7, 1), (123456789, 2)])
def test_input_weights_are_numpys_philox_keyed_by_seed_and_stream(seed, stream):
    key = np.array([seed, stream], dtype=np.uint64)
    wanted = np.random.Generator(np.random.Philox(key=key)).uniform(-1, 1, (10, 13))
    np.testing.assert_allclose(array(random_input_weights(seed, stream, 10, 12)), wanted, atol=1e-15)


def test_the_first_eight_neurons_of_ten_are_the_net_of_eight():
    ten, eight = array(random_input_weights(1, 1, 10, 12)), array(random_input_weights(1, 1, 8, 12))
    assert ten[:8].tolist() == eight.tolist()

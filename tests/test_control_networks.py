"""The two nets: basis and output (Eqs 22, 23, 34), tuning (Eq. 54), and input weights that follow from a seed."""

import numpy as np
import pytest

from quadstep.interfaces.learning import Net, basis, output, random_input_weights, weight_rate
from quadstep.numbers import matrix, vector
from tests.flights import array, column

RNG = np.random.default_rng(41)


def test_basis_is_the_sigmoid_of_weighted_inputs_and_a_bias():
    net = Net(matrix((1.0, -2.0, 0.5), (0.0, 0.0, 0.0), (0.0, 3.0, -1.0)), 1.0, 1.0)
    got = array(basis(net, (2.0, 1.0)))
    np.testing.assert_allclose(got, [1 / (1 + np.exp(-0.5)), 0.5, 1 / (1 + np.exp(-2.0))], rtol=1e-15)


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


def test_weight_rate_by_hand():
    net = Net(matrix((0.0,)), 5.0, 0.1)
    got = weight_rate(net, matrix((1.0, 2.0, 3.0)), vector(0.5), vector(2.0, -4.0, 0.0), 2.0)
    np.testing.assert_allclose(array(got), [[5 - 1, -10 - 2, -3]])


def test_input_weights_are_pinned_for_seed_1():
    force, torque = random_input_weights(1, 1, 10, 12), random_input_weights(1, 2, 10, 9)
    assert (len(force), len(force.rows[0])) == (10, 13)
    assert (len(torque), len(torque.rows[0])) == (10, 10)
    assert [force[0, 0], force[0, 12], force[9, 12]] == [-0.8496976978081776, 0.2047746365418106, 0.7045042281164431]
    assert [torque[0, 0], torque[9, 9]] == [-0.3813701776283309, 0.5973969093439897]


@pytest.mark.parametrize(("seed", "stream"), [(1, 1), (1, 2), (7, 1), (123456789, 2)])
def test_input_weights_are_numpys_philox_keyed_by_seed_and_stream(seed, stream):
    key = np.array([seed, stream], dtype=np.uint64)
    wanted = np.random.Generator(np.random.Philox(key=key)).uniform(-1, 1, (10, 13))
    np.testing.assert_allclose(array(random_input_weights(seed, stream, 10, 12)), wanted, atol=1e-15)


def test_input_weights_fill_minus_one_to_one():
    weights = array(random_input_weights(3, 1, 1000, 12))
    assert weights.min() > -1
    assert weights.max() < 1
    assert abs(weights.mean()) < 0.03
    assert weights.std() == pytest.approx(1 / np.sqrt(3), rel=0.02)


def test_the_first_eight_neurons_of_ten_are_the_net_of_eight():
    ten, eight = array(random_input_weights(1, 1, 10, 12)), array(random_input_weights(1, 1, 8, 12))
    assert ten[:8].tolist() == eight.tolist()


def test_streams_and_seeds_give_different_weights():
    nets = [array(random_input_weights(seed, stream, 8, 12)) for seed in (1, 2) for stream in (1, 2)]
    for i, a in enumerate(nets):
        for b in nets[:i]:
            assert np.abs(a - b).min() > 0

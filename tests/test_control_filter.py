"""The command filter against the exact solution of its differential equation."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm

from quadstep.control.filters import Filtered, command_filter
from quadstep.numbers import vector
from tests.flights import array

NUMBER = st.floats(-3, 3)


def numbers(filtered):
    return np.array([array(filtered.value), array(filtered.rate)])


@given(NUMBER, NUMBER, NUMBER, st.floats(0.1, 200), st.floats(1e-4, 1.0))
def test_filter_is_the_exact_solution_of_a_critically_damped_second_order_system(value, rate, command, frequency, period):
    system = np.array([[0, 1, 0], [-(frequency**2), -2 * frequency, frequency**2], [0, 0, 0]])
    wanted = (expm(system * period) @ [value, rate, command])[:2]
    got = numbers(command_filter(Filtered(vector(value), vector(rate)), vector(command), frequency, period))[:, 0]
    np.testing.assert_allclose(got, wanted, rtol=1e-8, atol=1e-8 * (1 + frequency))


def test_filter_rests_on_its_command_and_reaches_it_at_any_sample_rate():
    resting = Filtered(vector(0.5, -0.5), vector(0.0, 0.0))
    assert numbers(command_filter(resting, resting.value, 100.0, 0.004)).tolist() == [[0.5, -0.5], [0.0, 0.0]]
    got = numbers(command_filter(resting, vector(1.0, 2.0), 100.0, 50.0))
    np.testing.assert_allclose(got, [[1, 2], [0, 0]], atol=1e-15)

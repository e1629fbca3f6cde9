"""T_eta (after Eq. 4) and the thrust direction (Eq. 7), derived here from finite rotations."""

import numpy as np
import pytest

from quadstep.interfaces.plant import Kinematics
from quadstep.numbers import vector
from quadstep.vehicle.paper import euler_rate_matrix, euler_rate_partials, thrust_direction
from tests.flights import array, column
from tests.rotations import axis, papers_rotation, rotation

ATTITUDES = np.random.default_rng(11).uniform((-3, -1.4, -3), (3, 1.4, 3), (25, 3))
RATES = np.random.default_rng(12).normal(size=(25, 3))


def body_rates(attitude, rates, rotation=rotation, h=1e-5):
    """The vector of R^T R_dot, by a central difference."""
    slope = (rotation(attitude + h * rates) - rotation(attitude - h * rates)) / (2 * h)
    return axis(rotation(attitude).T @ slope)


@pytest.mark.parametrize(("kinematics", "turned"), [(Kinematics.STANDARD, rotation), (Kinematics.RIGID, papers_rotation)])
def test_the_matrix_gives_the_body_rates_of_its_rotations(kinematics, turned):
    for attitude, rates in zip(ATTITUDES, RATES, strict=True):
        got = array(euler_rate_matrix(column(attitude), kinematics) @ column(rates))
        np.testing.assert_allclose(got, body_rates(attitude, rates, turned), atol=1e-8)


def test_printed_matrix_does_not_give_the_body_rates():
    attitude, rates = np.array([0.3, 0.4, -0.2]), np.array([0.5, -0.7, 0.9])
    got = array(euler_rate_matrix(column(attitude), Kinematics.PRINTED) @ column(rates))
    assert np.abs(got - body_rates(attitude, rates)).max() > 0.1


def test_printed_matrix_is_the_papers_entry_by_entry():
    psi, theta, phi = 0.3, 0.4, -0.2
    s, c = np.sin, np.cos
    wanted = [[-s(theta), 0, 1], [c(theta) * s(psi), c(psi), 0], [c(theta) * c(psi), -s(psi), 0]]
    got = array(euler_rate_matrix(vector(psi, theta, phi), Kinematics.PRINTED))
    np.testing.assert_allclose(got, wanted, rtol=1e-15)


@pytest.mark.parametrize("kinematics", Kinematics)
@pytest.mark.parametrize("axis_number", range(3))
def test_partials_are_the_slopes_of_the_matrix(kinematics, axis_number):
    h = 1e-5 * np.eye(3)[axis_number]
    for attitude in ATTITUDES:
        ahead, behind = (array(euler_rate_matrix(column(a), kinematics)) for a in (attitude + h, attitude - h))
        got = array(euler_rate_partials(column(attitude), kinematics)[axis_number])
        np.testing.assert_allclose(got, (ahead - behind) / 2e-5, atol=1e-9)


def test_thrust_points_along_the_third_axis_of_the_papers_rotation():
    for attitude in ATTITUDES:
        got = array(thrust_direction(column(attitude)))
        np.testing.assert_allclose(got, papers_rotation(attitude)[:, 2], atol=1e-15)
        assert np.linalg.norm(got) == pytest.approx(1, abs=1e-15)


def test_thrust_direction_is_free_of_yaw_and_not_that_of_yaw_pitch_roll():
    attitude = np.array([0.9, 0.4, -0.3])
    assert array(thrust_direction(column(attitude))).tolist() == array(thrust_direction(vector(-2.0, 0.4, -0.3))).tolist()
    assert np.abs(array(thrust_direction(column(attitude))) - rotation(attitude)[:, 2]).max() > 0.1

"""The effective inertia (Eqs 4 and 66) and the Coriolis matrix with its skew symmetry (Eq. 6, and what is wrong with it)."""

import numpy as np
import pytest

from quadstep.interfaces.plant import Kinematics
from quadstep.vehicle.paper import coriolis, coriolis_torque, effective_inertia, effective_inertia_partials
from tests.flights import array, column

UNEQUAL = np.array([5.0, 8.0, 12.0])
CASES = [np.random.default_rng(100 + case).uniform(-1.3, 1.3, (2, 3)) for case in range(15)]


def inertia_matrix(attitude, inertia, kinematics):
    return array(effective_inertia(column(attitude), column(inertia), kinematics))


def slope_along(attitude, rates, inertia, kinematics, h=1e-5):
    ahead, behind = (inertia_matrix(attitude + step * rates, inertia, kinematics) for step in (h, -h))
    return (ahead - behind) / (2 * h)


def printed_coriolis(attitude, rates, inertia, kinematics):
    """Eq. 6 as printed, J_dot - 1/2 d/d_eta (eta_dot^T J), all by differences."""
    slopes = [slope_along(attitude, axis, inertia, kinematics) for axis in np.eye(3)]
    j_dot = sum(slope * rate for slope, rate in zip(slopes, rates, strict=True))
    return j_dot, j_dot - 0.5 * np.array([slope @ rates for slope in slopes])


def test_effective_inertia_of_the_printed_kinematics_is_eq_66_entry_by_entry():
    x, y, z = UNEQUAL
    for (psi, theta, phi), _ in CASES:
        s, c, sp, cp = np.sin(theta), np.cos(theta), np.sin(psi), np.cos(psi)
        wanted = [
            [x * s**2 + y * c**2 * sp**2 + z * c**2 * cp**2, (y - z) * c * sp * cp, -x * s],
            [(y - z) * c * cp * sp, y * cp**2 + z * sp**2, 0],
            [-x * s, 0, x],
        ]
        np.testing.assert_allclose(inertia_matrix((psi, theta, phi), UNEQUAL, Kinematics.PRINTED), wanted, atol=1e-14)


@pytest.mark.parametrize("kinematics", Kinematics)
def test_effective_inertia_of_equal_inertias_depends_on_pitch_alone(kinematics):
    for (psi, theta, phi), _ in CASES:
        s = np.sin(theta)
        wanted = 5 * np.array([[1, 0, -s], [0, 1, 0], [-s, 0, 1]])
        np.testing.assert_allclose(inertia_matrix((psi, theta, phi), (5, 5, 5), kinematics), wanted, atol=1e-14)


@pytest.mark.parametrize("kinematics", Kinematics)
def test_effective_inertia_is_symmetric_and_positive_with_determinant_of_sigma_times_cosine_squared(kinematics):
    for attitude, _ in CASES:
        j = inertia_matrix(attitude, UNEQUAL, kinematics)
        np.testing.assert_allclose(j, j.T, atol=1e-15)
        assert np.linalg.eigvalsh(j).min() > 0
        assert np.linalg.det(j) == pytest.approx(5 * 8 * 12 * np.cos(attitude[1]) ** 2, rel=1e-12)


@pytest.mark.parametrize("kinematics", Kinematics)
def test_partials_of_the_effective_inertia_are_its_slopes(kinematics):
    for attitude, _ in CASES:
        for got, axis in zip(
            effective_inertia_partials(column(attitude), column(UNEQUAL), kinematics), np.eye(3), strict=True
        ):
            np.testing.assert_allclose(array(got), slope_along(attitude, axis, UNEQUAL, kinematics), atol=1e-8)


@pytest.mark.parametrize("kinematics", Kinematics)
def test_coriolis_matrix_times_rates_is_the_coriolis_torque(kinematics):
    for attitude, rates in CASES:
        numbers = column(attitude), column(rates), column(UNEQUAL), kinematics
        np.testing.assert_allclose(array(coriolis(*numbers) @ column(rates)), array(coriolis_torque(*numbers)), atol=1e-13)


@pytest.mark.parametrize("kinematics", Kinematics)
def test_inertia_rate_less_twice_the_coriolis_matrix_is_skew(kinematics):
    for attitude, rates in CASES:
        c = array(coriolis(column(attitude), column(rates), column(UNEQUAL), kinematics))
        skew = slope_along(attitude, rates, UNEQUAL, kinematics) - 2 * c
        np.testing.assert_allclose(skew, -skew.T, atol=1e-8)
        assert np.abs(skew).max() > 1e-3


@pytest.mark.parametrize("kinematics", Kinematics)
def test_coriolis_as_printed_in_eq_6_gives_the_same_torque(kinematics):
    for attitude, rates in CASES:
        _, c = printed_coriolis(attitude, rates, UNEQUAL, kinematics)
        got = array(coriolis_torque(column(attitude), column(rates), column(UNEQUAL), kinematics))
        np.testing.assert_allclose(got, c @ rates, atol=1e-8)


@pytest.mark.parametrize(("inertia", "kinematics", "value"), [
    ((5, 5, 5), Kinematics.PRINTED, 2.763),
    ((5, 5, 5), Kinematics.STANDARD, 2.763),
    ((5, 8, 12), Kinematics.PRINTED, -6.362),
    ((5, 8, 12), Kinematics.STANDARD, 8.199),
])  # fmt: skip
def test_counterexample_to_the_skewness_claimed_for_eq_6(inertia, kinematics, value):
    attitude, rates, r = np.array([0.3, 0.4, -0.2]), np.array([0.5, -0.7, 0.9]), np.array([1, 2, -1])
    j_dot, c = printed_coriolis(attitude, rates, np.array(inertia), kinematics)
    assert r @ (j_dot - 2 * c) @ r == pytest.approx(value, abs=5e-4)
    christoffel = array(coriolis(column(attitude), column(rates), column(inertia), kinematics))
    assert r @ (j_dot - 2 * christoffel) @ r == pytest.approx(0, abs=1e-8)


def test_eq_6_for_equal_inertias_misses_skewness_by_the_matrix_of_the_reading():
    (_, theta, _), (psi_dot, theta_dot, phi_dot) = CASES[0]
    j_dot, c = printed_coriolis(*CASES[0], np.full(3, 5.0), Kinematics.PRINTED)
    wanted = 5 * np.cos(theta) * np.array([[0, 0, theta_dot], [-phi_dot, 0, -psi_dot], [theta_dot, 0, 0]])
    np.testing.assert_allclose(j_dot - 2 * c, wanted, atol=1e-8)

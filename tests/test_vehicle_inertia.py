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


@pytest.mark.parametrize("kinematics", Kinematics)
def test_partials_of_the_effective_inertia_are_its_slopes(kinematics):
    for attitude, _ in CASES:
        for got, axis in zip(
            effective_inertia_partials(column(attitude), column(UNEQUAL), kinematics), np.eye(3), strict=True
        ):
            np.testing.assert_allclose(array(got), slope_along(attitude, axis, UNEQUAL, kinematics), atol=1e-8)


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

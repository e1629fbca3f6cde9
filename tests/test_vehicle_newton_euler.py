"""The attitude equation against Newton-Euler and against Lagrange's equations, both derived here from scratch."""

from functools import cache

import numpy as np
import pytest
import sympy

from quadstep.interfaces.plant import Kinematics
from quadstep.vehicle.paper import angular_acceleration, coriolis, coriolis_torque, effective_inertia
from tests.flights import array, column, vehicle
from tests.rotations import about_x, about_y

UNEQUAL = np.array([5.0, 8.0, 12.0])
CASES = [np.random.default_rng(case).uniform(-1.3, 1.3, (3, 3)) for case in range(12)]


def rate_matrix(attitude):
    """Body axes of yaw, pitch and roll under R = Rz Ry Rx, as columns; works for complex angles too."""
    _, theta, phi = attitude
    roll, pitch = about_x(phi), about_y(theta)
    return np.column_stack([(pitch @ roll).T @ [0, 0, 1], roll.T @ [0, 1, 0], [1, 0, 0]])


def newton_euler(inertia, attitude, rates, torque):
    """eta_dd from Sigma omega_dot + omega x Sigma omega = M_body, with M_body = T^-T tau and omega = T eta_dot."""
    t = rate_matrix(attitude)
    t_dot = rate_matrix(attitude + 1e-30j * rates).imag / 1e-30
    omega = t @ rates
    omega_dot = (np.linalg.solve(t.T, torque) - np.cross(omega, inertia * omega)) / inertia
    return np.linalg.solve(t, omega_dot - t_dot @ rates)


def ours(inertia, attitude, rates, torque, kinematics):
    body = vehicle(inertia)
    return array(angular_acceleration(body, column(attitude), column(rates), column(torque), kinematics))


def test_for_unequal_inertias_standard_kinematics_agree_with_newton_euler_and_printed_ones_do_not():
    for motion in CASES:
        wanted = newton_euler(UNEQUAL, *motion)
        np.testing.assert_allclose(ours(UNEQUAL, *motion, Kinematics.STANDARD), wanted, rtol=1e-9, atol=1e-9)
        assert np.abs(ours(UNEQUAL, *motion, Kinematics.PRINTED) - wanted).max() > 1e-3


def test_both_kinematics_agree_with_newton_euler_for_the_papers_equal_inertias():
    for motion in CASES:
        wanted = newton_euler(np.full(3, 5.0), *motion)
        for kinematics in Kinematics:
            np.testing.assert_allclose(ours((5, 5, 5), *motion, kinematics), wanted, rtol=1e-9, atol=1e-9)


def test_a_body_turned_about_one_axis_accelerates_by_torque_over_inertia():
    nothing = np.zeros(3)
    for torque, wanted in [((12, 0, 0), (1, 0, 0)), ((0, 8, 0), (0, 1, 0)), ((0, 0, 5), (0, 0, 1))]:
        np.testing.assert_allclose(ours(UNEQUAL, nothing, nothing, torque, Kinematics.STANDARD), wanted, atol=1e-15)


def test_unequal_inertias_couple_the_axes_as_eulers_equations_say():
    # at zero attitude p, q, r = phi_dot, theta_dot, psi_dot; Iy q_dot = (Iz - Ix) p r; T_dot adds -psi_dot phi_dot to q_dot
    psi_dot, phi_dot = 0.5, 0.7
    got = ours(UNEQUAL, np.zeros(3), np.array([psi_dot, 0, phi_dot]), np.zeros(3), Kinematics.STANDARD)
    np.testing.assert_allclose(got, [0, (12 - 5) / 8 * phi_dot * psi_dot - phi_dot * psi_dot, 0], atol=1e-15)


@cache
def symbolic(kinematics):
    """J, Christoffel's C, and (mass matrix, bias) of Lagrange's equations from the kinetic energy, as functions."""
    angles = sympy.symbols("psi theta phi")
    rates = sympy.symbols("psi_dot theta_dot phi_dot")
    inertia = sympy.symbols("a b c")
    theta, angle = angles[1], angles[2 if kinematics is Kinematics.STANDARD else 0]
    s, c = sympy.sin, sympy.cos
    t = sympy.Matrix([[-s(theta), 0, 1], [c(theta) * s(angle), c(angle), 0], [c(theta) * c(angle), -s(angle), 0]])
    if kinematics is Kinematics.RIGID:
        t = sympy.Matrix([[0, s(angle), -c(angle) * c(theta)], [0, -c(angle), -s(angle) * c(theta)], [-1, 0, s(theta)]])
    omega = t * sympy.Matrix(rates)
    kinetic = sum(i * w**2 for i, w in zip(inertia, omega, strict=True)) / 2
    momentum = sympy.Matrix([sympy.diff(kinetic, rate) for rate in rates])
    mass = momentum.jacobian(rates)
    bias = momentum.jacobian(angles) * sympy.Matrix(rates) - sympy.Matrix([sympy.diff(kinetic, a) for a in angles])

    def christoffel(i, j):
        slopes = (
            sympy.diff(mass[i, j], angles[k]) + sympy.diff(mass[i, k], angles[j]) - sympy.diff(mass[j, k], angles[i])
            for k in range(3)
        )
        return sum(slope * rate for slope, rate in zip(slopes, rates, strict=True)) / 2

    names = (*angles, *rates, *inertia)
    return [sympy.lambdify(names, thing) for thing in (mass, sympy.Matrix(3, 3, christoffel), bias)]


@pytest.mark.parametrize("kinematics", Kinematics)
def test_acceleration_solves_lagranges_equations_of_the_kinetic_energy(kinematics):
    mass, _, bias = symbolic(kinematics)
    for attitude, rates, torque in CASES:
        numbers = (*attitude, *rates, *UNEQUAL)
        wanted = np.linalg.solve(mass(*numbers), torque - bias(*numbers)[:, 0])
        np.testing.assert_allclose(ours(UNEQUAL, attitude, rates, torque, kinematics), wanted, rtol=1e-9, atol=1e-10)


@pytest.mark.parametrize("kinematics", Kinematics)
def test_effective_inertia_is_the_second_slope_of_the_kinetic_energy(kinematics):
    for attitude, rates, _ in CASES:
        wanted = symbolic(kinematics)[0](*attitude, *rates, *UNEQUAL)
        np.testing.assert_allclose(array(effective_inertia(column(attitude), column(UNEQUAL), kinematics)), wanted, atol=1e-12)


@pytest.mark.parametrize("kinematics", Kinematics)
def test_coriolis_matrix_is_made_of_christoffel_symbols(kinematics):
    for attitude, rates, _ in CASES:
        wanted = symbolic(kinematics)[1](*attitude, *rates, *UNEQUAL)
        got = array(coriolis(column(attitude), column(rates), column(UNEQUAL), kinematics))
        np.testing.assert_allclose(got, wanted, atol=1e-12)


@pytest.mark.parametrize("kinematics", Kinematics)
def test_coriolis_torque_is_the_bias_of_lagranges_equations(kinematics):
    for attitude, rates, _ in CASES:
        wanted = symbolic(kinematics)[2](*attitude, *rates, *UNEQUAL)[:, 0]
        got = array(coriolis_torque(column(attitude), column(rates), column(UNEQUAL), kinematics))
        np.testing.assert_allclose(got, wanted, atol=1e-12)
